"""What scenes say of flexible bodies, done: modal coordinates in expressions, axes of loads."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import SceneError
from mstmm.numerics.rotations import from_quaternion, from_rpy
from mstmm.scene import Scene
from tests.support.scenes.minimal import Data, blade_scene

ETA = (0.1, -0.02, 0.08, 0.01)


def bent_blade_scene(**parts: Any) -> Data:
    """A blade on a turned pin, bent in both planes at the start; its tip has axes of its own."""
    data = blade_scene(
        modes={"y": 2, "z": 2}, frame="tangent", initial={"eta": list(ETA)}, rotary_inertia=1e-3,
        ends={"tip": {"position": 10.0, "orientation": [0.3, 0.2, 1.0]}},
    )  # fmt: skip
    pin = data["hinge"][0] | {"type": "pin", "initial": {"q": [0.4]}}
    return data | {"gravity": [0, 0, 0], "hinge": [pin]} | parts


def start(data: Data) -> tuple[Any, Any]:
    """The model and its accelerations at the start."""
    model = mstmm.compile(Scene(**data), engine="looped")
    q, u = np.array([0.4, *ETA]), np.zeros(5)
    return model, model.accelerations(q, u, t=0.0)


def rotated_force(rotation: Any, force: list[float]) -> list[float]:
    vector: list[float] = (np.array(rotation) @ force).tolist()
    return vector


def test_a_force_in_body_axes_follows_the_loaded_section() -> None:
    """And not the end's own axes, as on rigid bodies."""
    force = [3.0, -2.0, 1.0]
    load = {"on": "blade.tip", "force": force, "axes": "body"}
    model, with_follower = start(bent_blade_scene(load=[load]))
    seen = model.simulate(t_end=1e-3).orientation("blade.tip")[0]
    section = np.array(from_quaternion(seen)) @ np.array(from_rpy([0.3, 0.2, 1.0])).T
    fixed = {"on": "blade.tip", "force": rotated_force(section, force)}
    assert with_follower == pytest.approx(start(bent_blade_scene(load=[fixed]))[1], rel=1e-9)
    along = {"on": "blade.tip", "force": rotated_force(from_rpy([0, 0, 0.4]), force)}
    assert with_follower != pytest.approx(start(bent_blade_scene(load=[along]))[1], rel=1e-3)


def test_a_load_per_length_in_body_axes_follows_the_floating_frame() -> None:
    load = {"on": "blade", "force_per_length": [0.3, -0.2, 0.1], "axes": "body"}
    _, with_follower = start(bent_blade_scene(load=[load]))
    fixed = load | {"force_per_length": rotated_force(from_rpy([0, 0, 0.4]), [0.3, -0.2, 0.1])}
    for axes in ({"axes": "inertial"}, {}):
        same = {key: value for key, value in fixed.items() if key != "axes"} | axes
        assert with_follower == pytest.approx(start(bent_blade_scene(load=[same]))[1], rel=1e-9)
    named = load | {"axes": "blade"}
    assert with_follower == pytest.approx(start(bent_blade_scene(load=[named]))[1], rel=1e-12)


def test_loads_per_length_on_parts_add_up_to_that_on_the_whole() -> None:
    whole = {"on": "blade", "force_per_length": [1.0, 2.0, -1.0]}
    parts = [whole | {"span": [0, 3]}, whole | {"span": [3, 10]}]
    assert start(bent_blade_scene(load=parts))[1] == pytest.approx(
        start(bent_blade_scene(load=[whole]))[1], rel=1e-9
    )


def test_modal_coordinates_and_rates_in_expressions() -> None:
    """A force -k q[2] - c u[0] by expression is the number it stands for at the start."""
    load = {"on": "blade.tip", "force": [0, "-5*blade.q[2] - blade.u[0] + 2", 0]}
    number = {"on": "blade.tip", "force": [0, -5 * 0.08 + 2, 0]}
    assert start(bent_blade_scene(load=[load]))[1] == pytest.approx(
        start(bent_blade_scene(load=[number]))[1], rel=1e-12
    )


def test_events_on_modal_coordinates_and_on_ends() -> None:
    data = bent_blade_scene(event=[{"when": "blade.q[0] < 0.05", "do": "stop"}])
    result = mstmm.compile(Scene(**data), engine="looped").simulate(t_end=5.0)
    assert result.t[-1] < 5.0 and result.q[-1][1] == pytest.approx(0.05, abs=1e-9)
    data = bent_blade_scene(event=[{"when": "blade.tip.y < blade.root.y + 4.0", "do": "stop"}])
    result = mstmm.compile(Scene(**data), engine="looped").simulate(t_end=5.0)
    assert result.t[-1] < 5.0
    assert result.position("blade.tip")[-1][1] == pytest.approx(4.0, abs=1e-9)


def test_an_entry_beyond_the_shapes_that_auto_chose_is_refused() -> None:
    data = blade_scene(modes="auto") | {
        "load": [{"on": "blade.tip", "force": ["blade.q[99]", 0, 0]}]
    }
    beyond = r"'blade\.q\[99\]': 'blade' has \d+ entries: [yz]1, [yz]2"
    with pytest.raises(SceneError, match=beyond):
        mstmm.compile(Scene(**data), engine="looped")
