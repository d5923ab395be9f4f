"""The references for lateral buckling against closed forms and against each other."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.reference.flexible import lateral
from tests.reference.flexible.kirchhoff import Load, Rod, lateral_bifurcation, rectangle, solve
from tests.reference.flexible.lateral import (
    Beam,
    critical,
    end_force,
    end_moment,
    flutter,
    lowest_rate,
    prandtl,
    squares,
)
from tests.reference.flexible.rod_energy import Ritz

DOWN = Load((0.0, -1.0, 0.0))


@pytest.mark.parametrize("beam", (Beam(), Beam(2.0, 0.3, 1.7)))
def test_buckling_loads_of_the_books(beam: Beam) -> None:
    """Prandtl's load by Bessel's function; Timoshenko and Gere's for a load per length; for forks
    under equal moments pi; for a couple of dead forces pi/2, for a semi-tangential one pi."""
    L, scale = beam.length, beam.scale
    assert prandtl() == pytest.approx(4.0126, abs=5e-5)
    assert critical(beam, end_force(L)) * L**2 / scale == pytest.approx(prandtl(), rel=1e-12)
    spread = critical(beam, lateral.spread_force(L)) * L**3 / scale
    assert spread == pytest.approx(12.85, abs=5e-3)
    forks = Beam(beam.bending, beam.torsion, L, forks=True)
    assert critical(forks, end_moment("forces along y")) * L / scale == pytest.approx(np.pi)
    for kind, turns in (("forces along y", 1), ("forces along x", 1), ("semi-tangential", 2)):
        found = critical(beam, end_moment(kind)) * L / scale
        assert found == pytest.approx(turns * np.pi / 2, rel=1e-12)
    assert {critical(beam, end_moment(kind)) for kind in ("dead", "follower")} == {np.inf}


def test_frequencies_without_load() -> None:
    beam = Beam(3.0, 0.5, 1.3, 2.0, 0.1)
    bending = np.array([1.875104068711961, 4.694091132974174]) ** 4 * 3.0 / (2.0 * 1.3**4)
    torsion = (np.pi / 2 / 1.3 * np.array([1, 3, 5])) ** 2 * 0.5 / 0.1
    expected = sorted([*bending, *torsion])[:5]
    assert squares(beam, end_force(1.3), 0.0, 5) == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("part", (0.5, 0.9, 2.0))
def test_lateral_frequency_by_the_rod(part: float) -> None:
    """A rod that hardly bends in its stiff plane; past the buckling load a growth rate."""
    beam, load = Beam(rotary=0.02), part * prandtl()
    rate = lowest_rate(beam, end_force(1.0), load)
    rod = Rod((1.0, 1e9), 1.0, polar=0.01, rotary=(0.02, 0.0))
    found = solve(rod, DOWN * load).frequencies(rate - 0.1, rate, 0.2, lateral=True)
    assert found == pytest.approx([rate], rel=1e-7)
    assert (rate < 0) == (part > 1)


@pytest.mark.parametrize("kind", ("dead", "follower"))
def test_moments_without_potential(kind: str) -> None:
    """They raise the first frequency, both by as much, until it meets the next one and is gone."""
    limit = flutter(Beam(), end_moment(kind), 3.0, 5.0)
    for load, number in ((1.5, 2), (0.995 * limit, 2), (1.005 * limit, 0)):
        rod = Rod((1.0, 1e9), 1.0, polar=0.01)
        state = solve(rod, Load(moment=(0.0, 0.0, load), follower=kind == "follower"))
        found = state.frequencies(3.5, 16.0, 0.5, lateral=True)
        assert len(found) == number
        if number:
            expected = squares(Beam(), end_moment(kind), load)[:2].real ** 0.5
            assert found == pytest.approx(expected, rel=1e-6)
            assert found[0] > 3.516


@pytest.mark.parametrize("height", (-0.1, 0.0, 0.1))
def test_buckling_load_by_the_rod(height: float) -> None:
    """Also with the load above the axis or below it."""
    load = Load((0.0, -1.0, 0.0), arm=(0.0, height, 0.0))
    rod = Rod((1.0, 1e9), 1.0)
    expected = critical(Beam(), end_force(1.0, height))
    assert lateral_bifurcation(rod, load, 3.0, 5.0) == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize(("ratio", "torsion"), ((1e4, 1.0), (16.0, rectangle(4.0, 0.3))))
def test_bending_before_buckling_raises_the_load(ratio: float, torsion: float) -> None:
    """The bent rod loses its least stiffness, by its potential energy, where the rod bifurcates."""
    rod = Rod((1.0, ratio), torsion)
    found = lateral_bifurcation(rod, DOWN, 3.5, 6.0)
    energy = Ritz(1 / rod.compliance, 1.0, 8)
    least = []
    for factor in (0.9995, 1.0005):
        force = np.array([0.0, -found * factor, 0.0])
        start = np.zeros((9, 3))
        start[:, 0], start[0, 2] = 1e-9, force[1] / (3 * ratio)
        # The start's hint of twist keeps x/sin x defined; the root lies in the plane.
        a = energy.equilibrium(force, start.ravel())
        least.append(np.linalg.eigvalsh(energy.hessian(a, force))[0])
    assert least[0] > 0 > least[1]
    assert 1.0 < found / (prandtl() * torsion**0.5) < 1 + 1.8 / ratio


def test_after_buckling() -> None:
    """At twice the load a thousandth of it across moves the tip by nearly half the length; without
    a hint the rod stands straight there, and falls at a touch."""
    rod, load = Rod((1.0, 1e4), 1.0), Load((0.0, -8.0, 0.008))
    aside = solve(rod, Load((0.0, -8.0, 2.0)), solve(rod, Load((0.0, 0.0, 2.0))))
    buckled = solve(rod, load, aside)
    assert buckled.tip == pytest.approx([-0.364963, -0.457903, 0.439936], abs=1e-6)
    assert buckled.buckled_directions() == 0
    assert solve(rod, load).buckled_directions() == 1
    energy, force = Ritz(1 / rod.compliance, 1.0, 16), np.array(load.force)
    attitudes = buckled.states_at(energy.places)[:, 3:12].reshape(-1, 3, 3)
    start = energy.fitted_coefficients(Rotation.from_matrix(attitudes).as_rotvec())
    a = energy.equilibrium(force, start)
    assert energy.tip(a) == pytest.approx(buckled.end[:3], abs=1e-10)
    assert np.linalg.eigvalsh(energy.hessian(a, force))[0] > 0
