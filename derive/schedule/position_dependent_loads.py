"""Position-dependent loads in the tangent (derive/equations/tangent_position_loads.py).

These steps extend those of the tangent sweep, for every body inboard of such a load: a load in
inertial axes, a force element to the ground, drag.  The initial rows come from the differentiated
passes of the loads themselves, along every entry of the body's position.
"""

from __future__ import annotations

from dataclasses import replace

from .differentiated_passes import D, differentiate_call, differentiate_pass, slopes
from .flexible import DRAG
from .loads import FORCES, LOADS
from .pass_steps import (
    Add,
    Call,
    Copy,
    Evaluate,
    ForEachDirection,
    Gather,
    Move,
    Pass,
    RunPass,
    Step,
    call,
    only,
)

_POSE_CHANGE = call("frames.placed_pose", A="body.A", p="place.z", d_A=D + "body.A",
                    d_x=D + "body.x", d_v=D + "body.v")  # fmt: skip
_NO_POSE_CHANGE = (Copy(to=D + "body.A"), Copy(to=D + "body.x"), Copy(to=D + "body.v"))

#: Zero displacement, and no known load by position.
BEGUN = only("placed", Copy(to="place.S"), *_NO_POSE_CHANGE, Copy(to=D + "body.motion"))


def _accumulate_rows(to: str, *steps: Step) -> tuple[Step, ...]:
    """Load that `steps` add to the body along direction c, stored in row c of `to`."""
    return (
        Move(to=D + "body.e", source=f"{to}[6 * c]", count="6"),
        *steps,
        Move(to=f"{to}[6 * c]", source=D + "body.e", count="6"),
    )


def _along_position(entries: str, *steps: Step) -> tuple[Step, ...]:
    """Steps for entries of the body's position, whose seed is cleared afterwards."""
    return (ForEachDirection(of=entries, steps=(_POSE_CHANGE, *steps)), *_NO_POSE_CHANGE)


#: Drag by motion and modes is added to the body's own load.
DRAG_DERIVATIVE = RunPass(whole=differentiate_pass(DRAG), when="drag")
#: Drag along the position of a flexible body; zero without drag.
OWN_BY_PLACE = only(
    "modal placed",
    *_along_position(
        "place",
        Copy(to=D + "body.e"),
        Copy(to=D + "modes.e_f"),
        DRAG_DERIVATIVE,
        Move(to="place.S[6 * c]", source=D + "body.e", count="6"),
        Move(to="bend.place_Z[n * c]", source=D + "modes.e_f", count="n"),
    ),
)

_APPLIED_LOAD = next(
    step for step in LOADS.steps
    if isinstance(step, Call) and step.kernel == "frames.applied_load"
)  # fmt: skip
#: Steps that compute the inputs of its application.
_LOAD_INPUTS = LOADS.steps[: LOADS.steps.index(_APPLIED_LOAD)]

LOADS_BY_PLACE = Pass(
    "loads_by_place", "load", "Change of a load in inertial axes by the rotation of its body.",
    (
        *_LOAD_INPUTS,
        *_along_position(
            "turn", *_accumulate_rows("place.S", differentiate_call(_APPLIED_LOAD, "A_F", "F", "M"))
        ),
    ),
    skip="!own_load",
)  # fmt: skip


def _computes_derivative(step: Step) -> bool:
    """Whether a step of a differentiated pass computes a derivative."""
    if isinstance(step, Call):
        return type(step) is not Call
    return isinstance(step, (Copy, Add, Gather, Evaluate)) and step.to.startswith(D)


def _skip_ground_end(step: Step) -> Step:
    """Step of one end only, conditional on that end not being on the ground."""
    slots = [slot for _, slot in step.ports] if isinstance(step, Call) else []
    for role in ("from", "to"):
        if any(slot.startswith(f"{role}.") for slot in slots):
            return replace(step, when=f"{role}_body")
    return step


_FORCE_STEPS = tuple(slopes(FORCES.steps))
_FORCE_DERIVATIVES = tuple(map(_skip_ground_end, filter(_computes_derivative, _FORCE_STEPS)))
#: Zero derivatives of the end on the ground.
_GROUND_END = tuple(Copy(to=f"{D}local.{name}_{end}") for end in "FT" for name in "Axvw")

FORCES_BY_PLACE = Pass(
    "forces_by_place", "force", "Change of the load of an element on the ground by its motion.",
    (
        *(step for step in _FORCE_STEPS if not _computes_derivative(step)),
        *_GROUND_END,
        *_along_position("place", *_accumulate_rows("place.S", *_FORCE_DERIVATIVES)),
        ForEachDirection(of="spin", steps=_accumulate_rows("tangent.S", *_FORCE_DERIVATIVES)),
    ),
    skip="!own_force",
)  # fmt: skip


