"""Inputs and outputs of a scene in its linear models: defaults, names, and the chain rule."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import SceneError

OUTPUTS = [
    {"name": "swing", "of": "pivot.angle/deg", "unit": "deg"},
    {"name": "tip", "of": "arm.tip.position"},
    {"name": "reach", "of": "sqrt(arm.tip.x^2 + arm.tip.y^2 + load.x^2)*exp(pivot.angle)"},
    {"name": "mixed", "of": "pivot.angle_rate*cos(pivot.q) + motor^2 + wrist.u[0]*load.x"},
    {"name": "rated", "of": "load.ax*pivot.angle + 2*t"},
]


def arm(**more: Any) -> mstmm.Model:
    """Two links on pins, a motor on the first, a wind on the second."""
    rod = {"mass": 1.3, "center_of_mass": [0.4, 0.1, 0], "inertia": [0.1, 0.2, 0.3],
           "ends": {"tip": [1.0, 0.2, 0]}}  # fmt: skip
    law = {"stiffness": 40.0, "damping": 0.3, "effort": "motor"}
    scene = mstmm.Scene(
        gravity=(0, -9.81, 0),
        body=[{"name": "arm", **rod}, {"name": "load", **rod}],
        hinge=[{"name": "pivot", "type": "pin", "inboard": "ground", "outboard": "arm", "law": law},
               {"name": "wrist", "type": "pin", "inboard": "arm.tip", "outboard": "load",
                "law": {"stiffness": 30.0, "damping": 0.2}}],
        load=[{"on": "load.tip", "force": ["wind", 0, 0]}],
        input=[{"name": "motor", "unit": "N*m", "value": 0.7}, {"name": "wind", "unit": "N"}],
        **{"output": OUTPUTS, **more},
    )  # fmt: skip
    return mstmm.compile(scene, engine="looped")


def test_inputs_and_outputs_of_the_scene_are_the_defaults() -> None:
    linear = arm().linearize()
    assert linear.input_names == ("motor", "wind")
    assert arm().linearize(inputs=[]).input_names == ()
    answer = linear.frequency_response([1.0, 7.0])
    assert answer.input_names == linear.input_names and answer.input_units == ("N*m", "N")
    assert answer.output_names == ("swing", "tip.x", "tip.y", "tip.z", "reach", "mixed", "rated")
    assert answer.output_units == ("deg", "m", "m", "m", "", "", "")
    named = linear.frequency_response([1.0, 7.0], outputs=["pivot.angle", "tip.y"])
    assert named.output_units == ("rad", "m") and named.output_names == ("pivot.angle", "tip.y")
    np.testing.assert_allclose(
        answer.response[:, 0],
        np.rad2deg(named.response[:, 0].real) + 1j * np.rad2deg(named.response[:, 0].imag),
        rtol=1e-13,
    )
    np.testing.assert_array_equal(answer.response[:, 2], named.response[:, 1])
    assert linear.output_matrices()[0].shape == (7, 4)


def values(model: mstmm.Model, q: Any, u: Any) -> np.ndarray:
    """What results give of the outputs at a state."""
    run = model.simulate(1e-9, output_times=[0.0], initial=(q, u))
    found = [run.quantity(one.name).values[0] for one in model.scene.output]
    return np.concatenate([np.atleast_1d(x) for x in found])


def differences(of: Any, step: float = 1e-5) -> np.ndarray:
    """Derivative at 0 of a function of one number, of fourth order."""
    ahead, behind = ((of(k * step) - of(-k * step)) / (2 * k * step) for k in (1, 2))
    return np.asarray((4 * ahead - behind) / 3)


def test_expressions_follow_by_the_chain_rule() -> None:
    """C and D against differences of what results show of displaced, moving and pushed states."""
    model = arm()
    linear = model.linearize()
    c, d = linear.output_matrices()
    q, u = linear.state.q, linear.state.u
    for k in range(4):
        step = np.eye(4)[k]
        found = differences(lambda e, s=step: values(model, q + e * s[:2], u + e * s[2:]))
        np.testing.assert_allclose(c[:, k], found, rtol=1e-6, atol=1e-7)
    for k, name in enumerate(linear.input_names):
        value = {"motor": 0.7, "wind": 0.0}[name]
        found = differences(
            lambda e, n=name, v=value: values(model.with_inputs({n: v + e}), q, u), 1e-3
        )
        np.testing.assert_allclose(d[:, k], found, rtol=1e-6, atol=1e-7)
    assert d[5, 0] == pytest.approx(1.4)


def test_the_sweep_gives_them_as_the_state_space_does() -> None:
    linear = arm().linearize()
    omega = np.array([0.4, 3.0, 21.0])
    found = linear.frequency_response(omega).response
    c, d = linear.output_matrices()
    for w, ours in zip(omega, found, strict=True):
        dense = c @ np.linalg.solve(1j * w * np.eye(4) - linear.A, linear.B) + d
        np.testing.assert_allclose(ours, dense, rtol=1e-10, atol=1e-12)


def test_coordinates_of_a_ball_are_outputs() -> None:
    """A quaternion's vector part goes with half the rotation vector where nothing is turned."""
    body = {"name": "top", "mass": 1.0, "center_of_mass": [0, -0.5, 0], "inertia": [1, 1, 1]}
    ball = {"name": "point", "type": "ball", "inboard": "ground", "outboard": "top"}
    model = mstmm.compile(mstmm.Scene(gravity=(0, -9.81, 0), body=[body], hinge=[ball]))
    linear = model.linearize([1, 0, 0, 0])
    c, _ = linear.output_matrices(["point.q[0]", "point.q[1]", "point.q[3]"])
    expected = np.array([[0, 0, 0], [0.5, 0, 0], [0, 0, 0.5]])
    np.testing.assert_allclose(c[:, :3], expected, atol=1e-15)


