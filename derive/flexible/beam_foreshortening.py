"""Beam: second-order displacements and rotations of its fields.

Modal coordinates measure strain: theta' and eps are those of the bent and twisted rod, not only of
its linear part, so that the strain energy is 1/2 eta^T K eta to third order and the whole geometric
stiffness is in the kinematics.  A section at r is rotated by exp(Psi~),

    T(Psi) Psi' = theta',    r' = exp(Psi~) (e_x + eps)
    theta = (psi, -psi_w, psi_v),    eps = (s', v' - psi_v, w' - psi_w)

(strains in the section's axes; without shear psi_v = v', psi_w = w', and the axis stays normal to
its sections).  To second order Psi = theta + Psi2, r = r0 + (s, v, w) + u2.  Psi2 results from the
non-commutativity of finite rotations: bending in two planes causes twist, bending and twist
together cause bending.  u2 contains the foreshortening of the bent axis, and the deflection of a
bent beam whose sections are twisted: the work of a load on it is that of its bending moments on
twist times curvature, which causes lateral buckling of a narrow beam.

All arrays are the coefficients g of -1/2 eta^T g eta.  Both fields are determined up to a rigid
motion of second order, which is the choice of the floating frame.
"""

from __future__ import annotations

import sympy as sp

from ..definition.derivation import Derivation, Equation, Quantity, vector
from ..definition.notation import Matrix
from .beam_fields import (
    INERTIA,
    POSITION,
    column_entries,
    integrate_mass,
    section_displacement,
    undeformed_position,
)

SOURCES = (
    "Kirchhoff's rod: Love, A Treatise on the Mathematical Theory of Elasticity, ch. 18",
    "rod with shear: Simo, A finite strain beam formulation, CMAME 49 (1985)",
    "Schwertassek, Wallrapp, Dynamik flexibler Mehrkoerpersysteme (second-order displacements)",
)

_SIZE, _ETA_K, _ETA_L = sp.symbols("size eta_k eta_l", real=True)


def _quantity_pair(name: str, rows: int, meaning: str) -> tuple[Quantity, Quantity]:
    """Same quantity for shapes k and l."""
    quantity_k, quantity_l = (
        Quantity(vector(f"{name}_{i}", rows), "", f"{meaning}, shape {i}") for i in "kl"
    )
    return quantity_k, quantity_l


SECTION_ROTATION = _quantity_pair("theta", 3, "rotation vector psi, -psi_w, psi_v of the section")
CURVATURE = _quantity_pair("kappa", 3, "twist and curvature psi', -psi_w', psi_v'")
STRAIN = _quantity_pair("eps", 3, "strain of the axis s', v' - psi_v, w' - psi_w")
INERTIA_ROTATION = _quantity_pair("turn", 3, "rotation of the section that carries inertia")
SECOND_ROTATION = Quantity(
    vector("h", 3), "", "rotation of second order, -d^2 Psi2 / d eta_k d eta_l"
)
INERTIA_SECOND_ROTATION = Quantity(vector("h_turn", 3), "", "that part of h which carries inertia")
SECOND_DISPLACEMENT = Quantity(
    vector("g", 3), "", "displacement of second order, -d^2 u2 / d eta_k d eta_l"
)


def _weighted_sum(pair: tuple[Quantity, Quantity]) -> Matrix:
    """eta_k times the value of shape k and eta_l times that of shape l."""
    return Matrix(_ETA_K * column_entries(pair[0]) + _ETA_L * column_entries(pair[1]))


def _second_order_part(field: Matrix) -> Matrix:
    """Coefficient of the square of `size` in a field."""
    return Matrix(field.applyfunc(lambda e: sp.expand(e).coeff(_SIZE, 2)))


def _mixed_derivative(field: Matrix) -> Matrix:
    """-d^2 field / d eta_k d eta_l."""
    return Matrix(field.applyfunc(lambda e: -sp.expand(sp.diff(e, _ETA_K, _ETA_L))))


def _rotate_vector(psi: Matrix, vector_: Matrix) -> Matrix:
    """exp(psi~) of a vector, to second order in psi."""
    first_order = psi.cross(vector_)
    return Matrix(vector_ + first_order + psi.cross(first_order) / 2)


