"""Smooth planar pin followed by a smooth planar pin, 7 x 7: Rui, Wang, Zhang, ch. 5, (5.38)."""

from __future__ import annotations

import sympy as sp

from ..definition.derivation import Derivation, Equation, Quantity
from . import hinge_relation
from .hinge_relation import HingeStatement
from .state_vector import PLANAR

FREE = sp.MatrixSymbol("alpha", 1, 1)
NEXT_EFFORT = sp.MatrixSymbol("tau_n", 1, 1)


def statement() -> HingeStatement:
    """Premises (5.28) to (5.31) and the next pin's condition (5.32)."""
    rdd_i, _, m_i, q_i = PLANAR.end_blocks("I")
    rdd_o, wd_o, m_o, q_o = PLANAR.end_blocks("O")
    return HingeStatement(
        element="classical_pin_planar",
        title="planar pin, classical transfer matrix",
        state=PLANAR,
        free=FREE,
        inputs=(Quantity(NEXT_EFFORT, "N*m", "effort of the next pin (0: smooth)"),),
        premises=(
            Equation("one point", rdd_o, rdd_i, "(5.28)"),
            Equation("free rotation", wd_o, FREE, "(5.36)", "alpha is thetadd_O itself"),
            Equation("moment transmitted", m_o, m_i, "(5.29), (5.31)", "0 for a smooth pin"),
            Equation("force transmitted", q_o, q_i, "(5.30)"),
        ),
        conditions=(
            Equation("moment of the next pin", PLANAR.end_blocks("N")[2], NEXT_EFFORT, "(5.32)"),
        ),
        source="(5.28) to (5.38)",
        equation="(5.38)",
        notes=(
            "With u_kl the blocks of U: "
            "thetadd_O = -(u_31 rdd_I + u_33 m_I + u_34 q_I + u_35 - tau_n) / u_32.",
            "Outboard of the last body the free tip replaces the next pin (tau_n = 0).",
        ),
    )


def derivation() -> Derivation:
    """z_O = U_h z_I with thetadd_O = -(u_31 rdd + u_33 m + u_34 q + u_35 - tau_n) / u_32."""
    return hinge_relation.derivation(statement())
