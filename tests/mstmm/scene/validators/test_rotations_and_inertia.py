"""Rotations as matrices; inertias as three rows, and in axes of their own."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.numerics.rotations import from_orientation, from_rpy

TURN = np.array(from_rpy([0.3, -1.2, 2.5]))


def scene(inertia: Any = (1, 1, 1), orientation: Any = (0, 0, 0)) -> mstmm.Scene:
    body = {"name": "rod", "mass": 1, "inertia": inertia}
    hinge = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod"}
    hinges = [hinge | {"orientation": orientation}]
    return mstmm.Scene(gravity=(0, 0, -9.81), body=[body], hinge=hinges)


@pytest.mark.parametrize("form", [np.array, np.ndarray.tolist])
def test_a_matrix_is_an_orientation(form: Any) -> None:
    read = scene(orientation=form(TURN)).hinge[0]
    assert np.array(from_orientation(read.orientation)) == pytest.approx(TURN, abs=1e-15)
    quarter = scene(orientation=[[0, -1, 0], [1, 0, 0], [0, 0, 1]]).hinge[0]
    assert quarter.orientation == (0.0, 0.0, np.pi / 2)


def test_an_inertia_in_rows_and_in_axes_of_its_own() -> None:
    principal = np.diag([1.0, 2.0, 2.5])
    turned = TURN @ principal @ TURN.T
    wanted = pytest.approx(turned, abs=1e-14)
    for inertia in (
        turned, {"moments": [1, 2, 2.5], "orientation": TURN},
        {"moments": principal.tolist(), "orientation": [0.3, -1.2, 2.5]},
        {"moments": [1, 2, 2.5, 0, 0, 0], "orientation": [0.3, -1.2, 2.5]},
    ):  # fmt: skip
        found = scene(inertia).body[0]
        assert np.array(found.inertia_matrix) == wanted
    again = mstmm.Scene(**scene(turned).model_dump(by_alias=True, exclude_none=True))
    assert again.body[0].inertia == scene(turned).body[0].inertia


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"orientation": [[1, 0, 0], [0, 1, 0.1], [0, 0, 1]]}, r"not orthonormal \(error 0.1\)"),
        ({"orientation": [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}, "found a reflection"),
        ({"orientation": [[1, 0, 0], [0, 1], [0, 0, 1]]}, "found a row of 2 entries"),
        ({"orientation": [[1, 0, 0], [0, "x", 0], [0, 0, 1]]}, "found 'x'"),
        ({"inertia": [[1, 0, 0], [0, 1, 0.1], [0, 0, 1]]}, r"found 0.1 at \[1\]\[2\] and 0 at"),
        ({"inertia": {"moments": [1, 1, 1]}}, r"found the keys \['moments'\]"),
        ({"inertia": {"\0": 1}}, r"found the keys \['\\x00'\]"),
        ({"inertia": {}}, "found an empty one"),
        ({"inertia": {"moments": [1, 1], "orientation": [0, 0, 0]}}, "found 2 entries"),
    ],
)
def test_what_is_no_rotation_and_no_inertia(given: dict[str, Any], message: str) -> None:
    with pytest.raises(mstmm.SceneError, match=message):
        scene(**given)
