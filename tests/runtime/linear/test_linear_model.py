"""Linear models in python-control: the same numbers, and a regulator that works."""

from __future__ import annotations

import control
import numpy as np
import pytest

import mstmm
from mstmm.errors import SceneError
from tests.support.scenes.linear import hanging_beam, pendulum


def beam() -> mstmm.Model:
    return mstmm.compile(hanging_beam(1.0, 3), engine="looped")


def test_frequency_responses_agree() -> None:
    linear = beam().linearize(inputs=["pin.effort", "beam.tip.force.y"])
    outputs = ["pin.angle", "pin.angle_rate", "beam.tip.position.y", "beam.tip.acceleration.y"]
    system = linear.to_control(outputs, disturbances=True)
    assert system.input_labels[:2] == ["pin_effort", "beam_tip_force_y"]
    assert system.output_labels[2] == "beam_tip_position_y" and system.ninputs == 5
    assert system.state_labels[0] == "pin_angle" and system.nstates == 8
    omega = np.array([0.7, 3.0, 11.0])
    theirs = system(1j * omega)[:, :2].transpose(2, 0, 1)
    ours = linear.frequency_response(omega, outputs=outputs).response
    np.testing.assert_allclose(theirs, ours, rtol=1e-9, atol=1e-12)


def test_outputs_of_the_state_space() -> None:
    linear = mstmm.compile(pendulum()).linearize(inputs=["pivot.effort"])
    c, d = linear.output_matrices(["pivot.angle", "bob.tip.vx", "bob.tip.ax"])
    inertia, weight = 0.53, 9.81
    np.testing.assert_allclose(c, np.array([[1, 0], [0, 1], [-weight / inertia, 0]]), atol=1e-12)
    np.testing.assert_allclose(d, np.array([[0], [0], [1 / inertia]]), atol=1e-12)
    assert linear.output_matrices()[0].shape == (1, 2)


def test_a_regulator_holds_the_nonlinear_pendulum_upright() -> None:
    """Designed where it stands, run from 0.2 rad beside it."""
    model = mstmm.compile(pendulum())
    linear = model.linearize([np.pi], inputs=["pivot.effort"])
    gain = control.lqr(linear.to_control(), np.diag([10.0, 1.0]), [[0.1]])[0][0].tolist()
    law = {"effort": f"-({gain[0]!r})*(q - pi) - ({gain[1]!r})*u"}
    held = mstmm.compile(pendulum(np.pi + 0.2, law=law))
    run = held.simulate(5.0)
    assert abs(run.q[-1, 0] - np.pi) < 1e-3 < abs(run.q[0, 0] - np.pi)


def test_what_makes_no_sense() -> None:
    linear = beam().linearize()
    with pytest.raises(SceneError, match="has no inputs; give inputs"):
        linear.to_control()
    with pytest.raises(SceneError, match=r"pin\.angel.*did you mean"):
        beam().linearize(inputs=["pin.effort"]).to_control(["pin.angel"])
    with pytest.raises(SceneError, match="outputs is empty"):
        beam().linearize(inputs=["pin.effort"]).to_control([])
