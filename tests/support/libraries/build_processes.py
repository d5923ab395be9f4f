"""A process that forks into many, all of which want libraries at the same moment.

Usage: python build_processes.py FACTOR...: one child per number, each asks for the library of its
factor.
Prints "child PID", one line each; each child prints "FACTOR VALUE HOW" or the reason it failed.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[3]))

from mstmm.errors import EnvironmentFailure
from mstmm.runtime.libraries import cache
from mstmm.runtime.platform_support import file_lock, subprocesses  # noqa: F401 - before fork
from tests.support.libraries.library_recipes import Kernel, library_value


def child(factor: int) -> str:
    try:
        built = cache.library(Kernel(factor).recipe)
        return f"{factor} {library_value(built.path, built.key):g} {built.how} {built.note}\n"
    except EnvironmentFailure as error:
        return f"{factor} failed: {error}\n"


def main() -> None:
    gate, opened = os.pipe()
    pids = []
    for factor in map(int, sys.argv[1:]):
        pid = os.fork()
        if pid == 0:
            os.close(opened)
            os.read(gate, 1)  # returns when the parent lets go
            os.write(1, child(factor).encode())
            os._exit(0)
        pids.append(pid)
    os.write(1, "".join(f"child {pid}\n" for pid in pids).encode())
    os.close(opened)
    for pid in pids:
        os.waitpid(pid, 0)


main()