def second_rotation_rate() -> Matrix:
    """Psi2' from T(Psi) Psi' = theta', T(Psi) = 1 - Psi~/2 + ..."""
    theta, kappa = _weighted_sum(SECTION_ROTATION), _weighted_sum(CURVATURE)
    unknown = Matrix(sp.symbols("Psi2_x:3"))
    psi, rate = _SIZE * theta, _SIZE * kappa + _SIZE**2 * unknown
    residual = rate - psi.cross(rate) / 2 - _SIZE * kappa
    solution = sp.solve(list(_second_order_part(Matrix(residual))), list(unknown), dict=True)[0]
    return Matrix([solution[u] for u in unknown])


def second_displacement_rate(turned: Matrix) -> Matrix:
    """u2' from r' = exp(Psi~) (e_x + eps), with Psi2 given."""
    psi = _SIZE * _weighted_sum(SECTION_ROTATION) + _SIZE**2 * turned
    tangent = Matrix([1, 0, 0]) + _SIZE * _weighted_sum(STRAIN)
    return _second_order_part(_rotate_vector(psi, Matrix(tangent)))


def rotation_integrands() -> Derivation:
    """Rate along the beam of the second-order rotation of its sections."""
    rate = vector("dh", 3)
    return Derivation(
        "beam",
        "rate along the beam of the rotation of second order by two shapes",
        (*SECTION_ROTATION, *CURVATURE),
        (Quantity(rate, "", "dh / dx"),),
        (Equation("dh", rate, _mixed_derivative(second_rotation_rate())),),
        sources=SOURCES,
        notes=("Psi2' = theta x theta' / 2",),
    )


def displacement_integrands() -> Derivation:
    """Rate along the beam of the second-order displacement of its axis."""
    rate, eta = vector("dg", 3), _ETA_K * _ETA_L
    return Derivation(
        "beam",
        "rate along the beam of the displacement of second order by two shapes",
        (*SECTION_ROTATION, *STRAIN, SECOND_ROTATION),
        (Quantity(rate, "", "dg / dx"),),
        (
            Equation(
                "dg",
                rate,
                _mixed_derivative(
                    second_displacement_rate(Matrix(-eta * column_entries(SECOND_ROTATION)))
                ),
            ),
        ),
        sources=SOURCES,
        notes=("u2' = theta x eps + Psi2 x e_x + theta x (theta x e_x) / 2",),
    )


def second_moment_integrands() -> Derivation:
    """Integrands of G and X: moments of the second-order displacement of all points."""
    axis = Matrix(-_ETA_K * _ETA_L * column_entries(SECOND_DISPLACEMENT))
    second_rotation = Matrix(-_ETA_K * _ETA_L * column_entries(INERTIA_SECOND_ROTATION))
    theta, r = _weighted_sum(INERTIA_ROTATION), undeformed_position()
    section_offset = Matrix([0, r[1], r[2]])
    field = (
        section_displacement(axis, second_rotation) + theta.cross(theta.cross(section_offset)) / 2
    )
    first_moment, position_moment = vector("G", 3), sp.MatrixSymbol("X", 3, 3)
    second_displacement = _mixed_derivative(Matrix(field))
    return Derivation(
        "beam",
        "integrands per length of the moments of the displacement of second order",
        (POSITION, INERTIA, *INERTIA_ROTATION, SECOND_DISPLACEMENT, INERTIA_SECOND_ROTATION),
        (
            Quantity(first_moment, "", "int rho g dA"),
            Quantity(position_moment, "", "int rho r0 g^T dA"),
        ),
        (
            Equation("G", first_moment, integrate_mass(second_displacement)),
            Equation("X", position_moment, integrate_mass(Matrix(r * second_displacement.T))),
        ),
        sources=SOURCES,
        notes=(
            "u2 of a point = u2 of the axis + Psi2 x p + theta x (theta x p) / 2, p = (0, y, z)",
        ),
    )


#: Name -> derivation of the kernels of the second-order fields.
KERNELS = {
    "turning": rotation_integrands,
    "drawing": displacement_integrands,
    "second_moments": second_moment_integrands,
}
