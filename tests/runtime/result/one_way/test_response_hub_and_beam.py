"""A hub with a clamped beam, pushed by one period of a torque: every level of model against the
coupled one with five shapes and stiffening, as published with the ladder of models.

Tip errors are of the beam's length, over two periods.  The lesson of scene C: with a light hub the
one-way response is worse than a rigid beam, and says so.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import mstmm

Array = NDArray[np.float64]

#: Inertia of the hub, bending stiffness, period and torque; the errors of the levels.
SCENES: dict[str, tuple[float, float, float, float]] = {
    "A": (5.0, 400.0, 1.5, 20.0),
    "B": (5.0, 20.0, 1.2, 8.0),
    "C": (0.2, 20.0, 1.2, 1.0),
    "D": (0.5, 2.0, 3.0, 2.4),
}
RIGID = {"A": 8.6e-4, "B": 9.6e-3, "C": 4.7e-3, "D": 1.3e-1}
ONE_WAY = {"A": 1.4e-4, "B": 1.7e-3, "C": 9.6e-3, "D": 1.4e-1}
LINEAR = {"A": 4.2e-6, "B": 6.7e-5, "C": 6.4e-5, "D": 4.2e-2}
STIFFENED = {"A": 3e-6, "B": 3e-5, "C": 5e-5, "D": 8.1e-4}
CHI = {"C": 0.607, "D": 0.388}


def hub_and_beam(name: str, shapes: int, **beam: Any) -> mstmm.Scene:
    inertia, bending, period, torque = SCENES[name]
    effort = f"where(t < {period}, {torque} * sin(2 * pi * t / {period}), 0)"
    return mstmm.Scene(
        gravity=[0, 0, 0],
        body=[{"name": "hub", "mass": 1.0, "inertia": [inertia] * 3}],
        beam=[{
            "name": "arm", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": bending,
            "modes": {"y": shapes}, "frame": "tangent", "basis": "clamped-free", **beam,
        }],
        hinge=[
            {"name": "axle", "type": "pin", "inboard": "ground", "outboard": "hub",
             "law": {"effort": effort}},
            {"name": "root", "type": "fixed", "inboard": "hub", "outboard": "arm"},
        ],
    )  # fmt: skip


def run(name: str, shapes: int, level: str, **beam: Any) -> mstmm.Result:
    period = SCENES[name][2]
    model = mstmm.compile(hub_and_beam(name, shapes, **beam), "looped", flexibility=level)
    return model.simulate(2 * period, output_times=np.linspace(0, 2 * period, 201))


@cache
def reference(name: str) -> Array:
    return run(name, 5, "coupled").position("arm.tip")


def error(name: str, result: mstmm.Result) -> float:
    return float(np.linalg.norm(result.position("arm.tip") - reference(name), axis=1).max())


def is_near_printed_value(value: float, expected: float) -> bool:
    """Equal as far as an expected value of one or two digits says."""
    return value == pytest.approx(expected, rel=0.17)


@pytest.mark.parametrize("name", SCENES)
def test_ladder(name: str) -> None:
    assert is_near_printed_value(error(name, run(name, 1, "rigid")), RIGID[name])
    assert is_near_printed_value(error(name, run(name, 1, "one-way")), ONE_WAY[name])
    assert is_near_printed_value(
        error(name, run(name, 1, "coupled", stiffening=False)), LINEAR[name]
    )
    assert is_near_printed_value(error(name, run(name, 1, "coupled")), STIFFENED[name])


@pytest.mark.parametrize("name", SCENES)
def test_says_when_coupling_matters(name: str) -> None:
    result = run(name, 1, "one-way")
    told = [warning for warning in result.warnings if "(chi)" in warning]
    if name in CHI:
        assert result.couplings == {"arm": pytest.approx(CHI[name], abs=1e-3)}  # type: ignore[attr-defined]
        assert 'flexibility = "coupled"' in told[0]
    else:
        assert not told


def test_costs_less_than_coupling() -> None:
    """Scene A: no shape limits the step of the rigid run."""
    one_way, coupled = run("A", 1, "one-way"), run("A", 1, "coupled")
    cost = one_way.cost  # type: ignore[attr-defined]
    assert one_way.statistics is not None and coupled.statistics is not None
    whole = one_way.statistics.evaluations + cost.evaluations + cost.samples
    assert 4 * whole < coupled.statistics.evaluations
    assert cost.error < 1e-7
    assert "1 oscillators over" in str(cost)
