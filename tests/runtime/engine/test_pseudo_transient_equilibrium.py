"""Rest of many bodies by the factored tangent: against closed forms and sums of moments."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.random import Generator
from scipy.optimize import root

import mstmm
from mstmm.errors import NumericalFailure
from mstmm.runtime.engine.tangent_matrix import TangentMatrix

LENGTH, MASS, GRAVITY = 0.1, 0.2, 9.81


def chain(count: int, stiffness: float = 0.0) -> dict[str, Any]:
    """Rods in a row along x, on pins about y with springs."""
    rod = {"mass": MASS, "center_of_mass": [LENGTH / 2, 0, 0], "ends": {"tip": [LENGTH, 0, 0]},
           "inertia": [1e-6, MASS * LENGTH**2 / 12, MASS * LENGTH**2 / 12]}  # fmt: skip
    pin: dict[str, Any] = {"type": "pin", "axis": [0, 1, 0]}
    if stiffness:
        pin["law"] = {"stiffness": [stiffness]}
    return {
        "schema_version": 1,
        "gravity": [0, 0, -GRAVITY],
        "body": [{"name": f"rod{i}", **rod} for i in range(count)],
        "hinge": [
            {"name": f"pin{i}", "inboard": f"rod{i - 1}.tip" if i else "ground",
             "outboard": f"rod{i}", **pin}
            for i in range(count)
        ],
    }  # fmt: skip


def test_a_long_rope_hangs(rng: Generator) -> None:
    count = 2000
    model = mstmm.compile(mstmm.Scene(**chain(count)), engine="looped")
    start = rng.uniform(-0.005, 0.005, count)
    start[0] += np.pi / 2
    found = model.equilibrium(start)
    assert abs(found[0] - np.pi / 2) < 1e-9
    assert np.abs(found[1:]).max() < 1e-9


def test_a_cantilever_bends_as_its_moments_say() -> None:
    """By a radian under its weight: springs carry the moments of all that is outboard."""
    count, stiffness = 40, 60.0
    model = mstmm.compile(mstmm.Scene(**chain(count, stiffness)), engine="looped")

    def missing(q: np.ndarray) -> np.ndarray:
        along = LENGTH * np.cos(np.cumsum(q))
        weight = MASS * GRAVITY * (np.arange(count)[::-1] + 0.5)
        moments = np.cumsum((weight * along)[::-1])[::-1]
        return np.asarray(stiffness * q - moments)

    expected = root(missing, np.full(count, 0.02), tol=1e-14).x
    assert abs(expected.sum()) > 1
    found = model.equilibrium()
    assert np.abs(found - expected).max() < 1e-9
    assert max(map(abs, found.residuals.values())) < 1e-8
    assert not found.unstable_speeds


def test_rest_that_does_not_last_is_left_or_told() -> None:
    model = mstmm.compile(mstmm.Scene(**chain(30)), engine="looped")
    upright = -np.pi / 2 * np.eye(30)[0]
    found = model.equilibrium(upright + 1e-3 * np.eye(30)[0])
    turns = (found - np.pi / 2 * np.eye(30)[0]) / (2 * np.pi)
    assert np.abs(turns - np.round(turns)).max() < 1e-9
    found = model.equilibrium(upright)
    assert np.abs(found - upright).max() < 1e-9
    assert "pin0.angle_rate" in found.unstable_speeds
    assert "unstable" in {risk.name for risk in found.risks}


@pytest.mark.parametrize("count", [1, 5, 20])
def test_a_pivot_changes_sign_where_an_inverse_step_meets_what_topples(count: int) -> None:
    """Z = K + s^2 M is singular where s is the growth rate of an inverted chain."""
    model = mstmm.compile(mstmm.Scene(**chain(count)), engine="looped")
    tangent, still = TangentMatrix(model.looped), np.zeros(count)
    upright = np.zeros(count)
    upright[0] = -np.pi / 2
    tangent.residual(0.0, upright, still, still)
    units = np.eye(count)
    stiffness = np.array([tangent.slope(0.0, unit, still, still) for unit in units])
    mass = np.array([tangent.slope(0.0, still, still, unit) for unit in units])
    growth = np.sqrt(np.linalg.eigvals(-np.linalg.solve(mass, stiffness)).real.max())
    tangent.factor(1.001 * growth, 1.001 * growth)
    with pytest.raises(NumericalFailure, match=r'hinge "pin0".*an unstable motion grows'):
        tangent.factor(0.999 * growth, 0.999 * growth)
