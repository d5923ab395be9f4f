"""The motions that implicit methods are tried on, against closed forms, published figures of
others' formulations, and explicit methods."""

from __future__ import annotations

import numpy as np
import pytest

from mstmm.runtime.result.result import Result
from tests.support.implicit_methods import motions
from tests.support.implicit_methods.motions import KNOWN
from tests.support.models import looped_model

#: How far a number that is kept may be off, m.
ROUNDED = 3e-10


def explicit(scene: motions.Scene, t_end: float, tolerance: float = 1e-12) -> Result:
    found = looped_model(scene).simulate(
        t_end, method="dop853", rtol=tolerance, atol=tolerance, output_times=[t_end]
    )
    assert found.success, found.message
    return found


@pytest.mark.parametrize("name", KNOWN)
def test_places_are_those_of_an_explicit_run(name: str) -> None:
    case = KNOWN[name]
    found = explicit(case.scene, case.t_end).position(case.end)[-1]
    assert found == pytest.approx(case.place, abs=ROUNDED)


def test_double_pendulum_is_where_lagrange_in_absolute_angles_says() -> None:
    # Integrated elsewhere from M_ij cos(a_i - a_j), absolute angles and rates after 1 s.
    found = explicit(KNOWN["double pendulum"].scene, 1.0)
    assert np.cumsum(found.q[-1]) == pytest.approx([-2.77851256, -2.38518735], abs=1e-8)
    assert np.cumsum(found.u[-1]) == pytest.approx([-3.40651753, -0.51604547], abs=1e-8)


@pytest.mark.parametrize("k", [1e4, 1e6, 1e8])
def test_bushings_of_the_double_pendulum_are_as_stiff_as_meant(k: float) -> None:
    model = looped_model(motions.double_pendulum(k))
    slopes = np.asarray(model.derivatives(*model.initial_state()).q)
    fastest = np.sqrt(np.abs(np.linalg.eigvals(slopes)).max())
    # What stretches the two springs across the rods: heights and angles of two free rods.
    stretch = np.array([[1.0, -0.5, 0.0, 0.0], [-1.0, -0.5, 1.0, -0.5]])
    lightness = np.diag([1.0, 12.0, 1.0, 12.0])
    expected = np.sqrt(k * np.linalg.eigvalsh(stretch @ lightness @ stretch.T).max())
    assert fastest == pytest.approx(expected, rel=1e-3)


def test_moving_base_is_where_its_linear_equation_says() -> None:
    for zeta in (0.1, 1.0):
        scene = motions.moving_base(1e4, zeta)
        expected = motions.moving_base_stretch(1.0, 1e4, zeta)
        assert explicit(scene, 1.0).q[-1, 1] == pytest.approx(expected, rel=1e-8)
    early = motions.moving_base_stretch(0.02, 1e4, 0.1)
    assert explicit(motions.moving_base(1e4, 0.1), 0.02).q[-1, 1] == pytest.approx(early)


@pytest.mark.parametrize("count", [1, 5, 20])
def test_upright_chain_falls_at_its_rate(count: int) -> None:
    model = looped_model(motions.upright_chain(count, 0.0))
    slopes = np.asarray(model.derivatives(*model.initial_state()).q)
    rates = np.sqrt(np.sort(np.real(np.linalg.eigvals(slopes))))
    assert rates == pytest.approx(motions.chain_frequencies(count), rel=1e-8)


@pytest.mark.parametrize("weight", [0.0, 1e3, 1e5])
def test_hanging_chain_swings_at_its_frequencies(weight: float) -> None:
    model = looped_model(motions.hanging_chain(5, weight, angle=0.0))
    slopes = np.asarray(model.derivatives(*model.initial_state()).q)
    found = np.sqrt(np.sort(-np.real(np.linalg.eigvals(slopes))))
    assert found == pytest.approx(motions.chain_frequencies(5, weight), rel=1e-8)


def test_stop_throws_back_what_it_took() -> None:
    for t in (0.005, 0.011, 0.02):
        place, speed = motions.stop_motion(t)
        found = explicit(motions.stop(), t)
        assert found.q[-1, 0] == pytest.approx(place, abs=1e-9)
        assert found.u[-1, 0] == pytest.approx(speed, abs=1e-6)


@pytest.mark.parametrize("bending_stiffness", [5.0, 500.0])
def test_beam_pendulum_has_the_frequency_that_limits_explicit_steps(
    bending_stiffness: float,
) -> None:
    # Rows of the pin and of three sines of the chord: M of a uniform bar with int x sin, int sin^2.
    model = looped_model(motions.beam_pendulum(bending_stiffness))
    slopes = np.asarray(model.derivatives(*model.initial_state()).q)
    found = np.sqrt(np.abs(np.linalg.eigvals(slopes)).max())
    k = np.arange(1, 4)
    mass = np.eye(4)
    mass[0, 0] = 1 / 3
    mass[0, 1:] = mass[1:, 0] = -np.sqrt(2) * (-1.0) ** k / (k * np.pi)
    stiffness = np.diag([0.0, *(bending_stiffness * (k * np.pi) ** 4)])
    expected = np.sqrt(np.real(np.linalg.eigvals(np.linalg.solve(mass, stiffness))).max())
    assert found == pytest.approx(expected, rel=1e-6)
