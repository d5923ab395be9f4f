"""What others call the parts of a scene: the table `[names]`, and what finds something by it."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mstmm

NAMES = {
    "body": {"arm-1": "arm_1", "tool 0": "arm_1.tool", "ücke": "ground", "a.b": "arm_1.tool"},
    "hinge": {"joint/1": "joint_1", "arm-1": "joint_1"},
}


def data(**more: Any) -> dict[str, Any]:
    """A bar on a pin."""
    bar = {"name": "arm_1", "mass": 1.0, "center_of_mass": [0.5, 0, 0],
           "inertia": [0.01, 0.1, 0.1], "ends": {"tool": [1, 0, 0.2]}}  # fmt: skip
    pin = {"name": "joint_1", "type": "pin", "axis": [0, 1, 0], "inboard": "ground",
           "outboard": "arm_1", "law": {"damping": 0.1}}  # fmt: skip
    return {"gravity": [0, 0, -9.81], "body": [bar], "hinge": [pin], "names": NAMES} | more


def test_they_go_to_a_file_and_back() -> None:
    scene = mstmm.Scene(**data())
    text = scene.to_toml()
    assert '[names.body]\n"arm-1" = "arm_1"\n"tool 0" = "arm_1.tool"' in text
    again = mstmm.Scene.from_data(tomllib.loads(text))
    assert again == scene and again.to_toml() == text
    assert again.names.hinge == NAMES["hinge"]
    assert "names" not in mstmm.Scene(**data(names={})).to_toml()


def test_results_and_models_find_by_them(tmp_path: Path) -> None:
    model = mstmm.compile(mstmm.Scene(**data()))
    run = model.simulate(0.3)
    saved = mstmm.load_result(run.save(tmp_path / "run.nc"))
    for one in (run, saved):
        assert np.array_equal(one.coordinates("joint/1"), one.coordinates("joint_1"))
        assert np.array_equal(one.speeds("arm-1"), one.speeds("joint_1"))
        assert np.array_equal(one.effort("joint/1"), one.effort("joint_1"))
        assert np.array_equal(one.force("joint/1"), one.force("joint_1"))
        for name in ("tool 0", "arm-1.tool", "a.b"):
            assert np.array_equal(one.position(name), one.position("arm_1.tool"))
            assert np.array_equal(one.orientation(name), one.orientation("arm_1.tool"))
        angle = one.quantity("joint/1.angle")
        assert angle.name == "joint/1.angle" and np.array_equal(angle.values, run.q[:, 0])
        moved = one.quantity("tool 0.x")
        assert moved.name == "tool 0.x"
        assert np.array_equal(moved.values, one.position("arm_1.tool")[:, 0])
    assert model.coordinate_layout.hinges["joint/1"] == model.coordinate_layout.hinges["joint_1"]
    assert list(model.coordinate_layout.hinges) == ["joint_1"]
    q, u = run.q[-1], run.u[-1]
    poses = model.poses(q, ["arm-1", "tool 0", "ücke"])
    assert np.array_equal(poses, model.poses(q, ["arm_1", "arm_1.tool", "ground"]))
    assert np.array_equal(model.jacobian(q, "a.b"), model.jacobian(q, "arm_1.tool"))
    assert np.array_equal(model.velocities(q, u, "arm-1"), model.velocities(q, u, "arm_1"))


def test_numbers_and_channels_are_found_by_them() -> None:
    model = mstmm.compile(mstmm.Scene(**data()))
    changed = model.with_parameters({"arm-1.mass": 3.0, "joint/1.law.damping": 0.4})
    assert changed.scene.body[0].mass == 3.0 and changed.scene.hinge[0].law.damping == (0.4,)
    assert changed.scene.names == model.scene.names
    q = [0.0]
    linear = model.linearize(q, inputs=["joint/1.effort", "tool 0.fz"])
    own = model.linearize(q, inputs=["joint_1.effort", "arm_1.tool.fz"])
    assert np.array_equal(linear.B, own.B) and linear.B.any()
    for mine, other in zip(
        linear.output_matrices(["tool 0.z", "joint/1.angle"]),
        own.output_matrices(["arm_1.tool.z", "joint_1.angle"]),
        strict=True,
    ):
        assert np.array_equal(mine, other)


def test_one_number_by_two_names_is_refused() -> None:
    model = mstmm.compile(mstmm.Scene(**data()))
    with pytest.raises(
        mstmm.SceneError, match=r'"arm-1\.mass" and "arm_1\.mass" are the same number'
    ):
        model.with_parameters({"arm-1.mass": 2.0, "arm_1.mass": 3.0})


def test_a_hinge_that_others_call_as_the_scene_does_stays() -> None:
    plain = mstmm.compile(mstmm.Scene(**data(names={}))).simulate(0.1)
    run = mstmm.compile(mstmm.Scene(**data(names={"hinge": {"joint_1": "joint_1"}}))).simulate(0.1)
    assert run.quantity_names() == plain.quantity_names()
    assert np.array_equal(run.quantity("joint_1.angle").values, run.q[:, 0])


def test_a_hinge_is_not_called_as_a_flexible_body_is() -> None:
    beam = {"name": "rod", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 50.0,
            "polar_inertia_per_length": 1e-3, "torsional_stiffness": 10.0,
            "modes": {"y": 2, "z": 2, "twist": 1}}  # fmt: skip
    root = {"name": "root", "type": "fixed", "inboard": "arm_1.tool", "outboard": "rod"}
    more = {"beam": [beam], "hinge": [*data()["hinge"], root]}
    with pytest.raises(
        mstmm.SceneError, match='"rod" is already the name of a flexible body of the scene'
    ):
        mstmm.Scene(**data(names={"hinge": {"rod": "joint_1"}}, **more))


def test_names_of_members_of_chains_stay_their_own() -> None:
    pattern = {"body": {"mass": 1.0, "inertia": [0.1] * 3, "ends": {"tip": [1, 0, 0]}},
               "hinge": {"type": "pin", "axis": [0, 1, 0]}}  # fmt: skip
    chain = {"name": "rope", "count": 2, "inboard": "ground", **pattern}
    more = {"chain": [chain], "names": {"hinge": {"rope[0]": "joint_1"}}}
    run = mstmm.compile(mstmm.Scene(**data(**more))).simulate(0.1)
    assert "rope[0].hinge.angle" in run.quantity_names()
    assert run.quantity("rope[0].hinge.angle").values.any()


def test_a_name_of_the_scene_itself_goes_first() -> None:
    names = {"hinge": {"arm_1": "joint_1"}}
    run = mstmm.compile(mstmm.Scene(**data(names=names))).simulate(0.1)
    assert np.array_equal(run.quantity("arm_1.x").values, run.position("arm_1")[:, 0])
    assert np.array_equal(run.quantity("arm_1.angle").values, run.q[:, 0])
    assert np.array_equal(run.coordinates("arm_1"), run.coordinates("joint_1"))


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda run: run.position("tol 0"), 'no such body or end in the scene; did you mean "tool'),
        (lambda run: run.coordinates("joint/2"), 'such hinge in the scene; did you mean "joint'),
        (lambda run: run.quantity("joint/1.angel"), "no such quantity; did you mean"),
    ],
)
def test_a_wrong_name_is_told_with_the_nearest_one(ask: Any, message: str) -> None:
    run = mstmm.compile(mstmm.Scene(**data())).simulate(0.0)
    with pytest.raises(mstmm.SceneError, match=message):
        ask(run)


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (3, "names: expected a table"),
        ({"joint": {}}, "names.joint: unknown key; use one of body, hinge"),
        ({"body": ["a"]}, "names.body: expected a table of bodies and ends by their names"),
        ({"body": {"a-b": 3}}, "names.body.'a-b': expected a name of the scene, found 3"),
        ({"body": {"": "arm_1"}}, "expected printable names of 1 to 200 characters"),
        ({"body": {"  ": "arm_1"}}, "characters, not only blanks"),
        ({"body": {"a-b": "arm_1."}}, 'there is no body or end "arm_1."'),
        ({"body": {"a\n": "arm_1"}}, "expected printable names of 1 to 200 characters"),
        ({"body": {"a" * 201: "arm_1"}}, "expected printable names of 1 to 200 characters"),
        ({"body": {"a-b": "arm"}}, 'no body or end "arm"; did you mean "arm_1"?'),
        ({"body": {"a-b": "arm_1.tip"}}, 'there is no body or end "arm_1.tip"'),
        (
            {"body": {"arm_1": "arm_1.tool"}},
            '"arm_1" is already the name of a body or an end of the scene',
        ),
        ({"body": {"ground": "arm_1"}}, '"ground" is already the name of a body or an end'),
        ({"hinge": {"a-b": "arm_1"}}, 'there is no hinge "arm_1"'),
    ],
)
def test_names_that_are_none_are_refused(names: Any, message: str) -> None:
    with pytest.raises(mstmm.SceneError) as raised:
        mstmm.Scene(**data(names=names))
    assert message in str(raised.value)
