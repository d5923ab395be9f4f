"""Small lateral bending and torsion of a beam bent in its stiff plane (Prandtl, Michell 1899).

M(x) is the moment of the loads about z, which bends the beam in the plane x-y without curving it
(EI_z >> EI_y); w the deflection along z and psi the twist.  To second order its work on the
twisted curvature gives

    2 V = int EI w''^2 + GJ psi'^2 + 2 M psi w'' dx,   2 T = int mu w_t^2 + i w'_t^2 + j psi_t^2 dx,

with natural ends M psi + EI w'' = 0, (M psi + EI w'')' = 0, GJ psi' = 0.  Both unknowns are
polynomials of high order, so that the figures are exact to rounding.  (Timoshenko and Gere,
Theory of Elastic Stability, chapter 6; Simitses and Hodges, Fundamentals of Structural Stability.)
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.linalg
import scipy.optimize
from numpy.polynomial import legendre
from scipy.special import jv

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Beam:
    """EI for w, N m^2; GJ, N m^2; length, m; per length: mass mu, kg/m, polar inertia j of the
    section and its `rotary` inertia i about y, kg m.

    Clamped at x = 0, or with both ends in `forks` that hold w and psi and let w' go.
    """

    bending: float = 1.0
    torsion: float = 1.0
    length: float = 1.0
    mass: float = 1.0
    polar: float = 0.01
    rotary: float = 0.0
    forks: bool = False

    @property
    def scale(self) -> float:
        """sqrt(EI GJ), N m^2."""
        return float(np.sqrt(self.bending * self.torsion))


@dataclass(frozen=True)
class Bent:
    """`moment` M(x), N m, per unit of load; `tip` (2, 2) further stiffness for (w', psi) at x = L,
    symmetric where the load has a potential."""

    moment: Callable[[Array], Array]
    tip: tuple[tuple[float, float], tuple[float, float]] = ((0.0, 0.0), (0.0, 0.0))


def end_force(length: float, height: float = 0.0) -> Bent:
    """A dead force along -y at the tip, `height` above the axis: it sinks by height psi^2 / 2."""
    return Bent(lambda x: x - length, ((0.0, 0.0), (0.0, -height)))


def spread_force(length: float) -> Bent:
    """A dead force along -y, 1 N/m, on the axis."""
    return Bent(lambda x: -((length - x) ** 2) / 2)


#: The further moment against w' by psi, and against psi by w', per unit of moment about z: what
#: each does when the tip turns, less what dead forces along y do.
MOMENTS = {
    "forces along y": (0.0, 0.0),
    "forces along x": (-1.0, -1.0),
    "semi-tangential": (-0.5, -0.5),
    "dead": (0.0, -1.0),
    "follower": (-1.0, 0.0),
}


def end_moment(kind: str) -> Bent:
    """A moment about z at the tip: a couple of dead forces along y on rigid arms along x, of dead
    forces along x on arms along y, half of each, a moment of fixed direction, or one that turns
    with the section.  The last two have no potential."""
    slope, twist = MOMENTS[kind]
    return Bent(np.ones_like, ((0.0, slope), (twist, 0.0)))


def matrices(beam: Beam, bent: Bent, order: int = 16) -> tuple[Array, Array, Array]:
    """Stiffness, its change per unit of load, and mass; `order` polynomials for w and psi each."""
    z, weight = legendre.leggauss(order + 8)
    x, weight = beam.length * (z + 1) / 2, beam.length * weight / 2
    free = legendre.Legendre.basis
    s = legendre.Legendre([0.5, 0.5])  # x / L
    hold_w, hold_psi = (s * (1 - s),) * 2 if beam.forks else (s * s, s)
    w = [hold_w * free(k) for k in range(order)]
    psi = [hold_psi * free(k) for k in range(order)]
    rate = 2 / beam.length
    values, twists = (np.array([p(z) for p in rows]) for rows in (w, psi))
    slopes = np.array([p.deriv(1)(z) for p in w]) * rate
    curvatures = np.array([p.deriv(2)(z) for p in w]) * rate**2
    twisting = np.array([p.deriv(1)(z) for p in psi]) * rate
    coupled = curvatures @ ((weight * bent.moment(x))[:, None] * twists.T)
    tips = scipy.linalg.block_diag([p.deriv(1)(1.0) * rate for p in w], [p(1.0) for p in psi])
    zero = np.zeros((order, order))
    stiffness = scipy.linalg.block_diag(
        beam.bending * (curvatures * weight) @ curvatures.T,
        beam.torsion * (twisting * weight) @ twisting.T,
    )
    change = np.block([[zero, coupled], [coupled.T, zero]]) + tips.T @ np.array(bent.tip) @ tips
    mass = scipy.linalg.block_diag(
        beam.mass * (values * weight) @ values.T + beam.rotary * (slopes * weight) @ slopes.T,
        beam.polar * (twists * weight) @ twists.T,
    )
    return stiffness, change, mass


def squares(beam: Beam, bent: Bent, load: float, count: int = 4) -> npt.NDArray[np.complex128]:
    """Lowest squares (by modulus of what is shifted) of the lateral natural frequencies, rad^2/s^2,
    under `load`; negative: growth, a pair of complex ones: flutter."""
    stiffness, change, mass = matrices(beam, bent)
    loaded, shift = stiffness + load * change, 0.0
    while np.linalg.eigvalsh(loaded + loaded.T + 2 * shift * mass)[0] <= 0:
        shift = max(2 * shift, beam.bending / (beam.mass * beam.length**4))
    # The largest reciprocals, so that the stiff shapes leave no rounding on the lowest.
    reciprocal = np.linalg.eigvals(np.linalg.solve(loaded + shift * mass, mass)).astype(complex)
    return np.sort_complex(1 / reciprocal[np.argsort(-np.abs(reciprocal))[:count]] - shift)


def lowest_rate(beam: Beam, bent: Bent, load: float) -> float:
    """First frequency, rad/s, of a load with a potential; a rate of growth, 1/s, as negative."""
    square = squares(beam, bent, load)[0]
    assert abs(square.imag) < 1e-9 * abs(square), square
    return float(np.sign(square.real) * abs(square.real) ** 0.5)


def critical(beam: Beam, bent: Bent) -> float:
    """Smallest positive load at which the beam stands still in a lateral shape; inf for none."""
    stiffness, change, _ = matrices(beam, bent)
    reciprocal = np.linalg.eigvals(np.linalg.solve(stiffness, -change))
    real = reciprocal.real[np.abs(reciprocal.imag) < 1e-9]
    return float(1 / real.max()) if real.max(initial=0.0) > 1e-6 else float(np.inf)


def flutter(beam: Beam, bent: Bent, low: float, high: float) -> float:
    """Load between `low` and `high` from which a pair of frequencies is complex."""
    while high - low > 1e-10 * high:
        middle = (low + high) / 2
        found = squares(beam, bent, middle)
        steady = np.abs(found.imag).max() < 1e-6 * np.abs(found).max()
        low, high = (middle, high) if steady else (low, middle)
    return high


def prandtl() -> float:
    """P L^2 / sqrt(EI GJ) at which a cantilever with a load at its end buckles.

    psi'' + (P (L - x))^2 / (EI GJ) psi = 0 with psi(0) = 0, psi'(L) = 0 is solved by
    sqrt(u) J_{-1/4}(P u^2 / (2 sqrt(EI GJ))), u = L - x.
    """
    return float(2 * scipy.optimize.brentq(lambda z: jv(-0.25, z), 1.5, 2.5, xtol=1e-15))
