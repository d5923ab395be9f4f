"""Loads at mass centres, and forces where a body turns about."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import SceneError

Tables = dict[str, Any]
CENTER = [0.3, -0.2, 0.1]
ROD: Tables = {"mass": 2.0, "center_of_mass": CENTER, "inertia": [0.01, 0.2, 0.2]}


def scene(load: Tables, **more: Any) -> mstmm.Scene:
    """A rod on a turned pin that carries another on a ball, with a load."""
    ends = {"tip": [1, 0, 0], "c": CENTER}
    tables: Tables = {
        "gravity": [0, 0, -9.81],
        "body": [ROD | {"name": "rod", "ends": ends}, ROD | {"name": "bob", "ends": ends}],
        "hinge": [
            {"name": "p", "type": "pin", "axis": [0.2, 0.9, 0.1], "inboard": "ground",
             "outboard": "rod", "orientation": [0.1, 0.2, 0.3]},
            {"name": "b", "type": "ball", "inboard": "rod.tip", "outboard": "bob"},
        ],
        "load": [{"name": "push", "force": [1.0, "2 + t", -3.0], "moment": [0.1, 0, 0.2]} | load],
    }  # fmt: skip
    return mstmm.Scene(**(tables | more))


@pytest.mark.parametrize("engine", ["looped", "fused"])
@pytest.mark.parametrize("body", ["rod", "bob"])
@pytest.mark.parametrize("axes", ["inertial", "body", "rod"])
def test_it_acts_as_at_an_end_there(engine: str, body: str, axes: str) -> None:
    found, expected = (
        mstmm.compile(scene(where | {"axes": axes}), engine=engine)
        for where in ({"on": body, "at": "center_of_mass"}, {"on": f"{body}.c"})
    )
    q, u = [0.4, *(np.array([0.7, 0.1, -0.5, 0.3]) / np.sqrt(0.84))], [0.3, -0.2, 0.5, 0.9]
    np.testing.assert_allclose(
        found.accelerations(q, u, 0.3), expected.accelerations(q, u, 0.3), rtol=1e-13
    )
    runs = [model.simulate(0.3, rtol=1e-9, initial=(q, u)) for model in (found, expected)]
    np.testing.assert_allclose(runs[0].q[-1], runs[1].q[-1], rtol=1e-8)
    np.testing.assert_allclose(
        runs[0].quantity("push.power").values, runs[1].quantity("push.power").values, rtol=1e-7
    )


def test_members_of_chains_have_mass_centers() -> None:
    """A force F across the end of two rods on pins in a row, at rest in zero gravity."""
    body = {"mass": 2.0, "center_of_mass": [0.5, 0, 0], "inertia": [0.01, 0.2, 0.2],
            "ends": {"c": [0.5, 0, 0], "tip": [1, 0, 0]}}  # fmt: skip
    rope = {"name": "rope", "count": 2, "inboard": "ground", "body": body, "end": "tip",
            "hinge": {"type": "pin"}}  # fmt: skip
    push = {"force": [0, 3, 0]}
    found, expected = (
        mstmm.compile(mstmm.Scene(gravity=[0, 0, 0], chain=[rope], load=[push | where]))
        for where in ({"on": "rope[1]", "at": "center_of_mass"}, {"on": "rope[1].c"})
    )  # fmt: skip
    udot, wanted = (model.accelerations([0.2, 0.1], [0.0, 0.0]) for model in (found, expected))
    assert np.abs(udot).min() > 0.1
    np.testing.assert_allclose(udot, wanted, rtol=1e-13)


@pytest.mark.parametrize(
    ("load", "moves"),
    [
        ({"on": "rod"}, False),
        ({"on": "rod", "moment": [0, 0, 1]}, True),
        ({"on": "rod.along"}, False),
        ({"on": "rod.c"}, True),
        ({"on": "rod", "at": "center_of_mass"}, True),
        ({"on": "bob"}, True),
    ],
)
def test_a_force_where_a_body_turns_about_has_a_warning(load: Tables, moves: bool) -> None:
    axis = [0.2, 0.9, 0.1]
    ends = {"tip": [1, 0, 0], "c": CENTER, "along": [2 * x for x in axis]}
    pin = {"name": "p", "type": "pin", "axis": axis, "inboard": "ground", "outboard": "rod"}
    one = scene(
        {"moment": [0, 0, 0]} | load, gravity=[0, 0, 0],
        body=[ROD | {"name": "rod", "ends": ends}, ROD | {"name": "bob", "ends": ends}],
        hinge=[pin, {"name": "b", "type": "ball", "inboard": "rod.tip", "outboard": "bob"}],
    )  # fmt: skip
    udot = mstmm.compile(one).accelerations([0.4, 1, 0, 0, 0], np.zeros(4))
    assert (np.abs(udot).max() > 1e-12) == moves
    found = [risk for risk in one.risks if risk.name == "idle-load"]
    assert len(found) == (not moves)
    for told in found:
        assert told.description.startswith('load "push" acts at the pivot of "rod" (hinge "p")')
        assert not told.invalidates


@pytest.mark.parametrize(("on", "told"), [("rope[0]", 1), ("rope[1]", 0), ("rope[last].tip", 0)])
def test_forces_on_members_of_chains(on: str, told: int) -> None:
    body = ROD | {"ends": {"tip": [1, 0, 0]}}
    rope = {"name": "rope", "count": 3, "inboard": "ground", "body": body, "hinge": {"type": "pin"}}
    one = mstmm.Scene(gravity=[0, 0, 0], chain=[rope], load=[{"on": on, "force": [0, 1, 0]}])
    assert [risk.name for risk in one.risks].count("idle-load") == told


def test_a_force_on_a_fixed_body_has_none() -> None:
    """It asks for the loads of its weld."""
    held = {"name": "w", "type": "fixed", "inboard": "ground", "outboard": "rod"}
    body = [ROD | {"name": "rod", "ends": {"tip": [1, 0, 0]}}, ROD | {"name": "bob"}]
    hinge = [held, {"name": "b", "type": "ball", "inboard": "rod.tip", "outboard": "bob"}]
    one = scene({"on": "rod", "moment": [0, 0, 0]}, body=body, hinge=hinge)
    assert not [risk for risk in one.risks if risk.name == "idle-load"]
    (bob,) = scene({"on": "bob", "moment": [0, 0, 0]}, body=body, hinge=hinge).risks
    assert bob.name == "idle-load"  # on a ball that nothing moves


def test_it_is_written_and_read_back(tmp_path: Path) -> None:
    one = scene({"on": "bob", "at": "center_of_mass"})
    path = tmp_path / "scene.toml"
    path.write_text(one.to_toml())
    assert mstmm.load_scene(path) == one and 'at = "center_of_mass"' in path.read_text()
    schema = mstmm.Scene.model_json_schema()["$defs"]["Load"]["properties"]["at"]
    assert "center_of_mass" in str(schema)


@pytest.mark.parametrize(
    ("load", "expected"),
    [
        ({"on": "rod.c", "at": "center_of_mass"}, 'at: "center_of_mass" needs a body without an'),
        ({"on": "rod", "at": "middle"}, 'at: expected "center_of_mass", found'),
        ({"on": "jib", "at": "center_of_mass"}, 'at: "jib" is not rigid'),
        ({"on": "jib", "force": [0, 0, 0], "moment": [0, 0, 0], "force_per_length": [0, 1, 0],
          "at": "center_of_mass"}, "at: force_per_length acts along a beam"),
    ],
)  # fmt: skip
def test_what_has_no_mass_center_is_refused(load: Tables, expected: str) -> None:
    jib = {"name": "jib", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 1.0,
           "modes": {"y": 1}}  # fmt: skip
    clamp = {"name": "w", "type": "fixed", "inboard": "ground", "outboard": "jib"}
    with pytest.raises(SceneError, match=expected):
        scene(load, beam=[jib], hinge=[*scene({"on": "rod"}).hinge, clamp])
