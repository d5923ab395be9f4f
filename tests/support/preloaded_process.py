"""Programs that run in a process of their own in which the package is imported already.

A server imports it once and is forked for each program; an interpreter of its own would import for
one to two seconds.
"""

from __future__ import annotations

import multiprocessing
import os
import pkgutil
import runpy
import sys
import tempfile
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import mstmm


@dataclass(frozen=True)
class Finished:
    """Exit status and what was printed."""

    returncode: int | None
    stdout: str
    stderr: str


@cache
def _server() -> Any:
    """Where programs start; imports wait until the first one does."""
    context = multiprocessing.get_context("forkserver")
    modules = [found.name for found in pkgutil.walk_packages(mstmm.__path__, "mstmm.")]
    context.set_forkserver_preload([*modules, "matplotlib.pyplot", "scipy.integrate", "xarray"])
    return context


def run_script(script: Path, arguments: Sequence[str], folder: Path) -> Finished:
    """`python -W error SCRIPT ARGUMENTS` in a folder."""
    return _run(folder, _script, script, arguments)


def run_command(arguments: Sequence[str], folder: Path) -> Finished:
    """`mstmm ARGUMENTS` in a folder."""
    return _run(folder, _command, arguments)


def _run(folder: Path, program: Callable[..., None], *arguments: Any) -> Finished:
    with tempfile.TemporaryDirectory() as place:
        paths = [Path(place, name) for name in ("stdout", "stderr")]
        process = _server().Process(
            target=_enter, args=(paths, folder, dict(os.environ), program, *arguments)
        )
        process.start()
        process.join()
        said = [path.read_text("utf-8") if path.exists() else "" for path in paths]
        return Finished(process.exitcode, *said)


def _enter(
    paths: Sequence[Path], folder: Path, environment: dict[str, str], program: Callable[..., None],
    *arguments: Any,
) -> None:  # fmt: skip
    for number, path in zip((1, 2), paths, strict=True):
        os.dup2(os.open(path, os.O_WRONLY | os.O_CREAT), number)
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(folder)
    program(*arguments)


def _script(script: Path, arguments: Sequence[str]) -> None:
    warnings.simplefilter("error")
    sys.argv = [str(script), *arguments]
    sys.path.insert(0, str(script.parent))
    runpy.run_path(str(script), run_name="__main__")


def _command(arguments: Sequence[str]) -> None:
    from mstmm.__main__ import main

    sys.argv = ["mstmm", *arguments]
    main()
