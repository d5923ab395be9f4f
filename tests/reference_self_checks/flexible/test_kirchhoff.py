"""The exact rod of the references against closed forms and against an energy of its own."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.optimize
from numpy.polynomial import legendre
from scipy.special import ellipeinc, ellipkinc

from tests.reference.flexible import kirchhoff
from tests.reference.flexible.closed_forms import SELF_WEIGHT_BUCKLING
from tests.reference.flexible.kirchhoff import Load, Rod, Vector, solve
from tests.reference.flexible.rod_energy import Ritz

Array = kirchhoff.Array

#: A section 4 : 1 with Poisson's ratio 0.3, and a load at 45 degrees to its axes.
FLAT = Rod((1.0, 16.0), kirchhoff.rectangle(4.0, 0.3))
AT_45: Vector = (0.0, 0.5**0.5, 0.5**0.5)


def elastica(force: float) -> tuple[float, float]:
    """Shortening and deflection of the tip by elliptic integrals (Bisshopp and Drucker 1945)."""

    def excess(m: float) -> float:
        return float(ellipkinc(np.pi / 2, m) - ellipkinc(np.arcsin((2 * m) ** -0.5), m) - alpha)

    alpha = force**0.5
    m = float(scipy.optimize.brentq(excess, 0.5, 1 - 1e-9, xtol=1e-15))
    start = np.arcsin((2 * m) ** -0.5)
    across = 1 - 2 / alpha * (ellipeinc(np.pi / 2, m) - ellipeinc(start, m))
    return 2 * m**0.5 / alpha * np.cos(start) - 1, float(across)


@pytest.mark.parametrize("force", (0.2, 1.0, 4.0))
def test_planar_elastica(force: float) -> None:
    u, v = elastica(force)
    assert solve(Rod((7.0, 1.0), 0.3), Load((0.0, force, 0.0))).tip == pytest.approx(
        [u, v, 0.0], abs=1e-10
    )
    assert solve(Rod((1.0, 7.0), 0.3), Load((0.0, 0.0, force))).tip == pytest.approx(
        [u, 0.0, v], abs=1e-10
    )


def test_printed_elastica() -> None:
    """The table of Bisshopp and Drucker for P L^2 = EI."""
    assert elastica(1.0) == pytest.approx((0.94357 - 1, 0.30172), abs=6e-6)


@pytest.mark.parametrize("follower", (False, True))
def test_helix_under_end_moment(follower: bool) -> None:
    """Round section: R(s) = exp(s [m]/EI) exp(s (1/GJ - 1/EI) m_t [e_x]), the axis a helix."""
    EI, GJ, L, m = 2.0, 0.7, 1.3, np.array([0.8, 1.1, -2.0])
    n, size = m / np.linalg.norm(m), np.linalg.norm(m) / EI
    N, e = kirchhoff.cross(n), np.array([1.0, 0.0, 0.0])

    def turn(axis: Array, angle: float) -> Array:
        return np.eye(3) + np.sin(angle) * axis + (1 - np.cos(angle)) * axis @ axis

    attitude = turn(N, float(L * size)) @ turn(kirchhoff.cross(e), L * (1 / GJ - 1 / EI) * m[0])
    a = L * size
    along = L * e + (1 - np.cos(a)) / size * N @ e + (L - np.sin(a) / size) * N @ N @ e
    moment = attitude.T @ m if follower else m
    state = solve(Rod((EI, EI), GJ, L), Load(moment=(*moment,), follower=follower))
    assert state.attitude == pytest.approx(attitude, abs=1e-10)
    assert state.end[:3] == pytest.approx(along, abs=1e-10)
    assert state.twist == pytest.approx(m[0] * L / GJ, abs=1e-10)


def test_small_deflections_superpose() -> None:
    rod, force, moment = Rod((1.0, 16.0), 1.3, 2.0), (0.0, 3e-6, 2e-6), (4e-6, 5e-6, 6e-6)
    state = solve(rod, Load(force, moment))
    bent = (3e-6 * 8 / 48 + 6e-6 * 4 / 32, 2e-6 * 8 / 3 - 5e-6 * 4 / 2)
    turned = (4e-6 * 2 / 1.3, 5e-6 * 2 - 2e-6 * 4 / 2, 6e-6 * 2 / 16 + 3e-6 * 4 / 32)
    assert state.tip[1:] == pytest.approx(bent, rel=1e-4)
    assert state.rotation == pytest.approx(turned, rel=1e-4)


def test_twist_of_second_order() -> None:
    """GJ psi' = int (1/EI_z - 1/EI_y) M_y M_z ds from x to the tip: the work of the moments."""
    rod, y, z = Rod((1.0, 16.0), 1.3, 2.0), 3e-3, 2e-3
    state = solve(rod, Load((0.0, y, z)))
    expected = -y * z * 2.0**4 * (1 - 1 / 16) / (12 * 1.3)
    assert state.twist == pytest.approx(expected, rel=1e-4)
    assert state.rotation[0] == pytest.approx(expected, rel=1e-4)


