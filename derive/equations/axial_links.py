"""A rigid body outboard of a hinge that moves along and about z: four kernels.

The transformation from the parent consists of two axial screws, chosen when the scene is packed
(modified Denavit-Hartenberg parameters): a constant one about x, and the hinge's own about z with
its constant angle and shift.  One link is

    turn       angle about z, whose sine and cosine the engine computes for two links at a time
    forward    bias motion of the body and the load that it requires
    condense   own inertia and outboard bodies; elimination; transport to the parent
    recover    accelerations

and only turn, d, e, G and g are stored between the passes.

S is carried across the screws by plain products: the double-angle form would save a tenth of the
time but lose up to one and a half digits outboard of long chains, where small moments are
differences of large ones.
"""

from __future__ import annotations

import sympy as sp

from ..definition.derivation import Derivation, Equation, Quantity, tilde
from ..definition.element import Body
from ..definition.notation import part, stack, symbol
from . import user_elements
from .hinge import HingeMotion, HingePose, hinge_quantities
from .ldl_elimination import REDUCED_E, REDUCED_S, eliminate, with_unit_columns
from .riccati_sweep import (
    DELTA,
    MOTION,
    PARENT_DELTA,
    PARENT_MOTION,
    SOURCES,
    E,
    S,
    gains,
    inertia_floor,
    unit_directions,
)
from .screw_transport import OUT_E, OUT_S, Stage

LINK = Quantity(
    symbol("link", 5), "", "screw about x: cosine, sine, shift (m); angle and shift of z at q = 0"
)
ROTATION = Quantity(symbol("turn", 2), "", "cosine and sine of the angle about z")
SHIFT = Quantity(symbol("d", 1), "m", "shift along z")
BODY = Quantity(
    symbol("b", 11), "", "parameters of the rigid body, body axes; rotor inertia of its hinge"
)
OWN_LOAD = Quantity(symbol("e_B", 6), "N, N*m", "load required by the bias motion of the body")
OUTER_S = Quantity(symbol("S_K", 6, 6), "", "S of the outboard part", symmetric=True)
OUTER_E = Quantity(symbol("e_K", 6), "N, N*m", "e of the outboard part")


def _about_x() -> Stage:
    link = LINK.symbol
    return Stage(0, link[0, 0], link[1, 0], link[2, 0], "_x")


def _about_z() -> Stage:
    return Stage(2, ROTATION.symbol[0, 0], ROTATION.symbol[1, 0], SHIFT.symbol[0, 0], "_z")


def along_z(place: HingePose) -> tuple[sp.Expr, sp.Expr] | None:
    """Angle and shift as functions of q, for a hinge that moves only about and along z."""
    rotation, position = place.rotation, place.position
    if any(rotation[k, 2] != (k == 2) or rotation[2, k] != (k == 2) for k in range(3)):
        return None
    if position[0] != 0 or position[1] != 0:
        return None
    angles = [q for q in place.q if rotation == sp.Matrix(sp.rot_axis3(-q))]
    if not angles and rotation != sp.eye(3):
        return None
    return angles[0] if angles else sp.Integer(0), position[2]


def _angle_and_shift(motion: HingeMotion) -> tuple[sp.Expr, sp.Expr]:
    screw = along_z(motion)
    assert screw is not None
    angle, shift = (motion.in_arrays(sp.Matrix([value]))[0] for value in screw)
    return angle, shift


def rotation_derivation(motion: HingeMotion) -> Derivation:
    """Angle about z."""
    theta = Quantity(symbol("turn", 1), "rad", "angle about z instead of its cosine and sine")
    value = _angle_and_shift(motion)[0] + LINK.symbol[3, 0]
    return Derivation(
        motion.hinge.name,
        f"angle of the {motion.hinge.title}",
        (LINK, *hinge_quantities(motion.hinge)[1:2]),
        (theta,),
        (Equation("angle about z", theta.symbol, sp.ImmutableDenseMatrix([value])),),
    )


def forward(motion: HingeMotion, body: Body) -> Derivation:
    """Shift along z, bias motion of the body, and the load that this motion requires."""
    _, shift = _angle_and_shift(motion)
    link, motion_q = LINK.symbol, symbol("motion_Q", 9)
    between = symbol("motion_x", 9)
    rates = symbol("qdot", motion.rates.rows)
    return Derivation(
        motion.hinge.name,
        f"bias motion of a rigid body outboard of the {motion.hinge.title}",
        (LINK, ROTATION, BODY, *hinge_quantities(motion.hinge), PARENT_MOTION),
        (SHIFT, MOTION, OWN_LOAD, Quantity(rates, "", "coordinate rates")),
        (
            *_about_x().outboard_motion(PARENT_MOTION.symbol, between),
            Equation("shift along z", SHIFT.symbol, sp.ImmutableDenseMatrix([shift + link[4, 0]])),
            *_about_z().outboard_motion(between, motion_q),
            Equation("bias motion", MOTION.symbol, body_motion(motion, motion_q)),
            Equation("load", OWN_LOAD.symbol, body_entries(user_elements.bias_load(body), "e")),
            Equation("coordinate rates", rates, motion.in_arrays(motion.rates)),
        ),
        sources=SOURCES,
    )


