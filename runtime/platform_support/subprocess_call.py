"""Run long calls of compiled libraries in a separate process that an interrupt ends at once.

A library that holds Python's global lock until it returns, such as a sparse factorisation, blocks
signals: an interrupt and every progress display would wait for its end.
"""

from __future__ import annotations

import math
import os
import pickle
import sys
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeVar

from mstmm.errors import EnvironmentFailure

from .subprocesses import run

Outcome = TypeVar("Outcome")

_SCRIPT = """\
import pickle, sys
with open(sys.argv[1], "rb") as file:
    work, arguments = pickle.load(file)
try:
    found = True, work(*arguments)
except Exception as failure:
    found = False, failure
with open(sys.argv[2], "wb") as file:
    pickle.dump(found, file, pickle.HIGHEST_PROTOCOL)
"""


def run_in_subprocess(what: str, work: Callable[..., Outcome], *arguments: Any) -> Outcome:
    """Compute work(*arguments) in another Python process that an interrupt of this one kills.

    `work` is a function of a module; it, its arguments and its result or exception are pickled.
    An embedded Python, which cannot start another process, calls it directly.
    Raises EnvironmentFailure with `what`, the name of the computed quantity, if the process crashes
    or is killed.
    """
    if not sys.executable:
        return work(*arguments)
    with TemporaryDirectory(prefix="mstmm-apart-") as folder_name:
        folder = Path(folder_name)
        request_path, result_path = folder / "asked", folder / "found"
        request_path.write_bytes(pickle.dumps((work, arguments), pickle.HIGHEST_PROTOCOL))
        command = [sys.executable, "-P", "-c", _SCRIPT, str(request_path), str(result_path)]
        search_path = os.pathsep.join(os.path.abspath(path) for path in sys.path)
        process_result = run(command, folder, math.inf, PYTHONPATH=search_path)
        if process_result.code != 0:
            raise _lost_process_error(
                what,
                process_result.signal()
                if process_result.code < 0
                else _last_line(process_result.output),
            )
        is_success, result = pickle.loads(result_path.read_bytes())
    if not is_success:
        raise result
    return result


def _last_line(said: str) -> str:
    lines = said.strip().splitlines()
    return lines[-1] if lines else "no message"


def _lost_process_error(what: str, how: str) -> EnvironmentFailure:
    return EnvironmentFailure(
        f"{what}: the process that computed it ended unexpectedly ({how}); if memory ran out, use "
        "a coarser mesh"
    )
