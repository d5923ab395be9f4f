"""Motions of drives as inputs: closed forms of excitation by a base, a dense solution, a run."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import SceneError

M, C, K = 2.0, 3.0, 80.0


def shaker(**more: Any) -> mstmm.Model:
    """A mass on a spring and a damper on a platform that is driven."""
    body = {"inertia": [1, 1, 1]}
    slide = {"type": "prismatic", "axis": [1, 0, 0]}
    scene = mstmm.Scene(
        gravity=(0, 0, 0),
        body=[{"name": "platform", "mass": 5.0, **body}, {"name": "mass", "mass": M, **body}],
        hinge=[{"name": "base", **slide, "inboard": "ground", "outboard": "platform",
                "drive": "road"},
               {"name": "mount", **slide, "inboard": "platform", "outboard": "mass",
                "law": {"stiffness": K, "damping": C}}],
        input=[{"name": "road", "unit": "m", "rates": [0, 0]}],
        **more,
    )  # fmt: skip
    return mstmm.compile(scene, engine="looped")


def transmissibility(omega: Any) -> Any:
    s = 1j * np.asarray(omega)
    return (C * s + K) / (M * s**2 + C * s + K)


def test_the_transmissibility_of_a_mount() -> None:
    """Motion of the mass over that of the base, in every power of s, relative and absolute."""
    omega = np.array([0.3, 6.0, 6.3, 60.0])
    s, h = 1j * omega, transmissibility(omega)
    inputs = ["base.displacement", "base.displacement_rate", "base.displacement_acceleration"]
    found = shaker().frequency_response(omega, inputs, ["mass.x", "mount.displacement", "mass.ax"])
    assert found.input_names == tuple(inputs) and found.input_units == ("m", "m/s", "m/s2")
    for k in range(3):
        expected = np.stack([h, h - 1, s**2 * h], axis=1) / (s**k)[:, None]
        np.testing.assert_allclose(found.response[:, :, k], expected, rtol=1e-12)
    own = shaker().frequency_response(omega, inputs[:1], ["base.displacement", "platform.vx"])
    np.testing.assert_allclose(own.response[:, :, 0], np.stack([s**0, s], axis=1), rtol=1e-13)


def test_drives_are_states_behind_the_others() -> None:
    """With a spring from the mass to the ground besides, the platform's place itself acts."""
    spring = [{"name": "held", "from": "ground", "position": [-3, 0, 0], "to": "mass",
               "law": {"stiffness": 30.0, "rest": 3.0, "damping": 1.5}}]  # fmt: skip
    model = shaker(spring=spring)
    linear = model.linearize([0, 0], inputs=["mass.fx", "base.displacement_acceleration"])
    assert linear.prescribed_coordinates == ("base.displacement",)
    assert linear.state_names == (
        "mount.displacement", "mount.displacement'", "base.displacement", "base.displacement'",
    )  # fmt: skip
    np.testing.assert_allclose(linear.K_prescribed, [[30.0]])
    np.testing.assert_allclose(linear.C_prescribed, [[1.5]])
    np.testing.assert_allclose(linear.V, [[1.0, -M]])
    assert (linear.A.shape, linear.B.shape, linear.B_disturbances.shape) == ((4, 4), (4, 2), (4, 3))
    omega, outputs = np.array([0.5, 4.0, 30.0]), ["mass.x", "mass.vx", "mass.ax", "held.effort"]
    found = linear.frequency_response(omega, outputs=outputs)
    c, d = linear.output_matrices(outputs)
    s = 1j * omega
    absolute = (C * s + K) / (M * s**2 + (C + 1.5) * s + K + 30) / s**2
    np.testing.assert_allclose(found.response[:, 0, 1], absolute, rtol=1e-12)
    for at, ours in zip(s, found.response, strict=True):
        dense = c @ np.linalg.solve(at * np.eye(4) - linear.A, linear.B) + d
        np.testing.assert_allclose(ours, dense, rtol=1e-11)


