"""A rigid body outboard of a hinge that rotates about a point: four kernels.

The link of a ball hinge.  Its speeds are given in the body's axes, so these cannot be chosen, and
the transformation from the parent is a general rotation and position, Rt and ro of `riccati_sweep`:

    turn       rotation to the parent, from the coordinates
    forward    bias motion of the body and the load that it requires
    condense   own inertia and outboard bodies; elimination; transport to the parent
    recover    accelerations

Ports have the names and meanings of `axial_links`: `turn` is the part of the transformation that
depends on the coordinates, and G and g hold the factors of `ldl_elimination` for back-substitution.
"""

from __future__ import annotations

import sympy as sp

from ..definition.derivation import Derivation, Equation, Quantity, Triangular, tilde
from ..definition.element import Body, Hinge
from ..definition.notation import part, stack, symbol
from . import user_elements
from .axial_links import BODY, OUTER_E, OUTER_S, OWN_LOAD, body_entries, body_motion
from .hinge import HingeMotion, has_subspace, hinge_pose, hinge_quantities
from .ldl_elimination import REDUCED_E, eliminate_factored
from .riccati_sweep import (
    DELTA,
    MOTION,
    PARENT_DELTA,
    PARENT_MOTION,
    SHIFT,
    SOURCES,
    E,
    R,
    S,
    congruence,
    outboard_deviation,
    transport,
)
from .screw_transport import OUT_E, OUT_S

LINK = Quantity(
    symbol("link", 12), "", "rotation, inboard hinge axes to parent axes; inboard point (m)"
)
ROTATION = Quantity(symbol("turn", 3, 3), "", "rotation, body axes to parent axes")
#: An axial link has a shift; a rotation about a point has none.
NO_SHIFT = Quantity(symbol("d", 0), "m", "shift")


def is_rotational(hinge: Hinge) -> bool:
    """Whether a hinge only rotates and its speeds are the angular velocity in body axes."""
    if hinge.speeds is None or hinge_pose(hinge).position.is_zero_matrix is not True:
        return False
    turning = sp.Matrix.vstack(sp.zeros(3, 3), sp.eye(3))
    return has_subspace(hinge, turning)


def _parent_transform() -> tuple[Equation, Equation]:
    """Transformation to the parent, in the names of the sweep's equations."""
    return (
        Equation("rotation to the parent", R.symbol, ROTATION.symbol),
        Equation("lever in the parent", SHIFT.symbol, part(LINK.symbol, 9)),
    )


def rotation_derivation(motion: HingeMotion) -> Derivation:
    """Rotation to the parent."""
    inboard = sp.ImmutableDenseMatrix(3, 3, lambda i, j: LINK.symbol[3 * i + j, 0])
    value = inboard * motion.in_arrays(motion.rotation)
    return Derivation(
        motion.hinge.name,
        f"rotation of the {motion.hinge.title}",
        (LINK, *hinge_quantities(motion.hinge)[1:2]),
        (ROTATION,),
        (Equation("rotation to the parent", ROTATION.symbol, value),),
    )


def forward(motion: HingeMotion, body: Body) -> Derivation:
    """Bias motion of the body, and the load that this motion requires."""
    motion_q, rates = symbol("motion_Q", 9), symbol("qdot", motion.rates.rows)
    w, wd, rdd = (part(PARENT_MOTION.symbol, n) for n in (0, 3, 6))
    carrier, back = symbol("K", 3, 3), R.symbol.T
    lever = part(SHIFT.symbol, 0)
    return Derivation(
        motion.hinge.name,
        f"bias motion of a rigid body outboard of the {motion.hinge.title}",
        (LINK, ROTATION, BODY, *hinge_quantities(motion.hinge), PARENT_MOTION),
        (NO_SHIFT, MOTION, OWN_LOAD, Quantity(rates, "", "coordinate rates")),
        (
            *_parent_transform(),
            Equation("no shift", NO_SHIFT.symbol, sp.ImmutableDenseMatrix(sp.zeros(0, 1))),
            Equation("K = wd~ + w~ w~", carrier, tilde(wd) + tilde(w) * tilde(w)),
            Equation(
                "bias motion inboard of the hinge",
                motion_q,
                stack(back * w, back * wd, back * (rdd + carrier * lever)),
            ),
            Equation("bias motion", MOTION.symbol, body_motion(motion, motion_q)),
            Equation("load", OWN_LOAD.symbol, body_entries(user_elements.bias_load(body), "e")),
            Equation("coordinate rates", rates, motion.in_arrays(motion.rates)),
        ),
        sources=SOURCES,
    )


