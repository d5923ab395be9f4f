"""Plain data of dataclasses: stored keys, nesting, and what is refused on the way back."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import pytest

from mstmm.plain_data import from_plain, stored_as, to_plain


@dataclass(frozen=True)
class Step:
    length: float = field(metadata=stored_as("h"))
    count: int = field(default=1, metadata=stored_as("n"))


@dataclass(frozen=True)
class Run:
    name: str
    steps: tuple[Step, ...]


def test_fields_are_stored_under_their_keys() -> None:
    run = Run("first", (Step(0.1, 3), Step(0.2)))
    assert to_plain(run) == {"name": "first", "steps": [{"h": 0.1, "n": 3}, {"h": 0.2, "n": 1}]}
    assert to_plain({"all": [run.steps[0]], "none": None}) == {
        "all": [{"h": 0.1, "n": 3}], "none": None
    }  # fmt: skip


def test_plain_data_restore_the_dataclass() -> None:
    assert from_plain(Step, to_plain(Step(0.1, 3))) == Step(0.1, 3)
    assert from_plain(Step, {"h": 0.2}) == Step(0.2)


@pytest.mark.parametrize("wrong", [{}, {"n": 2}, {"h": 0.1, "length": 0.1}, {"length": 0.1}])
def test_unknown_and_missing_keys_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(TypeError):
        from_plain(Step, wrong)