# --- factored -----------------------------------------------------------------------------------


def column(b: str, d_v: str) -> Step:
    """Row of B_p for one direction."""
    return call("frames.placed_column", when="placed", theta="local.turn", x="local.shift",
                v_P="body.v", v="hinge.v", d_v=d_v, Q="local.carrier", B_p=b)  # fmt: skip


_ROW_PORTS = {"S_p": "place.S"}
_ROWS = {"Z_p": "local.placed"}
HINGE_ROWS = only(
    "moving placed",
    call("tangent.placed_rows", n="free", H="tangent.H", **_ROW_PORTS, **_ROWS),
    call("tangent.placed_own", n="free", B_p="place.B", **_ROW_PORTS, **_ROWS, K="tangent.G",
         Z_x="tangent.W"),
)  # fmt: skip
HINGE_REDUCED = only(
    "moving placed",
    call("tangent.placed_reduce", n="free", inverse="tangent.inverse", **_ROWS, V="tangent.V",
         gain="place.gain", **_ROW_PORTS),
)  # fmt: skip
MODES_OWN_LOAD = only(
    "modal section placed",
    call("tangent.placed_own", n="modes", B_p="bend.place_B", **_ROW_PORTS, Z_p="bend.place_Z",
         K="bend.K", Z_x="bend.Z_x"),
)  # fmt: skip


def _node(condition: str, subspace: str) -> Step:
    return call("tangent.placed_node", n="modes", when=condition, H=subspace, V="bend.V",
                D="bend.D", **_ROW_PORTS, Z_p="bend.place_Z", right="bend.place_right",
                gain="bend.place_gain", S_c="local.S_p", work="bend.work")  # fmt: skip


MODES_REDUCED = (
    _node("modal section placed", "section.H"),
    _node("modal !section placed", "bend.zero_H"),
    *only("modal placed", Copy(to="place.S", source="local.S_p")),
)
_POSE_PORTS = {"Rc": "body.R", "r": "body.r"}
CARRY_TO_PARENT = call(
    "frames.placed_carry", when="placed", **_POSE_PORTS, **_ROW_PORTS, T_p="local.T_p",
    T_w="local.T", S_pI="inboard.place", S_wI="inboard.S",
)  # fmt: skip
_PORT = {**_POSE_PORTS, "H": "section.H", "B_p": "port.place_B", **_ROW_PORTS, "T_p": "local.T_p"}
PORT_ASSEMBLY = (
    call("tangent.placed_port", n="modes", when="outward placed !segment", **_PORT, K="bend.K",
         Z_p="bend.place_Z", Z_x="bend.Z_x"),
    call("tangent.placed_port", n="modes", when="segment placed", **_PORT, K="inboard.K",
         Z_p="inboard.Z_p", Z_x="bend.Z_x"),
    call("tangent.placed_carry_columns", n="modes", when="segment placed", **_POSE_PORTS,
         B_p="port.place_B", Z_o="port.outboard_Z_p", Z_p="inboard.Z_p", Z_z="inboard.Z_z",
         Z_x="bend.Z_x"),
)  # fmt: skip

# --- one right-hand side ------------------------------------------------------------------------

KNOWN_LOAD = call("frames.placed_known_load", when="placed", **_ROW_PORTS, b_p="place.known",
             e_S="local.row_load", e_b="local.known")  # fmt: skip
POSITION_CHANGE = call("frames.placed_displacement", when="placed", **_POSE_PORTS,
                       z_I=D + "parent.motion", p_I="inboard.z", p="place.z")  # fmt: skip
KNOWN_POSITION_CHANGE = Add(to="place.z", source="place.known")


def _displacement_steps(size: str, b: str, unknowns: str) -> tuple[Step, ...]:
    return (
        call("tangent.port_motion", n=size, B=b, x=unknowns, z_c="place.z", z="local.p"),
        Copy(to="place.z", source="local.p"),
    )


HINGE_REMAINDER = only(
    "moving placed",
    call("tangent.placed_remainder", n="free", gain="place.gain", p="place.z", y="tangent.y"),
)
HINGE_DISPLACED = only("moving placed", *_displacement_steps("free", "place.B", "local.x"))
PORT_DISPLACED = only(
    "outward placed", *_displacement_steps("modes", "port.place_B", "modes.answer")
)
MODES_REMAINDER = only(
    "modal placed",
    call("tangent.placed_remainder", n="modes", gain="bend.place_gain", p="place.z", y="bend.y"),
)
MODES_DISPLACED = only(
    "modal section placed", *_displacement_steps("modes", "bend.place_B", "modes.answer")
)