def test_first_integrals_and_balance() -> None:
    """Along a uniform rod without load per length m.u/2 + n.t, m.n and m + r x n are constant."""
    state = solve(FLAT, Load((0.3, 1.5, 2.0), (0.4, -0.2, 0.3)))
    y = state.states_at(np.linspace(0.0, 1.0, 9))
    r, R, n, m = y[:, :3], y[:, 3:12].reshape(-1, 3, 3), y[:, 12:15], y[:, 15:18]
    own = np.einsum("pij,pi->pj", R, m)
    hamiltonian = 0.5 * (own**2 @ FLAT.compliance) + (n * R[:, :, 0]).sum(1)
    for constant in (hamiltonian, (m * n).sum(1), m + np.cross(r, n)):
        assert np.ptp(constant, axis=0) == pytest.approx(0.0, abs=1e-10)
    assert np.einsum("pij,pik->pjk", R, R) == pytest.approx(
        np.tile(np.eye(3), (9, 1, 1)), abs=1e-10
    )


@pytest.mark.parametrize("follower", (False, True))
def test_loads_on_an_arm_and_along_the_axis(follower: bool) -> None:
    """Moments about the root, whatever the shape."""
    load = Load((0.2, 0.5, -0.7), (0.1, 0.3, -0.2), (0.0, -0.4, 0.8), (0.05, 0.1, -0.2), follower)
    state = solve(FLAT, load)
    force, moment = state.end[12:15], state.end[15:18]
    turn = state.attitude if follower else np.eye(3)
    assert force == pytest.approx(turn @ load.force, abs=1e-10)
    lever = np.cross(state.attitude @ np.array(load.arm), force)
    assert moment == pytest.approx(turn @ load.moment + lever, abs=1e-10)
    assert state.root[:3] == pytest.approx(force + load.per_length, abs=1e-10)
    x, w = legendre.leggauss(12)
    axis = state.states_at((x + 1) / 2)[:, :3]
    spread = np.cross(w / 2 @ axis, load.per_length)
    expected = moment + np.cross(state.end[:3], force) + spread
    assert state.root[3:] == pytest.approx(expected, abs=1e-10)


def test_work_and_reciprocity() -> None:
    """Strain energy is the work of the load, and the tip's compliance to forces is symmetric."""
    states = [solve(FLAT, Load(AT_45) * p) for p in (1.0 - 1e-3, 1.0, 1.0 + 1e-3)]
    below, state, above = states
    work = (above.tip - below.tip) @ np.array(AT_45)
    assert above.energy - below.energy == pytest.approx(work, rel=1e-6)
    compliance = state.compliance()
    assert compliance[:3, :3] == pytest.approx(compliance[:3, :3].T, abs=1e-12)
    moved = (above.tip - below.tip) / 2e-3
    assert compliance[:3, :3] @ np.array(AT_45) == pytest.approx(moved, abs=1e-6)


@pytest.mark.parametrize("force", (0.25, 1.5))
def test_load_at_45_degrees_by_energy(force: float) -> None:
    """Twist couples the planes: against a potential energy that shares no formula with the rod."""
    whole, energy = force * np.array(AT_45), Ritz(1 / FLAT.compliance, 1.0, 9)
    a = energy.equilibrium(whole, np.full(energy.size, 1e-3))
    state = solve(FLAT, Load(AT_45) * force)
    assert state.end[:3] == pytest.approx(energy.tip(a), abs=1e-9)
    assert state.rotation == pytest.approx(energy.rotation(a), abs=1e-8)
    assert state.energy - whole @ state.end[:3] == pytest.approx(energy.potential(a, whole))
    uncoupled = [solve(FLAT, Load(v)).tip for v in ((0, force / 2**0.5, 0), (0, 0, force / 2**0.5))]
    assert state.tip[1] > 1.01 * uncoupled[0][1]


def test_columns() -> None:
    """Euler's column and Greenhill's, in the weak plane: one direction of falling energy more."""
    euler = np.pi**2 / 4
    for factor, number in ((0.999, 0), (1.001, 1)):
        tip = solve(FLAT, Load((-factor * euler, 0.0, 0.0)))
        own = solve(FLAT, Load(per_length=(-factor * SELF_WEIGHT_BUCKLING, 0.0, 0.0)))
        assert tip.buckled_directions() == own.buckled_directions() == number


def test_vibration_at_rest() -> None:
    rod = Rod((1.0, 4.0), 0.6, mass=2.0, polar=0.05)
    state = solve(rod, Load())
    bending, torsion = 1.875104068711961**2 / 2**0.5, np.pi / 2 * (0.6 / 0.05) ** 0.5
    expected = [bending, 2 * bending, torsion]
    assert state.frequencies(2.0, 6.0, 0.45) == pytest.approx(expected, rel=1e-9)