def body_motion(motion: HingeMotion, motion_q: sp.MatrixSymbol) -> sp.BlockMatrix:
    """Motion of P from that of Q, in P axes, plus the hinge's velocity and acceleration."""
    w, wd, rdd = (part(motion_q, n) for n in (0, 3, 6))
    v_own, w_own = motion.in_arrays(motion.velocity), motion.in_arrays(motion.spin)
    c = motion.in_arrays(motion.bias)
    c_v, c_w = sp.ImmutableDenseMatrix(c[:3, :]), sp.ImmutableDenseMatrix(c[3:, :])
    return stack(w + w_own, wd + tilde(w) * w_own + c_w, rdd + 2 * (tilde(w) * v_own) + c_v)


def body_entries(derivation: Derivation, name: str) -> sp.Basic:
    """Definition from the body's derivation, with its parameters renamed to those here."""
    parameters = next(q for q in derivation.inputs if q.name == "p").symbol
    matrix = sp.ImmutableDenseMatrix(derivation.definition(name))
    return matrix.xreplace(
        {parameters[i, 0]: BODY.symbol[i, 0] for i in range(int(parameters.rows))}
    )


def condense(motion: HingeMotion, body: Body, rotor: bool = False) -> Derivation:
    """S and e of the body and all outboard bodies at the parent's origin, parent's axes.

    With a `rotor` its inertia is added to D, and S keeps its row along the hinge.
    """
    nu, subspace = motion.nu, motion.in_arrays(motion.subspace)
    inputs = hinge_quantities(motion.hinge)[:1]
    elimination = eliminate(nu, subspace, inputs, rotor=BODY.symbol[10, 0] if rotor else None)
    gain, offset = gains(nu)
    tau = next(q for q in elimination.inputs if q.name == "tau")
    middle = (symbol("S_x", 6, 6), symbol("e_x", 6))
    mass = body_entries(user_elements.inertia(body), "S")
    return Derivation(
        motion.hinge.name,
        f"S and e of a rigid body carried across the {motion.hinge.title}",
        (LINK, ROTATION, SHIFT, BODY, *inputs, OUTER_S, OUTER_E, OWN_LOAD, tau),
        (gain, offset, OUT_S, OUT_E),
        (
            Equation(
                "S of body and outboard part", S.symbol, mass + OUTER_S.symbol, symmetric=True
            ),
            Equation("e of body and outboard part", E.symbol, OWN_LOAD.symbol + OUTER_E.symbol),
            *elimination.definitions,
            *_about_z().carry_equations(REDUCED_S.symbol, REDUCED_E.symbol, middle),
            *_about_x().carry_equations(*middle, (OUT_S.symbol, OUT_E.symbol)),
        ),
        sources=SOURCES,
    )


def pivot_threshold(body: Body) -> sp.ImmutableDenseMatrix:
    """Lower limit of pivots, from the body's own inertia."""
    return inertia_floor(body_entries(user_elements.inertia(body), "S"))


def recover(motion: HingeMotion, rotor: bool = False) -> Derivation:
    """udot = g - G X delta_I and the deviation X delta_I + H udot of the body."""
    nu, subspace = motion.nu, motion.in_arrays(motion.subspace)
    gain, offset = gains(nu)
    rates = Quantity(symbol("udot", nu), "", "accelerations of the free coordinates")
    between, carried = symbol("delta_x", 6), symbol("delta_Q", 6)
    full = with_unit_columns(gain.symbol, {} if rotor else unit_directions(subspace))
    return Derivation(
        motion.hinge.name,
        f"accelerations of a rigid body outboard of the {motion.hinge.title}",
        (LINK, ROTATION, SHIFT, *hinge_quantities(motion.hinge)[:1], gain, offset, PARENT_DELTA),
        (rates, DELTA),
        (
            *_about_x().deviation(PARENT_DELTA.symbol, between),
            *_about_z().deviation(between, carried),
            Equation("udot = g - G X delta_I", rates.symbol, offset.symbol - full * carried),
            Equation("deviation of the body", DELTA.symbol, carried + subspace * rates.symbol),
        ),
        sources=SOURCES,
    )
