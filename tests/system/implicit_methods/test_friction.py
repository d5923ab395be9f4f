"""Friction and stops by implicit methods: they arrive, or say at which coordinate they do not."""

from __future__ import annotations

from functools import cache
from typing import Any

import pytest

import mstmm
from mstmm.runtime.integrate.c_loop import Status
from mstmm.runtime.integrate.steppers import IMPLICIT, get
from mstmm.runtime.model.model import Model
from tests.support.scenes.results import rod

ADAPTIVE = [method for method in IMPLICIT if get(method).adaptive]


@cache
def pulled_mass(sharpness: float) -> Model:
    """1 kg on a rail, pulled by a spring whose other end runs away at 0.3 m/s, over 1 N of friction
    that changes its sign within `sharpness` (m/s): it sticks, breaks away at 1/3 s, slides."""
    law = {
        "stiffness": 10.0, "effort": "10*0.3*t",
        "friction": {"coulomb": 1.0, "regularisation_velocity": sharpness},
    }  # fmt: skip
    hinge = {"name": "rail", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground",
             "outboard": "mass", "law": law}  # fmt: skip
    body = {"name": "mass", "mass": 1.0}
    return mstmm.compile(
        mstmm.Scene(gravity=(0, 0, 0), body=[body], hinge=[hinge]), engine="looped"
    )


@cache
def arm(sharpness: float, stop: float, damping: float) -> Model:
    """Two rods that fall from the horizontal, with friction in their pins, each against a stop."""
    law = {
        "friction": {"coulomb": 2.0, "regularisation_velocity": sharpness},
        "limits": {"lower": -1.0, "upper": 1.0, "stiffness": stop, "damping": damping},
    }
    hinges = [
        {"name": f"pin{i}", "type": "pin", "inboard": f"rod{i - 1}.tip" if i else "ground",
         "outboard": f"rod{i}", "law": law}
        for i in range(2)
    ]  # fmt: skip
    bodies = [rod("rod0"), rod("rod1")]
    return mstmm.compile(
        mstmm.Scene(gravity=(0, -9.81, 0), body=bodies, hinge=hinges), engine="looped"
    )


@cache
def place(model: Model, t_end: float) -> Any:
    """Coordinates at the end."""
    run = model.simulate(t_end, rtol=1e-10, atol=1e-12, output_times=[t_end])
    assert run.success, run.message
    return run.q[-1]


@pytest.mark.parametrize("method", ADAPTIVE)
@pytest.mark.parametrize("sharpness", [1e-2, 1e-3])
def test_what_sticks_breaks_away_when_it_should(method: str, sharpness: float) -> None:
    model = pulled_mass(sharpness)
    run = model.simulate(2.0, method, rtol=1e-4, atol=1e-6)
    assert run.success, run.message
    assert run.q[-1] == pytest.approx(place(model, 2.0), abs=1e-3)


@pytest.mark.parametrize("method", IMPLICIT)
def test_fixed_steps_stick_and_slide(method: str) -> None:
    # The step is 1e3 times as long as a friction of 1 N needs to stop 1 kg at 1e-5 m/s.
    model = pulled_mass(1e-5)
    run = model.simulate(2.0, method, 0.01, output_times=[0.2, 2.0])
    assert run.success, run.message
    assert abs(run.q[0, 0]) < 2e-6  # it creeps at less than 1e-5 m/s
    assert run.q[-1] == pytest.approx(place(pulled_mass(1e-3), 2.0), abs=1e-3)


@pytest.mark.parametrize("method", ["esdirk436", "kvaerno5", "genalpha", "hht", "newmark"])
def test_iterated_methods_see_where_a_sharp_friction_breaks_away(method: str) -> None:
    # Rosenbrock's linearise it where a step begins, and may hold on for too long unnoticed.
    model = pulled_mass(1e-6)
    run = model.simulate(2.0, method, rtol=1e-4, atol=1e-6)
    assert run.success, run.message
    assert run.q[-1] == pytest.approx(place(pulled_mass(1e-3), 2.0), abs=1e-2)
    assert run.statistics is not None
    assert run.statistics.steps < 100


@pytest.mark.parametrize("method", ADAPTIVE)
@pytest.mark.parametrize("damping", [10.0, 0.0])
def test_an_arm_with_friction_meets_its_stops(method: str, damping: float) -> None:
    model = arm(1e-2, 1e4, damping)
    run = model.simulate(1.0, method, rtol=1e-6, atol=1e-8)
    assert run.success, run.message
    second = get(method).order == 2
    assert run.q[-1] == pytest.approx(place(model, 1.0), abs=2e-2 if second else 1e-2)


@pytest.mark.parametrize("method", ["esdirk436", "kvaerno5", "genalpha", "hht", "newmark"])
def test_what_does_not_converge_is_named(method: str) -> None:
    # The second pin holds or slides within a step that is far too long for either.
    model = arm(1e-3, 1e4, 10.0)
    run = model.simulate(1.0, method, 0.01)
    assert run.status is Status.NOT_CONVERGED
    assert "Newton's iteration does not converge at t = " in run.message
    assert "pin1.angle" in run.message
    assert "still changes; a smaller step, or a Rosenbrock method" in run.message
