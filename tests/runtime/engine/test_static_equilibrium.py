"""The search for rest on efforts given by formulas."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from mstmm.errors import NumericalFailure
from mstmm.runtime.engine.static_equilibrium import (
    EquilibriumNotFoundError,
    EquilibriumProblem,
    UndeterminedEquilibriumError,
    find_determined_equilibrium,
)

Array = NDArray[np.float64]


def add_step(q: Array, step: Array) -> Array:
    return q + step


def spiral(q: Array) -> Array:
    """A load of 2 on a spring whose force turns with its length: no potential."""
    z = complex(q[0], q[1])
    left = z * np.exp(2j * abs(z) ** 2) - 2.0
    return np.array([left.real, left.imag])


def test_a_load_that_is_too_much_at_once_is_applied_in_parts() -> None:
    found = find_determined_equilibrium(
        EquilibriumProblem(spiral, add_step, np.ones(2)), np.zeros(2), 1e-10
    )
    assert np.abs(spiral(found)).max() < 1e-12


def test_units_do_not_matter() -> None:
    """The same springs, one in micrometres and one in megametres."""
    units = np.array([1e-6, 1e6])
    stiffness = np.array([[2.0, -1.0], [-1.0, 3.0]])

    def required_efforts(q: Array) -> Array:
        x = q / units
        return np.asarray((stiffness @ (x + x**3) - [1.0, 2.0]) / units)

    found = find_determined_equilibrium(
        EquilibriumProblem(required_efforts, add_step, units), np.zeros(2), 1e-10
    )
    assert np.abs(required_efforts(found) * units).max() < 1e-12


def test_a_state_that_does_not_exist_is_not_stepped_into() -> None:
    def required_efforts(q: Array) -> Array:
        if q[0] > 0.4:
            raise NumericalFailure("beyond the end")
        return np.array([np.tan(3.9 * q[0]) - 8.0])

    found = find_determined_equilibrium(
        EquilibriumProblem(required_efforts, add_step, np.ones(1)), np.zeros(1), 1e-10
    )
    assert found[0] == pytest.approx(np.arctan(8.0) / 3.9, abs=1e-10)


def test_a_stiffness_of_rounding_is_undetermined_and_a_small_one_is_not() -> None:
    """A spring of 0.01 behind one of 1000, and a sum of squares that is one."""

    def required_efforts(q: Array) -> Array:
        turned = np.sin(q[0] + q[1])
        loose = np.sin(q[2] + 1.0) ** 2 + np.cos(q[2] + 1.0) ** 2 - 1.0
        return np.array([1e3 * turned + 1e-2 * q[0], 1e3 * turned, loose])

    with pytest.raises(UndeterminedEquilibriumError) as caught:
        find_determined_equilibrium(
            EquilibriumProblem(required_efforts, add_step, np.ones(3)),
            np.array([0.1, 0.2, 0.0]),
            1e-8,
        )
    assert caught.value.coordinate_indices == (2,)


@pytest.mark.parametrize("value", [1.0, np.nan])
def test_efforts_that_nothing_balances_are_left(value: float) -> None:
    with pytest.raises((EquilibriumNotFoundError, NumericalFailure)):
        find_determined_equilibrium(
            EquilibriumProblem(lambda _: np.array([value]), add_step, np.ones(1)),
            np.zeros(1),
            1e-10,
        )


def test_a_slack_valley_is_followed_to_its_bottom() -> None:
    """Stiffness of 1e-8 beside 1, which simple differences take for four times as much, or for none
    at all."""
    calls = []

    def required_efforts(q: Array) -> Array:
        calls.append(q)
        across, along = q[0] + q[1], q[0] - q[1]
        force = 1e-8 * along + 3 * along**3
        return np.array([across + force, across - force])

    found = find_determined_equilibrium(
        EquilibriumProblem(required_efforts, add_step, np.ones(2)), np.array([2e-4, 1e-4]), 1e-10
    )
    assert np.abs(found).max() < 1e-9
    assert len(calls) < 150
