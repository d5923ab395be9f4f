"""Planar rigid body, 7 x 7: Rui, Wang, Zhang, ch. 5, (5.18)."""

from __future__ import annotations

import sympy as sp

from ..definition.derivation import Derivation, Equation, Quantity, vector
from ..definition.notation import Perp
from .state_vector import BOOK, PLANAR, force_scale, transfer_matrix

MASS = sp.MatrixSymbol("M", 1, 1)
OUTPUT, CENTER = vector("r_IO", 2), vector("r_IC", 2)
INERTIA, OMEGA = sp.MatrixSymbol("J_I", 1, 1), sp.MatrixSymbol("omega", 1, 1)
FORCE, MOMENT = vector("f_C", 2), sp.MatrixSymbol("m_C", 1, 1)
TRANSFER = sp.MatrixSymbol("U", 7, 7)
SCALE = sp.MatrixSymbol("F_scale", 3, 3)

INPUTS = (
    Quantity(MASS, "kg", "mass"),
    Quantity(OUTPUT, "m", "output end O from input end I, inertial axes"),
    Quantity(CENTER, "m", "mass centre C from I, inertial axes"),
    Quantity(INERTIA, "kg*m2", "moment of inertia about I"),
    Quantity(OMEGA, "rad/s", "angular velocity"),
    Quantity(FORCE, "N", "external force at C, inertial axes"),
    Quantity(MOMENT, "N*m", "external moment"),
)
OUTPUTS = (
    Quantity(TRANSFER, PLANAR.unit, "transfer matrix, z_O = U z_I"),
    Quantity(SCALE, "kg*m, kg*m2; kg, kg*m", "magnitude of the terms of d(m, q)_O / d(rdd, wd)_I"),
)


def premises() -> tuple[Equation, ...]:
    """Geometry of the body, Newton's law for C and the moment about I, in the plane."""
    rdd_i, wd_i, m_i, q_i = PLANAR.end_blocks("I")
    rdd_o, wd_o, m_o, q_o = PLANAR.end_blocks("O")
    mass, speed, alpha = MASS[0, 0], OMEGA[0, 0], wd_i[0, 0]
    geometry = rdd_i + alpha * Perp(OUTPUT) - speed**2 * OUTPUT
    linear = mass * (rdd_i + alpha * Perp(CENTER) - speed**2 * CENTER)
    angular = INERTIA * wd_i + mass * Perp(CENTER).T * rdd_i
    force = q_i - q_o + FORCE
    moment = m_i - m_o - Perp(OUTPUT).T * q_o + Perp(CENTER).T * FORCE + MOMENT
    return (
        Equation("acceleration of the output end", rdd_o, geometry, "(5.10), (5.14)"),
        Equation("one rotation for the whole body", wd_o, wd_i, "(5.13)"),
        Equation("Newton, mass centre", linear, force, "(5.11)"),
        Equation("Euler, about the input end", angular, moment, "(5.12)"),
    )


def derivation(stated: tuple[Equation, ...] | None = None) -> Derivation:
    """z_O = U z_I, solved from `stated` (the premises, unless a check alters one)."""
    stated = stated or premises()
    transfer = transfer_matrix(stated, PLANAR)
    return Derivation(
        element="classical_body_planar",
        title="planar rigid body, classical transfer matrix",
        inputs=INPUTS,
        outputs=OUTPUTS,
        definitions=(
            Equation("transfer matrix", TRANSFER, transfer, "(5.18)"),
            Equation("scale of the force rows", SCALE, force_scale(transfer, PLANAR)),
        ),
        premises=stated,
        sources=(f"{BOOK}, (5.10) to (5.18)",),
        notes=(
            "State [rdd; thetadd; m; q; 1] in inertial axes; m, q of the inboard on the outboard.",
        ),
    )
