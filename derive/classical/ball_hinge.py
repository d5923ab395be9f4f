"""Smooth ball hinge followed by a ball hinge, 13 x 13: Rui, Wang, Zhang, ch. 5, (5.49)."""

from __future__ import annotations

from ..definition.derivation import Derivation, Equation, Quantity, vector
from . import hinge_relation
from .hinge_relation import HingeStatement
from .state_vector import SPATIAL

FREE = vector("alpha", 3)
NEXT_EFFORT = vector("tau_n", 3)


def statement() -> HingeStatement:
    """Premises (5.39) to (5.42) and the next ball's condition (5.43)."""
    rdd_i, _, m_i, q_i = SPATIAL.end_blocks("I")
    rdd_o, wd_o, m_o, q_o = SPATIAL.end_blocks("O")
    return HingeStatement(
        element="classical_ball",
        title="ball hinge, classical transfer matrix",
        state=SPATIAL,
        free=FREE,
        inputs=(Quantity(NEXT_EFFORT, "N*m", "moment of the next ball, inertial axes"),),
        premises=(
            Equation("one point", rdd_o, rdd_i, "(5.39)"),
            Equation("free rotation", wd_o, FREE, "(5.47)", "alpha is omegadot_O itself"),
            Equation("moment transmitted", m_o, m_i, "(5.40), (5.42)", "0 for a smooth ball"),
            Equation("force transmitted", q_o, q_i, "(5.41)"),
        ),
        conditions=(
            Equation("moment of the next ball", SPATIAL.end_blocks("N")[2], NEXT_EFFORT, "(5.43)"),
        ),
        source="(5.39) to (5.49)",
        equation="(5.49)",
        notes=(
            "With u_kl the blocks of U: "
            "omegadot_O = -u_32^-1 (u_31 rdd_I + u_33 m_I + u_34 q_I + u_35 - tau_n).",
            "Outboard of the last body the free tip replaces the next ball (tau_n = 0).",
        ),
    )


def derivation() -> Derivation:
    """z_O = U_h z_I with omegadot_O = -u_32^-1 (u_31 rdd + u_33 m + u_34 q + u_35 - tau_n)."""
    return hinge_relation.derivation(statement())
