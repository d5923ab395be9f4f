"""Threads that Ctrl-C and SIGTERM interrupt."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from typing import TypeVar

from ...platform_support.interrupts import record_interrupts
from ..integration_run import SLICE

T = TypeVar("T")


def run_on_threads(
    work: Callable[[T], None], items: Iterable[T], threads: int, stop: threading.Event
) -> None:
    """Call `work` for every item on several threads, and raise the first exception of a call.

    After a failure or an interrupt `stop` is set, which `work` must check often, and no further
    call starts.  Raises KeyboardInterrupt after an interrupt, once all threads have stopped.
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
