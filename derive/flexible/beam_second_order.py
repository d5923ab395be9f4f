"""Euler-Bernoulli beam: second-order displacements and rotations of its fields.

Modal coordinates measure strain: s', psi', w'' and v'' are those of the bent and twisted rod and
not of its linear part alone, so that the strain energy is 1/2 eta^T K eta to third order and all
of the geometric stiffness is in the kinematics.  A section stands at r and is turned by exp(Psi~),

    T(Psi) Psi' = theta',    r' = (1 + s') exp(Psi~) e_x,    theta = (psi, -w', v')

(curvature and twist in the section's axes; the axis stays across its sections and is stretched by
s' alone).  To second order Psi = theta + Psi2, r = r0 + (s, v, w) + u2.  Psi2 is what finite
rotations do not commute by: bending in two planes twists, bending and twist together bend.  u2
holds the shortening of the bent axis, and the deflection of a bent beam whose sections are
twisted: the work of a load on it is that of its bending moments on twist times curvature, which
buckles a narrow beam sideways.

All arrays are the coefficients g of -1/2 eta^T g eta.  Both fields are fixed up to a rigid motion
of second order, which is the choice of the floating frame.
"""

from __future__ import annotations

import sympy as sp

from ..language.derivation import Derivation, Equation, Quantity, vector
from ..language.notation import Matrix
from .beam_fields import INERTIA, X, displacement, entries, over_mass, point

SOURCES = (
    "Kirchhoff's rod: Love, A Treatise on the Mathematical Theory of Elasticity, ch. 18",
    "Schwertassek, Wallrapp, Dynamik flexibler Mehrkoerpersysteme (second-order displacements)",
)

_SIZE, _ETA_K, _ETA_L = sp.symbols("size eta_k eta_l", real=True)


def _pair(name: str, rows: int, meaning: str) -> tuple[Quantity, Quantity]:
    """The same quantity of shapes k and l."""
    first, other = (
        Quantity(vector(f"{name}_{i}", rows), "", f"{meaning}, shape {i}") for i in "kl"
    )
    return first, other


TURN = _pair("theta", 3, "rotation vector psi, -w', v' of the section")
CURVATURE = _pair("kappa", 3, "twist and curvature psi', -w'', v''")
STRETCH = _pair("stretch", 1, "axial strain s'")
CARRIED = _pair("turn", 3, "rotation of the section that carries inertia")
ROTATION = Quantity(vector("h", 3), "", "rotation of second order, -d^2 Psi2 / d eta_k d eta_l")
CARRIED_ROTATION = Quantity(vector("h_turn", 3), "", "that part of h which carries inertia")
PLACE = Quantity(vector("g", 3), "", "displacement of second order, -d^2 u2 / d eta_k d eta_l")


def _both(pair: tuple[Quantity, Quantity]) -> Matrix:
    """eta_k times the value of shape k and eta_l times that of shape l."""
    return Matrix(_ETA_K * entries(pair[0]) + _ETA_L * entries(pair[1]))


def _second(field: Matrix) -> Matrix:
    """Coefficient of the square of `size` in a field."""
    return Matrix(field.applyfunc(lambda e: sp.expand(e).coeff(_SIZE, 2)))


def _by_shapes(field: Matrix) -> Matrix:
    """-d^2 field / d eta_k d eta_l."""
    return Matrix(field.applyfunc(lambda e: -sp.expand(sp.diff(e, _ETA_K, _ETA_L))))


def _turned(psi: Matrix, vector_: Matrix) -> Matrix:
    """exp(psi~) of a vector, to second order in psi."""
    once = psi.cross(vector_)
    return Matrix(vector_ + once + psi.cross(once) / 2)


def rotation_rate() -> Matrix:
    """Psi2' from T(Psi) Psi' = theta', T(Psi) = 1 - Psi~/2 + ..."""
    theta, kappa = _both(TURN), _both(CURVATURE)
    unknown = Matrix(sp.symbols("Psi2_x:3"))
    psi, rate = _SIZE * theta, _SIZE * kappa + _SIZE**2 * unknown
    twisted = rate - psi.cross(rate) / 2 - _SIZE * kappa
    solved = sp.solve(list(_second(Matrix(twisted))), list(unknown), dict=True)[0]
    return Matrix([solved[u] for u in unknown])


def displacement_rate(turned: Matrix) -> Matrix:
    """u2' from r' = (1 + s') exp(Psi~) e_x, with Psi2 given."""
    psi = _SIZE * _both(TURN) + _SIZE**2 * turned
    stretch = 1 + _SIZE * _both(STRETCH)[0]
    return _second(Matrix(stretch * _turned(psi, Matrix([1, 0, 0]))))


def turning() -> Derivation:
    """Rate along the beam of the second-order rotation of its sections."""
    rate = vector("dh", 3)
    return Derivation(
        "beam",
        "rate along the beam of the rotation of second order by two shapes",
        (*TURN, *CURVATURE),
        (Quantity(rate, "", "dh / dx"),),
        (Equation("dh", rate, _by_shapes(rotation_rate())),),
        sources=SOURCES,
        notes=("Psi2' = theta x theta' / 2",),
    )


def drawing() -> Derivation:
    """Rate along the beam of the second-order displacement of its axis."""
    rate, eta = vector("dg", 3), _ETA_K * _ETA_L
    return Derivation(
        "beam",
        "rate along the beam of the displacement of second order by two shapes",
        (*TURN, *STRETCH, ROTATION),
        (Quantity(rate, "", "dg / dx"),),
        (Equation("dg", rate, _by_shapes(displacement_rate(Matrix(-eta * entries(ROTATION))))),),
        sources=SOURCES,
        notes=("u2' = s' theta x e_x + Psi2 x e_x + theta x (theta x e_x) / 2",),
    )


def moments() -> Derivation:
    """Integrands of G and X: moments of the second-order displacement of all points."""
    axis = Matrix(-_ETA_K * _ETA_L * entries(PLACE))
    turned = Matrix(-_ETA_K * _ETA_L * entries(CARRIED_ROTATION))
    theta, r = _both(CARRIED), point()
    off = Matrix([0, r[1], r[2]])
    field = displacement(axis, turned) + theta.cross(theta.cross(off)) / 2
    first, lever = vector("G", 3), sp.MatrixSymbol("X", 3, 3)
    second = _by_shapes(Matrix(field))
    return Derivation(
        "beam",
        "integrands per length of the moments of the displacement of second order",
        (X, INERTIA, *CARRIED, PLACE, CARRIED_ROTATION),
        (
            Quantity(first, "", "int rho g dA"),
            Quantity(lever, "", "int rho r0 g^T dA"),
        ),
        (
            Equation("G", first, over_mass(second)),
            Equation("X", lever, over_mass(Matrix(r * second.T))),
        ),
        sources=SOURCES,
        notes=(
            "u2 of a point = u2 of the axis + Psi2 x p + theta x (theta x p) / 2, p = (0, y, z)",
        ),
    )


#: Name -> derivation of the kernels of the second-order fields.
KERNELS = {"turning": turning, "drawing": drawing, "second_moments": moments}
