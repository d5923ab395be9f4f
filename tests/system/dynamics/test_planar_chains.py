"""Planar chains of any length and mass ratio against Lagrange's equations in extended precision."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from tests.reference import newton_euler as dense
from tests.reference import planar_chain
from tests.reference.compare import worst
from tests.reference.jets import Array
from tests.reference.random_scenes import random_state


def error(
    masses: Array, rng: np.random.Generator, radius: float = 1 / 12, orientation: Any = (0, 0, 0)
) -> float:
    """Relative error at a random state; moment of inertia of every rod = radius * mass."""
    n = len(masses)
    q, u = rng.uniform(-1, 1, n), rng.uniform(-1, 1, n)
    scene = planar_chain.scene(masses, radius * masses, orientation)
    expected = planar_chain.accelerations(masses, radius * masses, q, u)
    return worst(mstmm.compile(mstmm.Scene(**scene)).accelerations(q, u), expected)


@pytest.mark.parametrize("n", [1, 2, 7, 60])
def test_lagrange_agrees_with_the_dense_equations(n: int, rng: np.random.Generator) -> None:
    masses = rng.uniform(0.5, 2.0, n)
    scene = planar_chain.scene(masses, masses / 12)
    q, u = random_state(scene, 3)
    expected = planar_chain.accelerations(masses, masses / 12, q, u)
    assert worst(dense.solve(scene, q, u).udot, expected) < 1e-12


@pytest.mark.parametrize("n", [3, 30, 300, pytest.param(1000, marks=pytest.mark.soak)])
def test_any_length(n: int, rng: np.random.Generator) -> None:
    assert error(np.ones(n), rng) < 2e-13


def test_oblique_plane(rng: np.random.Generator) -> None:
    assert error(np.ones(800), rng, orientation=(0.3, 0.5, 0.7)) < 2e-13


@pytest.mark.parametrize("power", [0, 2, 4, 6, 8])
def test_heavy_tip_loses_digits_in_proportion(power: int, rng: np.random.Generator) -> None:
    masses = np.ones(8)
    masses[-1] = 10.0**power
    assert error(masses, rng) < 1e-14 + 4e-15 * 10.0**power


@pytest.mark.parametrize("power", [4, 8])
def test_heavy_root_loses_none(power: int, rng: np.random.Generator) -> None:
    masses = np.ones(8)
    masses[0] = 10.0**power
    assert error(masses, rng) < 2e-14


def test_masses_falling_over_eleven_decades(rng: np.random.Generator) -> None:
    assert error(10.0 ** -np.arange(12.0), rng) < 2e-14


def test_percussion_centres_are_no_special_place(rng: np.random.Generator) -> None:
    """J_C = M r_IC (r_IO - r_IC): the pivot of the plain product vanishes."""
    assert error(np.ones(6), rng, radius=1 / 4) < 1e-13