def arm() -> mstmm.Model:
    """A tilting platform under gravity with a damped pendulum, whose motor knows the platform."""
    law = {"stiffness": 9.0, "damping": 0.4, "effort": "2*base.q - 0.7*base.u"}
    scene = mstmm.Scene(
        gravity=(0, -9.81, 0),
        body=[{"name": "platform", "mass": 5.0, "inertia": [1, 1, 1],
               "ends": {"on": [0.4, 0.3, 0]}},
              {"name": "bob", "mass": 1.5, "center_of_mass": [0.2, -0.6, 0],
               "inertia": [0.1, 0.1, 0.2], "ends": {"tip": [0.3, -1, 0]}}],
        hinge=[{"name": "base", "type": "pin", "inboard": "ground", "outboard": "platform",
                "drive": "0.3 + 0.1*sin(2*t)"},
               {"name": "swing", "type": "pin", "inboard": "platform.on", "outboard": "bob",
                "law": law}],
        load=[{"on": "bob.tip", "force": [3, 0, 0], "axes": "body"}],
    )  # fmt: skip
    return mstmm.compile(scene, engine="looped")


def test_columns_are_slopes_of_the_equations_with_the_drive_taken_out() -> None:
    """In a moving state, by differences of inverse dynamics."""
    model = arm()
    linear = model.linearize([0, 0.4], [0, 1.2], t=0.7,
                             inputs=["base.angle_acceleration"])  # fmt: skip
    data = model.scene.model_dump(by_alias=True, exclude_defaults=True)
    del data["hinge"][0]["drive"]
    free = mstmm.compile(mstmm.Scene(**data), engine="looped")
    given = [linear.state.q, linear.state.u, linear.state.udot]
    for k, ours in enumerate((linear.K_prescribed, linear.C_prescribed, -linear.V)):
        step = 1e-5 * np.eye(2)[0]
        ahead, behind = (
            free.inverse_dynamics(*[x + sign * step if j == k else x for j, x in enumerate(given)])
            for sign in (1, -1)
        )
        np.testing.assert_allclose(ours[0, 0], ((ahead - behind) / 2e-5)[1], rtol=1e-8)


def test_a_run_that_is_shaken_a_little_goes_as_the_answer_says() -> None:
    """The steady motion under a small sine of the drive."""
    omega, size = 2.5, 1e-4
    base = mstmm.Scene(**arm().scene.model_dump(by_alias=True, exclude_defaults=True))
    data = base.model_dump(by_alias=True, exclude_defaults=True)
    data["hinge"][0]["drive"] = "0.3"
    still = mstmm.compile(mstmm.Scene(**data), engine="looped")
    answer = still.frequency_response([omega], ["base.angle"], ["swing.angle", "bob.tip.x"])
    rest = still.linearize().state.q
    data["hinge"][0]["drive"] = f"0.3 + {size}*sin({omega}*t)"
    model = mstmm.compile(mstmm.Scene(**data), engine="looped")
    times = np.linspace(80, 90, 101)
    run = model.simulate(90.0, output_times=times, initial=(rest, [0, 0]), rtol=1e-11, atol=1e-13)
    for k, name in enumerate(("swing.angle", "bob.tip.x")):
        expected = size * (answer.response[0, k, 0] * np.exp(1j * omega * times)).imag
        found = run.quantity(name).values
        found = found - found.mean() - (expected - expected.mean())
        assert np.abs(found).max() < 2e-3 * np.abs(expected).max()


def test_ground_and_platform_agree() -> None:
    """What moves beside a platform is what moves beside the ground, shaken alike."""
    omega = np.array([1.0, 6.0, 15.0])
    found = shaker().frequency_response(
        omega, ["base.displacement_acceleration", "ground.acceleration.x"], ["mount.displacement"]
    )
    np.testing.assert_allclose(found.response[:, 0, 0], found.response[:, 0, 1], rtol=1e-12)


