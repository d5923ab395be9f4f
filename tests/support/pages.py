"""A page as its reader follows it: files are written, Python and commands run, from top to bottom.

A fenced block is `python`, `console` or `sh`, and runs; or `toml`, `text` or `{...}`, and does not.
What the reader does not see stands in comments:

- a block whose lead-in ends with a colon and names a file of its kind is that file;
- `<!-- not run: reason -->` before a block keeps it from running;
- `<!-- run first: ... -->` is Python that runs there: what the text takes for given.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import shlex
import subprocess
import sys
import textwrap
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from mstmm.runtime.integrate import steppers
from tests.support.paths import ROOT
from tests.support.preloaded_process import run_command

#: Every page; a new one is found by itself.
PAGES = [
    path.relative_to(ROOT).as_posix()
    for path in (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")))
]

RUN = ("python", "console", "sh")
SHOWN = ("toml", "text")
_SUFFIXES = {"python": ".py", "toml": ".toml"}

_BLOCK = re.compile(
    r"^(?P<indent> *)```(?P<language>.*)\n(?P<text>(?:.*\n)*?)(?P=indent)```$"
    r"|^<!-- run first:\n(?P<hidden>(?:.*\n)*?)-->$",
    re.M,
)
_REASON = re.compile(r"<!-- not run: (.+?) -->\s*\Z", re.S)
_FILE = re.compile(r"`([\w-]+\.\w+)`")


@dataclass(frozen=True)
class Block:
    """A block of a page: what it is, its text, from which line on, the name of the file that it
    shows, the reason for which it does not run."""

    language: str
    text: str
    line: int
    file: str = ""
    reason: str = ""


@dataclass(frozen=True)
class Played:
    """The names that the Python of a page leaves behind, what it printed, and its folder."""

    names: dict[str, Any]
    printed: str
    folder: Path


Follow = Callable[[str], Played]


def page_text(page: str) -> str:
    return (ROOT / page).read_text("utf-8")


def blocks(text: str) -> Iterator[Block]:
    """The blocks of a page in their order."""
    end = 0
    for found in _BLOCK.finditer(text):
        before, end = text[end : found.start()], found.end()
        line = text.count("\n", 0, found.start()) + 1
        if found["hidden"] is not None:
            yield Block("python", found["hidden"], line)
            continue
        language = found["language"]
        reason = _REASON.search(before)
        names = _FILE.findall(before.rstrip().rpartition("\n\n")[2])
        named = [name for name in names if Path(name).suffix == _SUFFIXES.get(language)]
        file = named[-1] if named and before.rstrip().endswith(":") else ""
        yield Block(
            language, textwrap.dedent(found["text"]), line, file, reason[1] if reason else ""
        )


def block_texts(page: str, language: str) -> list[str]:
    """The texts of a page's blocks of a language."""
    return [block.text for block in blocks(page_text(page)) if block.language == language]


def play(page: str, folder: Path) -> Played:
    """Follow a page in an empty folder, with a kernel store of its own."""
    names: dict[str, Any] = {"__name__": "page"}
    said = io.StringIO()
    (folder / "bin").mkdir()
    program = folder / "bin" / "mstmm"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m mstmm "$@"\n')
    program.chmod(0o755)
    work = folder / "work"
    work.mkdir()
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(said):
        patch.chdir(work)
        patch.setenv("MSTMM_KERNELS", str(work / "kernels"))
        patch.setenv("PATH", f"{folder / 'bin'}{os.pathsep}{os.environ['PATH']}")
        patch.setattr(steppers, "_registered_methods", {})
        for block in blocks(page_text(page)):
            _follow(page, block, names)
    return Played(names, said.getvalue(), work)


def _follow(page: str, block: Block, names: dict[str, Any]) -> None:
    if block.file:
        Path(block.file).write_text(block.text, encoding="utf-8")
    elif block.language not in RUN or block.reason:
        return
    elif block.language == "python":
        lines = "\n" * block.line + block.text  # so that a traceback tells the line of the page
        exec(compile(lines, str(ROOT / page), "exec"), names)
    elif commands := plain_commands(block.text):
        for arguments in commands:
            command = run_command(arguments, Path.cwd())
            where = f"{page}:{block.line}\n{shlex.join(['mstmm', *arguments])}"
            assert command.returncode == 0, f"{where}\n{command.stdout}\n{command.stderr}"
    else:
        done = subprocess.run(
            ["bash", "-euo", "pipefail", "-c", block.text],
            check=False, capture_output=True, text=True,
        )  # fmt: skip
        where = f"{page}:{block.line}"
        assert done.returncode == 0, f"{where}\n{block.text}\n{done.stdout}\n{done.stderr}"


def plain_commands(text: str) -> list[list[str]]:
    """Arguments of each `mstmm` command, if a block has these alone and needs no shell for them."""
    lines = text.replace("\\\n", " ").splitlines()
    words = [found for line in lines if (found := shlex.split(line, comments=True))]
    plain = all(
        first == "mstmm" and not re.search(r"[|<>&;$*?~`]", " ".join(more))
        for first, *more in words
    )
    return [more for _, *more in words] if plain else []
