"""Pin moving in space, followed by a pin, 13 x 13: Rui, Wang, Zhang, ch. 5, (5.61)."""

from __future__ import annotations

import sympy as sp

from ..definition.derivation import Derivation, Equation, Quantity, tilde, vector
from ..definition.notation import explicit
from . import hinge_relation
from .hinge_relation import HingeStatement
from .state_vector import SPATIAL

FREE = sp.MatrixSymbol("alpha", 1, 1)
AXIS, NEXT_AXIS = vector("a", 3), vector("a_n", 3)
SPEED, OMEGA = sp.MatrixSymbol("u", 1, 1), vector("omega_I", 3)
BIAS = vector("eta", 3)
NEXT_EFFORT = sp.MatrixSymbol("tau_n", 1, 1)


def statement() -> HingeStatement:
    """Premises (5.50) to (5.54) and the next pin's condition (5.55)."""
    rdd_i, wd_i, m_i, q_i = SPATIAL.end_blocks("I")
    rdd_o, wd_o, m_o, q_o = SPATIAL.end_blocks("O")
    about_next = NEXT_AXIS.T * SPATIAL.end_blocks("N")[2]
    bias = tilde(OMEGA) * explicit(AXIS) * SPEED[0, 0]
    return HingeStatement(
        element="classical_pin_spatial",
        title="pin moving in space, classical transfer matrix",
        state=SPATIAL,
        free=FREE,
        inputs=(
            Quantity(AXIS, "1", "pin axis, unit vector, inertial axes"),
            Quantity(SPEED, "rad/s", "rate of the pin angle"),
            Quantity(OMEGA, "rad/s", "angular velocity of the inboard body, inertial axes"),
            Quantity(NEXT_AXIS, "1", "axis of the next pin, unit vector, inertial axes"),
            Quantity(NEXT_EFFORT, "N*m", "effort of the next pin (0: smooth)"),
        ),
        premises=(
            Equation("one point", rdd_o, rdd_i, "(5.50)"),
            Equation("relative rotation", wd_o, wd_i + BIAS + AXIS * FREE, "(5.51), (5.59)"),
            Equation("moment transmitted", m_o, m_i, "(5.52), (5.54)", "0 along a smooth axis"),
            Equation("force transmitted", q_o, q_i, "(5.53)"),
        ),
        conditions=(
            Equation("moment about the next axis", about_next, NEXT_EFFORT, "(5.55)"),
        ),
        source="(5.50) to (5.61)",
        equation="(5.61)",
        bias=(
            Equation("bias", BIAS, bias, "", "rate of the axis in the rotating inboard body"),
        ),
        notes=(
            "alpha is the second derivative of the pin angle; with u_kl the blocks of U it is "
            "-(a_n . (u_31 rdd_I + u_32 (omegadot_I + eta) + u_33 m_I + u_34 q_I + u_35) - tau_n) "
            "/ (a_n . u_32 a).",
            "Outboard of the last body any axis can be the next one, e.g. its own (tau_n = 0).",
            "Pins at right angles on a body with matching principal axes have a vanishing pivot.",
        ),
    )  # fmt: skip


def derivation() -> Derivation:
    """z_O = U_h z_I."""
    return hinge_relation.derivation(statement())