def test_speeds_of_a_ball_that_turns() -> None:
    """Under x' = G x + du the speed itself is du = x' - G x."""
    body = {"name": "top", "mass": 1.0, "inertia": [1, 1, 2]}
    ball = {"name": "point", "type": "ball", "inboard": "ground", "outboard": "top"}
    model = mstmm.compile(mstmm.Scene(gravity=(0, 0, 0), body=[body], hinge=[ball]))
    linear = model.linearize([1, 0, 0, 0], [0, 0, 3.0])
    c, _ = linear.output_matrices(["point.wx", "point.wy"])
    np.testing.assert_allclose(c, [[0, -3, 0, 1, 0, 0], [3, 0, 0, 0, 1, 0]], atol=1e-12)


def test_what_linear_models_do_not_have_is_left_out_and_told() -> None:
    more = [{"name": "stored", "of": "energy"}, {"name": "swing", "of": "pivot.angle"}]
    linear = arm(output=more).linearize()
    assert linear.frequency_response([1.0]).output_names == ("swing",)
    assert any("output stored is not among the outputs" in text for text in linear.warnings)
    with pytest.raises(SceneError, match='output "stored": of: "energy": expected'):
        linear.frequency_response([1.0], outputs=["stored"])


@pytest.mark.parametrize(
    ("name", "meant"),
    [("swng", "swing"), ("motr", "motor"), ("load.positon.x", "load.position.x"),
     ("wrist.angle_rat", "wrist.angle_rate")],
)  # fmt: skip
def test_misspelt_outputs(name: str, meant: str) -> None:
    with pytest.raises(SceneError, match=f'did you mean "{meant}"'):
        arm().frequency_response([1.0], outputs=[name])


def test_an_input_that_drives_is_no_default() -> None:
    body = {"name": "cart", "mass": 1.0, "inertia": [1, 1, 1]}
    slide = {"name": "rail", "type": "prismatic", "inboard": "ground", "outboard": "cart",
             "drive": "road"}  # fmt: skip
    bob = {"name": "bob", "mass": 1.0, "center_of_mass": [0, -1, 0], "inertia": [1, 1, 1]}
    pin = {"name": "pin", "type": "pin", "inboard": "cart", "outboard": "bob",
           "law": {"effort": "motor"}}  # fmt: skip
    given = [{"name": "road", "rates": [0, 0]}, {"name": "motor"}]
    scene = mstmm.Scene(gravity=(0, -9.81, 0), body=[body, bob], hinge=[slide, pin], input=given)
    assert mstmm.compile(scene).linearize().input_names == ("motor",)
