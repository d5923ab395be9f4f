"""The coefficients and what they promise, without the C loop."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.integrate import DOP853, RK45

from mstmm.errors import SceneError
from mstmm.runtime.integrate import steppers
from mstmm.runtime.integrate.steppers import from_monomials, to_read_only

METHODS = ("rk4", "dopri5", "dop853", "pirk13")


@pytest.mark.parametrize("name", METHODS)
def test_amplification_agrees_with_the_exponential_to_the_order(name: str) -> None:
    tableau = steppers.get(name)
    size = 1.0 if name == "pirk13" else 0.2  # where truncation is above rounding
    points = (size * (1 + 1j), size * (0.5 + 0.5j))
    errors = [abs(tableau.amplification(z) - np.exp(z)) for z in points]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(tableau.order + 1, abs=0.25)


@pytest.mark.parametrize("name", METHODS)
def test_dense_output_starts_and_ends_with_the_step_and_its_slopes(name: str) -> None:
    tableau = steppers.get(name)
    step = np.append(tableau.B, np.zeros(1 + tableau.n_extra))
    assert np.all(tableau.weights(0.0) == 0.0)
    assert np.array_equal(tableau.weights(1.0), tableau.dense[:, 0])
    assert np.abs(tableau.weights(1.0) - step).max() < 1e-15
    h = 1e-7
    first = tableau.weights(h) / h
    last = (tableau.weights(1.0) - tableau.weights(1.0 - h)) / h
    assert first == pytest.approx(np.eye(len(step))[0], abs=1e-4)
    assert last == pytest.approx(np.eye(len(step))[tableau.n_stages], abs=1e-4)


def test_dense_output_is_scipys() -> None:
    rng = np.random.default_rng(3)
    for theta in rng.random(5):
        powers = theta ** np.arange(1, 5)
        assert steppers.get("dopri5").weights(theta) == pytest.approx(RK45.P @ powers, abs=1e-14)
    # DOP853's dense output, run on y' = f(t) so that the stages are samples of f
    solver = DOP853(lambda t, y: [np.cos(3 * t)], 0.0, [0.0], 2.0, first_step=0.7)
    solver.step()
    dense, h = solver.dense_output(), solver.t
    tableau = steppers.get("dop853")
    nodes = np.concatenate([tableau.C, [1.0], tableau.C_extra]) * h
    for theta in rng.random(5):
        mine = h * tableau.weights(theta) @ np.cos(3 * nodes)
        assert mine == pytest.approx(dense(theta * h)[0], abs=1e-13)


def test_stability_limits_are_the_published_ones() -> None:
    rk4 = steppers.get("rk4")
    assert rk4.imaginary_stability_limit == pytest.approx(2 * np.sqrt(2), abs=1e-6)
    assert rk4.real_stability_limit == pytest.approx(2.7853, abs=1e-4)
    # Hairer and Wanner, Solving ODE II, IV.2: about 3.3 for dopri5, 6.1 to 6.4 for dop853
    assert steppers.get("dopri5").real_stability_limit == pytest.approx(3.3, abs=0.05)
    assert 6.1 < steppers.get("dop853").real_stability_limit < 6.5


def test_unknown_method_names_the_known_ones() -> None:
    with pytest.raises(SceneError, match=r'"rk5" is not known; available are: auto, rk4, dopri5'):
        steppers.get("rk5")


def test_a_taken_name_is_refused() -> None:
    with pytest.raises(ValueError, match="'rk4' exists already"):
        steppers.register(steppers.get("rk4"))


def test_contradictory_coefficients_are_refused() -> None:
    rk4 = steppers.get("rk4")
    cases = (
        ({"C": to_read_only([0.0, 0.4, 0.5, 1.0])}, r"sum\(A"),
        ({"B": to_read_only([0.5, 0.5, 0.5, 0.5])}, "= 1"),
        ({"A": to_read_only(np.eye(4))}, "not explicit"),
        ({"A": to_read_only(np.zeros((4, 3)))}, r"A is \(4, 3\), expected \(4, 4\)"),
        ({"dense": from_monomials(np.ones((5, 2)))}, "dense output differs from"),
        ({"C": np.array([0.0, 0.5, 0.5, 1.0])}, "to_read_only"),
    )
    for change, message in cases:
        with pytest.raises(ValueError, match=message):
            dataclasses.replace(rk4, **change)
