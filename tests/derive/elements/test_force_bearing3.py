"""Bushings that are not conservative, as bearings are: runs against matrix exponentials."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigvals, expm

import mstmm
from mstmm.array_validation import Array

MASS, MOMENTS = 2.0, (0.1, 0.2, 0.3)
#: Along y and z, as of a fluid film: negative cross-coupled stiffness, unsymmetric damping.
STIFFNESS: Array = np.array([[900.0, 400.0], [-600.0, 700.0]])
DAMPING: Array = np.array([[30.0, -12.0], [5.0, 26.0]])
_DRAWN = np.random.default_rng(5).standard_normal((2, 6, 6))
SIX = [50 * m @ m.T + 20 * (m - m.T) for m in _DRAWN]


def journal(engine: str = "looped", **bearing: Any) -> mstmm.Model:
    """A point that moves along y and z, on a bearing across x."""
    still = {"mass": 1e-12, "inertia": [1e-12] * 3}
    scene = mstmm.Scene(
        gravity=[0, 0, 0],
        body=[{"name": "slide", **still}, {"name": "journal", "mass": MASS, "inertia": [1, 1, 1]}],
        hinge=[{"name": "y", "type": "prismatic", "axis": [0, 1, 0], "inboard": "ground",
                "outboard": "slide", "initial": {"q": [0.01]}},
               {"name": "z", "type": "prismatic", "axis": [0, 0, 1], "inboard": "slide",
                "outboard": "journal", "initial": {"u": [0.2]}}],
        bushing=[{"name": "bearing", "from": "ground", "to": "journal", "conservative": False,
                  "stiffness": STIFFNESS.tolist(), "damping": DAMPING.tolist(), **bearing}],
    )  # fmt: skip
    return mstmm.compile(scene, engine=engine)


def state_matrix(mass: Array, damping: Array, stiffness: Array) -> Array:
    n = len(mass)
    below = -np.linalg.solve(mass, np.hstack([stiffness, damping]))
    return np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), below])


@pytest.mark.parametrize(
    ("engine", "method"), [("looped", "dop853"), ("fused", "dop853"), ("looped", "rodas5p")]
)
def test_a_run_is_the_exponential_of_its_matrix(engine: str, method: str) -> None:
    times = np.linspace(0, 0.5, 11)
    result = journal(engine).simulate(
        0.5, method=method, rtol=1e-10, atol=1e-12, output_times=times
    )
    matrix = state_matrix(MASS * np.eye(2), DAMPING, STIFFNESS)
    known = np.array([expm(matrix * t) @ [0.01, 0, 0, 0.2] for t in times])
    np.testing.assert_allclose(result.q, known[:, :2], atol=1e-8)
    load = -(known[:, :2] @ STIFFNESS.T + known[:, 2:] @ DAMPING.T)
    found = result.quantity("bearing.force").values
    np.testing.assert_allclose(found[:, 1:], load, atol=1e-5)


def test_circulation_is_work_that_balances_the_energy() -> None:
    """Unstable without damping: the energy grows by what the bearing does, and all is trusted."""
    model = journal(damping=[0.0] * 6)
    result = model.simulate(0.5, rtol=1e-10, atol=1e-12, certify=True)
    matrix = state_matrix(MASS * np.eye(2), 0 * DAMPING, STIFFNESS)
    assert eigvals(matrix).real.max() > 1
    energy = result.energy()
    assert energy[-1] > 20 * energy[0]
    np.testing.assert_allclose(energy - result.work, energy[0], atol=1e-7 * energy[-1])
    assert result.trusted, result.warnings


@pytest.mark.parametrize("stiffness", [SIX[0], np.pad(STIFFNESS, ((1, 3), (1, 3)))])
def test_a_linear_model_has_the_matrices_as_they_are(stiffness: Array) -> None:
    scene = mstmm.Scene(
        gravity=[0, 0, 0], body=[{"name": "block", "mass": MASS, "inertia": list(MOMENTS)}],
        hinge=[{"name": "motion", "type": "free", "inboard": "ground", "outboard": "block"}],
        bushing=[{"name": "mount", "from": "ground", "to": "block", "conservative": False,
                  "stiffness": stiffness.tolist(), "damping": SIX[1].tolist()}],
    )  # fmt: skip
    model = mstmm.compile(scene, engine="looped")
    linear = model.linearize(q=[0.0, 0, 0, 1, 0, 0, 0], u=np.zeros(6))
    size = np.abs(stiffness).max()
    np.testing.assert_allclose(linear.K, stiffness, atol=1e-11 * size)
    np.testing.assert_allclose(linear.C, SIX[1], atol=1e-11 * np.abs(SIX[1]).max())
    mass = np.diag([MASS] * 3 + [*MOMENTS])
    known = eigvals(state_matrix(mass, SIX[1], stiffness))
    modes = linear.modes()
    for value in modes.eigenvalues:
        assert np.abs(known - value).min() < 1e-8 * np.abs(known).max()
    assert modes.unstable.any() == (known.real.max() > 0)


def test_the_threshold_of_cross_coupling() -> None:
    """x'' m + c x' + k x = -+ N: unstable beyond N = c sqrt(k / m)."""
    k, c = 800.0, 20.0
    scene = journal(stiffness=[[k, 100.0], [-100.0, k]], damping=[[c, 0.0], [0, c]])
    model = mstmm.compile(scene.scene, engine="looped")
    limit = c * np.sqrt(k / MASS)
    for part, growing in ((0.98, False), (1.02, True)):
        changed = model.with_parameters(
            {"bearing.stiffness[8]": part * limit, "bearing.stiffness[13]": -part * limit}
        )
        assert changed.modes().unstable.any() == growing


def test_a_shaft_may_spin_in_a_bearing_without_moments() -> None:
    """Both ends turn against each other for many turns."""
    scene = mstmm.Scene(
        gravity=[0, 0, 0], body=[{"name": "rotor", "mass": MASS, "inertia": [0.1, 0.2, 0.2]}],
        hinge=[{"name": "motion", "type": "free", "inboard": "ground", "outboard": "rotor"}],
        bushing=[{"name": "bearing", "from": "ground", "to": "rotor", "conservative": False,
                  "stiffness": STIFFNESS.tolist(), "damping": DAMPING.tolist()}],
    )  # fmt: skip
    model, times = mstmm.compile(scene, engine="looped"), np.linspace(0, 0.5, 6)
    start = [0.0, 0.01, 0, 1, 0, 0, 0], [0.0, 0, 0.2, 50, 0, 0]
    # Axes of the body turn along with it; speeds of the start are those of axes that coincide.
    result = model.simulate(0.5, rtol=1e-10, atol=1e-12, initial=start, output_times=times)
    assert result.success, result.message
    matrix = state_matrix(MASS * np.eye(2), DAMPING, STIFFNESS)
    known = np.array([expm(matrix * t) @ [0.01, 0, 0, 0.2] for t in times])
    found = result.quantity("rotor.position").values
    np.testing.assert_allclose(found[:, 1:], known[:, :2], atol=1e-8)
