"""Geometric stiffening of a solid bar against that of beams.

Poisson's ratio is zero here: the clamped sections of the solid then stand for those of the beam.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy import linalg, optimize

from mstmm.runtime.flexible.modal_body import ModalBody
from tests.support.scenes import elastic_bar as bar


def straight(frame: str = "tangent", modes: int = 8) -> ModalBody:
    return bar.body(bar.table(poisson=0.0, frame=frame, modes=modes))


def bending(found: ModalBody, direction: int) -> list[int]:
    """Modes in which the tip moves along one direction."""
    tip = np.abs(found.ports["tip"].phi)
    return [k for k in range(found.n) if tip[direction, k] > 0.5 * tip[:, k].sum() > 0]


def test_unit_loads_of_the_clamped_bar() -> None:
    """int rho g, int rho x g and g at the tip of the first clamped-free shape; g >= 0 means that
    the tip comes nearer, so that a pull at the tip stiffens."""
    found = straight()
    line = bar.MASS / bar.LENGTH
    assert found.G[0, 0, 0] / line == pytest.approx(1.5709, rel=1e-4)
    assert found.X[0, 0, 0, 0] / line == pytest.approx(1.1933, rel=1e-4)
    assert found.ports["tip"].second_order[0, 0, 0] == pytest.approx(4.6478, rel=1e-4)
    assert not found.ports["root"].second_order.any()


def test_shortening_follows_from_the_slope() -> None:
    """1/2 eta^2 g of the tip is how much nearer the ends are when the axis keeps its length."""
    found = bar.reduction(0.0, 4)
    nodes = found.sections.model.nodes
    axis = np.flatnonzero(np.hypot(nodes[:, 1], nodes[:, 2]) < 1e-12)
    axis = axis[np.argsort(nodes[axis, 0])]
    deflection = found.sections.model.components(found.shapes)[2, axis, 0]
    slope = np.gradient(deflection, nodes[axis, 0], edge_order=2)
    shorter = np.trapezoid(slope**2, nodes[axis, 0])
    assert straight(modes=4).ports["tip"].second_order[0, 0, 0] == pytest.approx(shorter, rel=3e-3)


@pytest.mark.parametrize(("direction", "stiffness"), [(2, bar.EI_Z), (1, bar.EI_Y)])
def test_column_buckles_at_eulers_load(direction: int, stiffness: float) -> None:
    """Clamped-free, dead tip load: pi^2 / 4 EI / L^2, in either plane."""
    found = straight()
    plane = bending(found, direction)
    shortening = found.ports["tip"].second_order[0][np.ix_(plane, plane)]
    loads = linalg.eigvalsh(found.K[np.ix_(plane, plane)], shortening)
    assert loads[0] == pytest.approx(np.pi**2 / 4 * stiffness, rel=2e-3)


def test_column_buckles_under_its_own_weight() -> None:
    """rho A g L^3 / EI = 7.8373; an acceleration of the frame along +x adds -G."""
    found = straight()
    weights = linalg.eigvals(found.K, found.G[0]).real
    critical = weights[weights > 0].min() * bar.MASS / bar.EI_Z
    assert critical == pytest.approx(7.8373, rel=2e-3)


@pytest.mark.parametrize(("spin", "flap", "lag"), [(1, 3.6816, 3.5433), (3, 4.7973, 3.7435)])
def test_rotating_bar(spin: float, flap: float, lag: float) -> None:
    """Dimensionless first frequencies of a clamped beam turning about z, hub radius 0."""
    found = straight()
    for direction, stiffness, expected in ((2, bar.EI_Z, flap), (1, bar.EI_Y, lag)):
        unit = np.sqrt(stiffness / (bar.MASS * bar.LENGTH**3))
        rate = (spin * unit) ** 2
        carried = found.X[0, 0] + found.X[1, 1] - found.F[0, 0] - found.F[1, 1]
        plane = bending(found, direction)
        stiff = (found.K + rate * carried)[np.ix_(plane, plane)]
        squares = linalg.eigvalsh(stiff, found.Mff[np.ix_(plane, plane)])
        assert np.sqrt(squares[0]) / unit == pytest.approx(expected, rel=2e-3)


def test_free_bar_under_end_thrust() -> None:
    """Two frequencies of a free beam pushed at its end meet at 109.8 EI / L^2 (mean frame): the
    loads are taken with the acceleration that they cause, and the thrust turns with the tip."""
    found = straight("mean", modes=12)
    assert not found.G.any()
    tip = found.ports["tip"]
    plane = bending(found, 2)
    turned = np.cross(tip.theta.T, [1.0, 0, 0]).T
    follower = (tip.phi.T @ turned)[np.ix_(plane, plane)]
    K, M = found.K[np.ix_(plane, plane)], found.Mff[np.ix_(plane, plane)]
    shortening = tip.second_order[0][np.ix_(plane, plane)]

    def flutters(thrust: float) -> float:
        load = thrust * bar.EI_Z / bar.LENGTH**2
        squares = linalg.eigvals(K - load * (shortening - follower), M)
        lowest = squares[np.argsort(squares.real)][:2]
        return 1.0 if np.abs(lowest.imag).max() > 1e-6 * np.abs(lowest).max() else -1.0

    assert optimize.bisect(flutters, 100.0, 120.0, xtol=1e-3) == pytest.approx(109.8, rel=3e-3)


def test_off() -> None:
    found = bar.body(bar.table(stiffening=False))
    assert not found.G.any()
    assert not found.X.any()
    assert not found.ports["tip"].second_order.any()
