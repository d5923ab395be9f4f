"""The exponential method: vibration that is wanted costs no steps, and is there between them."""

from __future__ import annotations

from functools import cache
from typing import Any

import mpmath
import numpy as np
import pytest

import mstmm
from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.runtime.integrate.c_loop import Status
from mstmm.runtime.integrate.steppers import get
from mstmm.runtime.model.model import Model
from tests.support.implicit_methods import motions

TIMES = np.linspace(0.0, 1.0, 101)


@cache
def swinging() -> tuple[Model, Array, int]:
    """A pinned beam that falls and vibrates undamped, its tip at `TIMES` and what that took."""
    scene = motions.beam_pendulum(1e3)
    model = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    run = model.simulate(1.0, rtol=1e-10, atol=1e-12, output_times=TIMES)
    assert run.statistics is not None
    return model, run.position("beam.tip"), run.statistics.evaluations


def test_a_falling_beam_vibrates_in_long_steps() -> None:
    """At every time, although a step covers many periods of the fastest shape."""
    model, exact, evaluations = swinging()
    run = model.simulate(1.0, "exprb32", 0.01, output_times=TIMES)
    assert run.statistics is not None
    assert run.statistics.evaluations < evaluations / 300
    assert np.abs(run.position("beam.tip") - exact).max() < 2e-6


@pytest.mark.parametrize("rtol", [1e-4, 1e-6])
def test_steps_follow_the_tolerance_and_not_the_vibration(rtol: float) -> None:
    model, exact, _ = swinging()
    run = model.simulate(1.0, "exprb32", rtol=rtol, atol=rtol / 100, output_times=TIMES)
    assert run.success, run.message
    assert run.statistics is not None
    assert run.statistics.steps < 2 * rtol ** (-1 / 3)
    assert np.abs(run.position("beam.tip") - exact).max() < 20 * rtol


def test_energy_stays_in_long_steps() -> None:
    model, _, _ = swinging()
    run = model.simulate(5.0, "exprb32", 0.01)
    energy = np.asarray(run.energy())
    assert np.abs(energy - energy[0]).max() < 1e-5 * np.ptp(np.asarray(run.q)[:, 0])


def masses(step: float) -> tuple[Any, Array, float]:
    """Three masses in a row between undamped springs over one step; what they do
    at times inside it, by their modes."""
    stiffness, start = np.array([3e4, 1e8, 2e6]), np.array([0.1, 0.1, -0.2])
    along = {"type": "prismatic", "axis": [1, 0, 0]}
    hinges = [
        {"name": f"spring{i}", **along, "inboard": f"mass{i - 1}" if i else "ground",
         "outboard": f"mass{i}", "law": {"stiffness": float(k)}, "initial": {"q": [float(q)]}}
        for i, (k, q) in enumerate(zip(stiffness, start, strict=True))
    ]  # fmt: skip
    scene = mstmm.Scene(
        gravity=(0, 0, 0), body=[{"name": f"mass{i}", "mass": 1.0} for i in range(3)], hinge=hinges
    )
    model = mstmm.compile(scene, engine="looped")
    t = step * np.linspace(0.0, 1.0, 12)
    run = model.simulate(step, "exprb32", step, output_times=t)
    assert run.statistics is not None
    assert run.statistics.steps == 1
    exact, fastest = by_modes(stiffness, start, t)
    return run, exact, fastest


def by_modes(stiffness: Array, start: Array, t: Array) -> tuple[Array, float]:
    """Stretches (times, 3) at t, and the fastest frequency, by more digits than are compared."""
    with mpmath.workdps(50):
        into = mpmath.matrix(np.tril(np.ones((3, 3))).tolist())  # to places, of unit masses
        back = into**-1
        squares, modes = mpmath.eigsy(back.T * mpmath.diag(stiffness.tolist()) * back)
        part = modes.T * into * mpmath.matrix(start.tolist())
        found = [
            back * modes * mpmath.matrix([mpmath.cos(mpmath.sqrt(s) * time) * p
                                          for s, p in zip(squares, part, strict=True)])
            for time in t
        ]  # fmt: skip
        rows = [[float(x) for x in row] for row in found]
        return np.array(rows), float(mpmath.sqrt(max(squares)))


@pytest.mark.parametrize("step", [1e-3, 1.0, 1e3])
def test_a_linear_motion_is_exact_in_one_step(step: float) -> None:
    """But for the rounding of its fastest angle."""
    run, exact, fastest = masses(step)
    rounding = 2.0**-52 * max(10.0, step * fastest)
    assert np.abs(run.q - exact).max() < 10 * rounding
    energy = np.asarray(run.energy())
    assert np.abs(energy / energy[0] - 1).max() < 10 * rounding


def test_steps_that_would_leave_nothing_but_rounding_are_refused() -> None:
    spring = {"name": "spring", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground",
              "outboard": "mass", "initial": {"q": [1e-3]}, "law": {"stiffness": 1e30}}  # fmt: skip
    scene = mstmm.Scene(gravity=(0, 0, 0), body=[{"name": "mass", "mass": 1.0}], hinge=[spring])
    run = mstmm.compile(scene, engine="looped").simulate(1.0, "exprb32", 1.0)
    assert run.status is Status.TANGENT_FAILED
    assert "lose its fastest motion to rounding; use a shorter step" in run.message


def test_more_unknowns_than_it_takes_are_refused() -> None:
    most = get("exprb32").max_unknowns
    for count in (most // 2, most // 2 + 1):
        model = mstmm.compile(mstmm.Scene(**motions.hanging_chain(count)), engine="looped")
        if 2 * count <= most:
            assert model.simulate(0.01, "exprb32", 0.01).success
            continue
        expected = f"at most {most}; found {2 * count}: use rodas5p"
        with pytest.raises(SceneError, match=expected):
            model.simulate(0.01, "exprb32")
        with pytest.raises(SceneError, match=expected):
            model.simulate_batch(model.initial_state(), t_end=0.01, method="exprb32")
