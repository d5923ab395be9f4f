"""Units in text and degrees for radians: what to write instead is said, with the number."""

from __future__ import annotations

import math
from typing import Any

import pytest

import mstmm
from tests.support.scenes.minimal import one_rod


@pytest.mark.parametrize(
    ("written", "words"),
    [
        (
            "30 deg",
            "found '30 deg'; leave out the unit, all numbers are in SI units and rad: write",
        ),
        ("-90°", "write -1.57079632679"),
        ("1e3 mm", "write 1"),
        ("120 rpm", "write 12.5663706144"),
        ("3 bananas", "write only the number, without quotes, in SI units and rad"),
    ],
)
def test_a_number_as_text_is_answered_with_the_number_to_write(written: str, words: str) -> None:
    with pytest.raises(mstmm.SceneError) as refused:
        mstmm.Scene.from_data(one_rod(initial={"q": [written]}))
    assert words in str(refused.value)
    assert ("without quotes" in words) == ("without quotes" in str(refused.value))


def test_a_unit_in_an_expression_is_named_too() -> None:
    with pytest.raises(mstmm.SceneError, match=r"write \* for a product .* write 0\.523598775598"):
        mstmm.Scene.from_data(one_rod(drive="30 deg"))


STOPS = {"lower": -90, "upper": 45, "stiffness": 1e5}


@pytest.mark.parametrize(
    ("changes", "notes"),
    [
        ({"initial": {"q": [90]}}, ["initial q: 90 rad is 14.3 turns"]),
        ({"orientation": [0, 0, -180]}, ["orientation: -180 rad is 28.6 turns"]),
        ({"law": {"stiffness": 1, "rest": 30}}, ["rest: 30 rad is 4.77 turns"]),
        ({"law": {"limits": STOPS}}, ["lower limit: -90 rad", "upper limit: 45 rad"]),
        ({"type": "prismatic", "initial": {"q": [90]}}, []),
        ({"initial": {"q": [2 * math.pi]}}, []),
    ],
)
def test_angles_of_more_than_a_turn_are_noted(changes: dict[str, Any], notes: list[str]) -> None:
    found = mstmm.Scene.from_data(one_rod(**changes)).warnings
    assert len(found) == len(notes)
    for note, text in zip(notes, found, strict=True):
        assert note in text and "if degrees were meant, write" in text


def test_angles_of_bushings_are_noted() -> None:
    mount = {"from": "ground", "to": "rod1", "orientation": [30, 0, 0], "stiffness": [1.0] * 6,
             "rest": {"position": [0, 0, 0], "orientation": [0, 45, 0]}}  # fmt: skip
    found = mstmm.Scene.from_data(one_rod() | {"bushing": [mount]}).warnings
    assert [text.partition(" rad")[0] for text in found] == [
        'bushing "bushing1": orientation: 30', 'bushing "bushing1": rest: 45',
    ]  # fmt: skip


def test_the_note_reaches_the_result() -> None:
    run = mstmm.compile(mstmm.Scene.from_data(one_rod())).simulate(0.0)
    assert not any("degrees" in text for text in run.warnings)
    turned = mstmm.Scene.from_data(one_rod(initial={"q": [90]}))
    assert any("1.5708" in text for text in mstmm.compile(turned).simulate(0.0).warnings)
