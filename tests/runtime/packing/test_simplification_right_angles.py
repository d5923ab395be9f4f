"""Orientations that nearly are quarter turns, packed as these."""

from __future__ import annotations

import json
import math
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import mstmm
from mstmm.cli.app import app
from mstmm.numerics.rotations import from_rpy, to_quaternion
from mstmm.runtime.packing.simplification import nearest_right_angles
from tests.support.models import non_link_simplifications

ROD = {"mass": 2.0, "center_of_mass": [0.4, 0.1, 0], "inertia": [0.11, 0.2, 0.3]}


def arm(half_pi: float, **more: Any) -> mstmm.Scene:
    """Three pins, each turned by a quarter from the one before, two of them by ends."""
    bodies = [
        ROD | {"name": f"rod{i}", "ends": {
            "tip": {"position": [0.7, 0.2, 0], "orientation": [half_pi, 0, -half_pi]}
        }} for i in (1, 2, 3)
    ]  # fmt: skip
    hinges: list[dict[str, Any]] = [
        {"name": "a", "type": "pin", "inboard": "ground", "outboard": "rod1",
         "orientation": [half_pi, 0, 0]},
        {"name": "b", "type": "pin", "inboard": "rod1.tip", "outboard": "rod2"},
        {"name": "c", "type": "pin", "inboard": "rod2.tip", "outboard": "rod3",
         "orientation": [0, 0.3, half_pi]},
    ]  # fmt: skip
    return mstmm.Scene(gravity=[0, 0, -9.81], body=bodies, hinge=hinges, **more)


STATE = np.array([0.3, -1.1, 0.7]), np.array([1.0, -2.0, 0.5])


def test_twelve_digits_are_a_quarter_turn() -> None:
    exact = mstmm.compile(arm(math.pi / 2), engine="looped")
    found = mstmm.compile(arm(1.57079632679), engine="looped")
    assert not non_link_simplifications(exact)
    assert [one.elements for one in non_link_simplifications(found)] == [
        ("a",), ("rod1", "tip"), ("rod2", "tip"), ("rod3", "tip"),
    ]  # fmt: skip
    assert "4.9e-12 rad from right angles" in str(non_link_simplifications(found)[0])
    first, last = (one.accelerations(*STATE) for one in (exact, found))
    plain = mstmm.compile(arm(1.57079632679), engine="looped", simplify=False)
    before = plain.accelerations(*STATE)
    assert np.abs(last - first).max() < 1e-9 * np.abs(first).max()  # c keeps what it is off by
    assert 0 < np.abs(last - before).max() < 1e-10 * np.abs(first).max()


def test_a_larger_tolerance_has_to_be_asked_for() -> None:
    scene = arm(1.5708)
    assert not non_link_simplifications(mstmm.compile(scene, engine="looped"))
    rough = mstmm.compile(scene, engine="looped", simplify={"turns": 1e-5})
    assert len(non_link_simplifications(rough)) == 4
    again = rough.with_parameters({"rod2.mass": 3.0})
    assert len(non_link_simplifications(again)) == 4
    nothing: list[Any] = [False, ["welds"], {"turns": False}, {"turns": 0}, {"turns": 1e-12}]
    for none in nothing:
        twelve = mstmm.compile(arm(1.57079632679), engine="looped", simplify=none)
        assert not non_link_simplifications(twelve)
    wrong: list[Any] = [0.1, -1.0, math.nan, "much"]
    for bad in wrong:
        with pytest.raises(mstmm.SceneError, match="simplify: turns = "):
            mstmm.compile(scene, simplify={"turns": bad})


def test_every_rotation_by_quarter_turns_is_found() -> None:
    angles = [k * math.pi / 2 for k in (-1, 0, 1, 2)]
    for rpy in product(angles, repeat=3):
        exact = from_rpy(rpy)
        near = from_rpy([x + 2e-12 for x in rpy])
        found = nearest_right_angles(near, 1e-11)
        assert found is not None
        assert np.array_equal(from_rpy(found[0]), exact) and 1e-12 < found[1] < 6e-12
        assert (
            nearest_right_angles(exact, 1e-11) is None and nearest_right_angles(near, 1e-12) is None
        )
        assert len(to_quaternion(exact)) == 4
    assert nearest_right_angles(from_rpy([0.3, 0, 0]), 0.01) is None


def test_a_table_leaves_what_it_does_not_name() -> None:
    scene = arm(1.5708)
    scene = scene.model_copy(update={"hinge": (*scene.hinge[:2], scene.hinge[2].model_copy(
        update={"type": "fixed"})
    )})  # fmt: skip
    for given, kinds in (
        ({"turns": 1e-5}, {"welds", "turns"}), ({"turns": 0}, {"welds"}), ({"welds": False}, set()),
        ({"welds": False, "turns": 1e-5}, {"turns"}),
    ):  # fmt: skip
        words: Any = given
        found = mstmm.compile(scene, engine="looped", simplify=words)
        assert {one.kind for one in non_link_simplifications(found)} == kinds


@pytest.mark.parametrize(
    ("half_pi", "more", "count"),
    [
        ("1.5708", [], 0), ("1.5708", ["--turns", "1e-5"], 4), ("1.57079632679", [], 4),
        ("1.57079632679", ["--turns", "0"], 0), ("1.57079632679", ["--no-simplify"], 0),
    ],
)  # fmt: skip
def test_turns_on_the_command_line(
    half_pi: str, more: list[str], count: int, tmp_path: Path
) -> None:
    file = tmp_path / "arm.toml"
    file.write_text(arm(float(half_pi)).to_toml())
    asked = ["simulate", str(file), "--t-end", "0.01", "--output", str(tmp_path / "arm.csv")]
    done = CliRunner().invoke(app, [*asked, *more, "--json"])
    told = json.loads(done.stdout)["simplifications"]
    assert [one["kind"] for one in told if one["kind"] != "links"] == ["turns"] * count


def test_the_command_line_tells_of_turns(tmp_path: Path) -> None:
    file = tmp_path / "arm.toml"
    file.write_text(arm(1.57079632679).to_toml())
    asked = ["simulate", str(file), "--t-end", "0.01", "--output", str(tmp_path / "arm.csv")]
    done = CliRunner().invoke(app, asked)
    assert "4 orientations within a tolerance of right angles replaced by these" in done.output
