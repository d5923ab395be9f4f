"""Spatial rigid body, 13 x 13: Rui, Wang, Zhang, ch. 5, (5.27)."""

from __future__ import annotations

import sympy as sp

from ..definition.derivation import Derivation, Equation, Quantity, tilde, vector
from ..definition.notation import Tilde, explicit
from .state_vector import BOOK, SPATIAL, force_scale, transfer_matrix

MASS = sp.MatrixSymbol("M", 1, 1)
OUTPUT, CENTER = vector("r_IO", 3), vector("r_IC", 3)
INERTIA = sp.MatrixSymbol("J_I", 3, 3)
OMEGA, FORCE, MOMENT = vector("omega", 3), vector("f_C", 3), vector("m_C", 3)
TRANSFER = sp.MatrixSymbol("U", 13, 13)
SCALE = sp.MatrixSymbol("F_scale", 6, 6)

INPUTS = (
    Quantity(MASS, "kg", "mass"),
    Quantity(OUTPUT, "m", "output end O from input end I, inertial axes"),
    Quantity(CENTER, "m", "mass centre C from I, inertial axes"),
    Quantity(INERTIA, "kg*m2", "inertia tensor about I, inertial axes", symmetric=True),
    Quantity(OMEGA, "rad/s", "angular velocity, inertial axes"),
    Quantity(FORCE, "N", "external force at C, inertial axes"),
    Quantity(MOMENT, "N*m", "external moment, inertial axes"),
)
OUTPUTS = (
    Quantity(TRANSFER, SPATIAL.unit, "transfer matrix, z_O = U z_I"),
    Quantity(SCALE, "kg*m, kg*m2; kg, kg*m", "magnitude of the terms of d(m, q)_O / d(rdd, wd)_I"),
)

#: Velocity-dependent vectors, named so that the matrix stays short.
B_OUTPUT, B_CENTER, GYRATION = vector("b_O", 3), vector("b_C", 3), vector("h_I", 3)


def bias_definitions() -> tuple[Equation, ...]:
    """Centripetal accelerations of O and C relative to I, and the gyroscopic moment."""
    spin = tilde(OMEGA)
    rows = (
        ("centripetal acceleration of O", B_OUTPUT, spin * (spin * explicit(OUTPUT))),
        ("centripetal acceleration of C", B_CENTER, spin * (spin * explicit(CENTER))),
        ("gyroscopic moment", GYRATION, spin * (explicit(INERTIA) * explicit(OMEGA))),
    )
    return tuple(Equation(name, symbol, value) for name, symbol, value in rows)


def premises() -> tuple[Equation, ...]:
    """Geometry of the body, Newton's law for C and Euler's law about I."""
    rdd_i, wd_i, m_i, q_i = SPATIAL.end_blocks("I")
    rdd_o, wd_o, m_o, q_o = SPATIAL.end_blocks("O")
    mass = MASS[0, 0]
    rdd_c = rdd_i - Tilde(CENTER) * wd_i + B_CENTER
    geometry = rdd_i - Tilde(OUTPUT) * wd_i + B_OUTPUT
    linear = mass * rdd_c
    angular = INERTIA * wd_i + GYRATION + mass * Tilde(CENTER) * rdd_i
    force = q_i - q_o + FORCE
    moment = m_i - m_o - Tilde(OUTPUT) * q_o + Tilde(CENTER) * FORCE + MOMENT
    return (
        Equation("acceleration of the output end", rdd_o, geometry, "(5.19), (5.23)"),
        Equation("one rotation for the whole body", wd_o, wd_i, "(5.22)"),
        Equation("Newton, mass centre", linear, force, "(5.20)"),
        Equation("Euler, about the input end", angular, moment, "(5.21)"),
    )


def derivation(stated: tuple[Equation, ...] | None = None) -> Derivation:
    """z_O = U z_I, solved from `stated` (the premises, unless a check alters one)."""
    stated = stated or premises()
    transfer = transfer_matrix(stated, SPATIAL)
    return Derivation(
        element="classical_body_spatial",
        title="spatial rigid body, classical transfer matrix",
        inputs=INPUTS,
        outputs=OUTPUTS,
        definitions=(
            *bias_definitions(),
            Equation("transfer matrix", TRANSFER, transfer, "(5.27)"),
            Equation("scale of the force rows", SCALE, force_scale(transfer, SPATIAL)),
        ),
        premises=stated,
        sources=(f"{BOOK}, (5.19) to (5.27)",),
        notes=(
            "State [rdd; omegadot; m; q; 1] in inertial axes; m, q of the inboard on the outboard.",
            "Euler's law about I is the integral of r x a dm (derive.equations.newton_euler).",
        ),
    )