def _gains(nu: int) -> tuple[Quantity, Quantity]:
    return (
        Quantity(symbol("G", nu, 6), "", "Z along forces, then F of D = L diag(d) L^T"),
        Quantity(symbol("g", nu), "", "diag(d)^-1 L^-1 (tau - H^T e)"),
    )


def condense(motion: HingeMotion, body: Body) -> Derivation:
    """S and e of the body and all outboard bodies at the parent's P, parent's axes."""
    nu, subspace = motion.nu, motion.in_arrays(motion.subspace)
    inputs = hinge_quantities(motion.hinge)[:1]
    elimination = eliminate_factored(nu, subspace, inputs)
    tau = next(q for q in elimination.inputs if q.name == "tau")
    gain, offset = _gains(nu)
    factor, z = symbol("F", nu, nu), symbol("Z", nu, 6)
    stored = sp.ImmutableDenseMatrix(nu, 6, lambda i, j: z[i, j] if j < 3 else factor[i, j - 3])
    mass = body_entries(user_elements.inertia(body), "S")
    steps, carried = congruence("S_Q")
    return Derivation(
        motion.hinge.name,
        f"S and e of a rigid body carried across the {motion.hinge.title}",
        (LINK, ROTATION, NO_SHIFT, BODY, *inputs, OUTER_S, OUTER_E, OWN_LOAD, tau),
        (gain, offset, OUT_S, OUT_E),
        (
            *_parent_transform(),
            Equation(
                "S of body and outboard part", S.symbol, mass + OUTER_S.symbol, symmetric=True
            ),
            Equation("e of body and outboard part", E.symbol, OWN_LOAD.symbol + OUTER_E.symbol),
            *elimination.definitions,
            Equation("Z along forces, and F", gain.symbol, stored),
            Equation("diag(d)^-1 y", offset.symbol, symbol("z", nu)),
            *steps,
            Equation("X^T S_Q X", OUT_S.symbol, carried),
            Equation("X^T e_Q", OUT_E.symbol, transport(REDUCED_E.symbol)),
        ),
        sources=SOURCES,
    )


def recover(motion: HingeMotion) -> Derivation:
    """udot and the deviation of the body from the factored elimination.

    udot = v - X delta_I about the axes, v = L^-T (z - Z X delta_I) along them; the deviation is
    X delta_I + H udot, which about the axes is v.
    """
    nu = motion.nu
    gain, offset = _gains(nu)
    rates = Quantity(symbol("udot", nu), "", "accelerations of the free coordinates")
    carried, factor, v = symbol("delta_Q", 6), symbol("F", nu, nu), symbol("v", nu)
    z_linear = sp.ImmutableDenseMatrix(nu, 3, lambda i, j: gain.symbol[i, j])
    factor_entries = sp.ImmutableDenseMatrix(nu, nu, lambda i, j: gain.symbol[i, 3 + j])
    return Derivation(
        motion.hinge.name,
        f"accelerations of a rigid body outboard of the {motion.hinge.title}",
        (LINK, ROTATION, NO_SHIFT, *hinge_quantities(motion.hinge)[:1], gain, offset, PARENT_DELTA),
        (rates, DELTA),
        (
            *_parent_transform(),
            Equation("X delta_I", carried, outboard_deviation()),
            Equation("F", factor, factor_entries),
            Equation(
                "v = L^-T (z - Z X delta_I)",
                v,
                Triangular(factor, offset.symbol - z_linear * part(carried, 0), transposed=True),
            ),
            Equation("udot = v - W X delta_I", rates.symbol, v - part(carried, 3)),
            Equation("deviation of the body", DELTA.symbol, stack(part(carried, 0), v)),
        ),
        sources=SOURCES,
    )
