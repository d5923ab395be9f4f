"""Observed orders of the fixed-step method through whole runs of scenes."""

from __future__ import annotations

import numpy as np
import pytest

import mstmm
from tests.reference.jets import Array
from tests.support.scenes.rods import chain, drawn_state

STEPS = (8e-3, 4e-3, 2e-3, 1e-3)


def orders(errors: list[float]) -> Array:
    """Order between neighbours of a series of halved steps."""
    return np.asarray(np.log2(np.array(errors[:-1]) / np.array(errors[1:])))


def double_pendulum() -> mstmm.Model:
    scene = chain(["pin", "pin"], gravity=(0, -9.81, 0))
    for hinge, angle in zip(scene["hinge"], (0.2, 0.5), strict=True):
        hinge["initial"] = {"q": [angle], "u": [0.0]}
    return mstmm.compile(mstmm.Scene(**scene))


def test_energy_of_the_double_pendulum_has_order_five() -> None:
    model, errors = double_pendulum(), []
    for step in STEPS[:3]:
        energy = model.simulate(5.0, "rk4", step=step).energy()
        errors.append(abs(energy[-1] - energy[0]))
    assert orders(errors)[-1] == pytest.approx(5.0, abs=0.35)


@pytest.mark.parametrize("kind", ["pin", "ball", "gimbal", "universal"])
def test_states_have_order_four(kind: str) -> None:
    scene = chain(["pin", "pin"] if kind == "pin" else ["ball", "ball"], 0.4)
    q, u = drawn_state(scene, np.random.default_rng(2))
    if kind in ("gimbal", "universal"):
        size = 3 if kind == "gimbal" else 2
        q, u = q[: 2 * size] * 0.3, u[: 2 * size]
        for hinge in scene["hinge"]:
            hinge["type"] = kind
            if kind == "universal":
                hinge["axis2"] = [0, 1, 0]
    model = mstmm.compile(mstmm.Scene(**scene))
    exact = model.simulate(1.0, rtol=1e-12, atol=1e-13, initial=(q, u))
    errors = []
    for step in STEPS:
        result = model.simulate(1.0, "rk4", step=step, initial=(q, u))
        ends = [np.append(r.q[-1], r.u[-1]) for r in (result, exact)]
        errors.append(float(np.abs(ends[0] - ends[1]).max()))
    assert orders(errors)[1] == pytest.approx(4.0, abs=0.35)


def test_a_free_body_has_order_four_and_its_quaternion_length_one() -> None:
    scene = chain(["free"], inertia=(0.1, 0.2, 0.25), gravity=(0, 0, 0))
    q, u = drawn_state(scene, np.random.default_rng(1))
    model = mstmm.compile(mstmm.Scene(**scene))
    exact = model.simulate(2.0, rtol=1e-12, atol=1e-13, initial=(q, u)).q[-1]
    errors = []
    for step in (0.08, 0.04, 0.02):
        result = model.simulate(2.0, "rk4", step=step, initial=(q, u))
        errors.append(float(np.abs(result.q[-1] - exact).max()))
        assert np.abs(np.linalg.norm(result.q[:, 3:], axis=1) - 1).max() < 1e-14
    assert orders(errors)[-1] == pytest.approx(4.0, abs=0.4)
