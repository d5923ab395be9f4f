"""Work on threads that Ctrl-C and SIGTERM end."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from typing import TypeVar

from ...platform_support.interrupts import record_interrupts
from ..integration_run import SLICE

T = TypeVar("T")


def on_threads(
    work: Callable[[T], None], items: Iterable[T], threads: int, stop: threading.Event
) -> None:
    """Do `work` for every item.  The first exception of one of them is raised.

    Where it fails or is interrupted `stop` is set, which work has to look at often, and what has
    not begun does not begin.  Raises KeyboardInterrupt after an interrupt, once all have stopped.
    """
    with record_interrupts() as interrupted, ThreadPoolExecutor(threads) as pool:
        futures = [pool.submit(work, item) for item in items]
        waiting, failed = set(futures), False
        while waiting and not (failed or interrupted):
            done, waiting = wait(waiting, timeout=SLICE, return_when=FIRST_EXCEPTION)
            failed = any(future.exception() is not None for future in done)
        if waiting:
            stop.set()
            pool.shutdown(cancel_futures=True)
    for future in futures:
        if not future.cancelled():
            future.result()
    if waiting:
        raise KeyboardInterrupt
