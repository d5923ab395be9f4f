"""Long work of compiled libraries in a process of its own, which an interrupt ends at once.

A library that keeps Python's lock until it is done, as a sparse factorisation does, lets no signal
through: an interrupt would wait for its end, and so would whatever shows that something goes on.
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

from .process import run

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


def apart(what: str, work: Callable[..., Outcome], *arguments: Any) -> Outcome:
    """work(*arguments), done by another Python that is killed when this one is interrupted.

    `work` is a function of a module, and it, its arguments and what it gives or raises go through
    `pickle`.  Within an embedded Python, which cannot start another one, it is called right here.
    Raises EnvironmentFailure, naming `what` is computed, if the process comes to a violent end.
    """
    if not sys.executable:
        return work(*arguments)
    with TemporaryDirectory(prefix="mstmm-apart-") as name:
        folder = Path(name)
        asked, found = folder / "asked", folder / "found"
        asked.write_bytes(pickle.dumps((work, arguments), pickle.HIGHEST_PROTOCOL))
        command = [sys.executable, "-P", "-c", _SCRIPT, str(asked), str(found)]
        here = os.pathsep.join(os.path.abspath(place) for place in sys.path)
        ended = run(command, folder, math.inf, PYTHONPATH=here)
        if ended.code != 0:
            raise _gone(what, ended.signal() if ended.code < 0 else _last_line(ended.said))
        well, outcome = pickle.loads(found.read_bytes())
    if not well:
        raise outcome
    return outcome


def _last_line(said: str) -> str:
    lines = said.strip().splitlines()
    return lines[-1] if lines else "without a word"


def _gone(what: str, how: str) -> EnvironmentFailure:
    return EnvironmentFailure(
        f"{what}: the process that computed it ended before its time ({how}); where memory ran "
        "out, take a coarser mesh"
    )