def test_python_control_takes_them() -> None:
    linear = shaker().linearize(inputs=["base.displacement_acceleration"])
    system = linear.to_control(["mass.ax"])
    assert system.state_labels[2:] == ["base_displacement", "base_displacement'"]
    np.testing.assert_allclose(system(6j), transmissibility(6.0), rtol=1e-12)
    assert {"K_driven", "driven"} <= set(linear.to_dict())


def test_an_input_that_a_drive_follows_is_its_motion() -> None:
    """In the input's own unit, by the slope of the drive."""
    slide = {"name": "base", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground",
             "outboard": "mass", "drive": "height/1000 + 2*other"}  # fmt: skip
    given = [{"name": "height", "unit": "mm", "rates": [0, 0]}, {"name": "other", "rates": [0, 0]}]
    body = [{"name": "mass", "mass": M, "inertia": [1, 1, 1]}]
    scene = {"gravity": (0, 0, 0), "body": body, "hinge": [slide], "input": given}
    model = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    found = model.frequency_response([3.0], ["height", "other"], ["mass.x", "mass.vx"])
    assert found.input_units == ("mm", "")
    expected = np.array([[1e-3, 2], [3e-3j, 6j]])
    np.testing.assert_allclose(found.response[0], expected, rtol=1e-12)
    one = shaker().frequency_response([3.0], ["road", "base.displacement"], ["mass.x"])
    np.testing.assert_array_equal(one.response[:, :, 0], one.response[:, :, 1])
    slide["drive"] = "height/1000*cos(t)"
    going = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    with pytest.raises(SceneError, match="also on time"):
        going.frequency_response([3.0], ["height"], ["mass.x"])


@pytest.mark.parametrize(
    ("name", "found"),
    [("base.displacement", 'of a drive is its acceleration, "base.displacement_acceleration"'),
     ("road", 'input of a drive is its acceleration, "base.displacement_acceleration"'),
     ("base.effort", 'such as "base.displacement_acceleration"'),
     ("base.displacement_aceleration", 'did you mean "base.displacement_acceleration"')],
)  # fmt: skip
def test_what_matrices_do_not_take(name: str, found: str) -> None:
    with pytest.raises(SceneError, match=found):
        shaker().linearize(inputs=[name])


def test_structural_damping_is_refused() -> None:
    with pytest.raises(SceneError, match=r"base\.displacement.*cannot be combined with structural"):
        shaker().linearize().frequency_response([1.0], ["base.displacement"], structural=0.1)


def test_formulas_have_no_column_of_a_drive() -> None:
    linear = shaker().linearize(inputs=["base.displacement_acceleration"])
    with pytest.raises(SceneError, match=r"motion of the drive of base\.displacement"):
        linear.symbolic(keep=["mass.mass"])


def test_an_input_in_an_output_counts_at_once_where_a_drive_follows_it() -> None:
    """x = z (k + i omega c) / (k + i omega c - omega^2) of the mass; the output adds 2 z."""
    rail = {"type": "prismatic", "axis": [1, 0, 0]}
    model = mstmm.compile(mstmm.Scene(
        gravity=[0, 0, 0],
        body=[{"name": name, "mass": 1.0, "inertia": [1, 1, 1]} for name in ("plate", "mass")],
        hinge=[
            rail | {"name": "shaker", "inboard": "ground", "outboard": "plate", "drive": "z"},
            rail | {"name": "mount", "inboard": "plate", "outboard": "mass",
                    "law": {"stiffness": 4.0, "damping": 0.1}},
        ],
        input=[{"name": "z", "unit": "m", "rates": [0, 0]}],
        output=[{"name": "both", "of": "mass.x + 2*z"}, {"name": "own", "of": "z"}],
    ))  # fmt: skip
    found = model.frequency_response([1.0], ["z"]).response[0, :, 0]
    spring = 4.0 + 0.1j
    assert np.abs(found - [spring / (spring - 1.0) + 2.0, 1.0]).max() < 1e-13
