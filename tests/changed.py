"""Runs the tests of the files given, or of what differs from the last commit.

    python -m tests.changed                              # the changed tree
    python -m tests.changed runtime/linear/modes.py -x   # one file; from an option on, pytest's

A file without a test of its own runs the tests of its folder.  What other packages do with it is
tested by the whole suite alone.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from itertools import takewhile
from pathlib import Path

import pytest

from tests.support.paths import ROOT, TESTS

_PRODUCT = ("mstmm", "derive", "runtime")


def find_tests(path: Path) -> list[Path]:
    """Test files or folders for a file of the checkout, both relative to its root."""
    if path.parts[0] == "tests":
        return [path] if path.name.startswith("test_") and (ROOT / path).exists() else []
    if path.parts[0] == "docs" or path.name == "README.md":
        return [Path("tests", "system", "docs")]
    if path.parts[0] not in _PRODUCT:
        return []
    folder = TESTS / path.parent
    own = [f for f in sorted(folder.glob(f"test_{path.stem}*.py")) if f.is_file()]
    while not folder.is_dir():
        folder = folder.parent
    return [found.relative_to(ROOT) for found in own or [folder]]


def changed_files() -> list[Path]:
    """Files that differ from the last commit, and new ones."""
    commands = ("git diff --name-only HEAD", "git ls-files --others --exclude-standard")
    lines = (
        subprocess.run(command.split(), cwd=ROOT, capture_output=True, text=True, check=True)
        for command in commands
    )
    return [Path(name) for result in lines for name in result.stdout.splitlines()]


def main(arguments: Sequence[str]) -> int:
    """Run pytest on the tests of the files among the arguments; its exit status."""
    names = list(takewhile(lambda text: not text.startswith("-"), arguments))
    options = arguments[len(names) :]
    paths = [Path(name).resolve().relative_to(ROOT) for name in names] or changed_files()
    targets = sorted({str(found) for path in paths for found in find_tests(path)})
    if not targets:
        print("no tests for these files")
        return 0
    print("pytest", *options, *targets)
    return int(pytest.main([*options, *targets]))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
