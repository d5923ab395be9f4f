"""Hand-written C: no file calls itself through other files, and static names are unique."""

from __future__ import annotations

import re
from collections import defaultdict
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

from tests.support.paths import ROOT

FILES = sorted(path for path in (ROOT / "runtime").glob("**/c/*.[ch]"))
_NO_CODE = re.compile(r'/\*.*?\*/|"(?:\\.|[^"\\\n])*"', re.DOTALL)
#: A definition begins in the first column, and so does its brace, unless all is on one line.
_DEFINITION = re.compile(r"^(\w[^;{}()=]*?[ *])(\w+)\([^;{}]*\)\s*\{", re.MULTILINE)
_MACRO = re.compile(r"^#define(?:\\\n|.)*", re.MULTILINE)


def code_of(path: Path) -> str:
    """Text of a C file without comments and strings."""
    return _NO_CODE.sub(" ", path.read_text(encoding="utf-8"))


def definitions(path: Path) -> dict[str, bool]:
    """Function name -> whether it is local to the files that contain or include it."""
    return {
        match[2]: "static" in match[1] or "MSTMM_INLINE" in match[1]
        for match in _DEFINITION.finditer(_MACRO.sub("", code_of(path)))
    }


def callees(files: dict[str, str], owners: dict[str, str]) -> dict[str, set[str]]:
    """File -> files whose functions it names, without itself."""
    return {
        name: {owners[word] for word in re.findall(r"\w+", code) if word in owners} - {name}
        for name, code in files.items()
    }


def test_files_do_not_call_each_other_in_circles() -> None:
    sources = [path for path in FILES if path.suffix == ".c"]
    names = {path: path.relative_to(ROOT).as_posix() for path in sources}
    owners = {
        function: names[path]
        for path in sources
        for function, is_local in definitions(path).items()
        if not is_local
    }
    assert len(owners) > 200  # the pattern still finds definitions
    calls = callees({names[path]: code_of(path) for path in sources}, owners)
    try:
        TopologicalSorter(calls).prepare()
    except CycleError as error:
        pytest.fail(f"circle of calls: {' <- '.join(error.args[1])}")


def test_static_functions_have_unique_names() -> None:
    files = defaultdict(list)
    for path in FILES:
        for function, is_local in definitions(path).items():
            if is_local:
                files[function].append(path.name)
    assert len(files) > 500
    assert {name: where for name, where in files.items() if len(where) > 1} == {}
