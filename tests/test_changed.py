"""The command that finds the tests of changed files."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.changed import find_tests


@pytest.mark.parametrize(
    "path, expected",
    [
        ("runtime/linear/modes.py", "tests/runtime/linear/test_modes.py"),
        ("runtime/integrate/c/simd_lanes.c", "tests/runtime/integrate/c/test_simd_lanes.py"),
        ("tests/test_changed.py", "tests/test_changed.py"),
        ("docs/howto/plots.md", "tests/system/docs"),
        ("mstmm/scene/tables/no_such_file.py", "tests/mstmm/scene/tables"),
    ],
)
def test_find_tests_a_file(path: str, expected: str) -> None:
    found = [str(one) for one in find_tests(Path(path))]
    assert any(one.startswith(expected) for one in found), found


def test_a_module_without_its_own_test_runs_its_folder() -> None:
    (found,) = find_tests(Path("runtime/linear/__init__.py"))
    assert found == Path("tests/runtime/linear")
    assert find_tests(Path("LICENSE")) == []
