"""Storage of planar bodies in the looped engine, and C expressions that read it."""

from __future__ import annotations

from ..schedule.words import ROLES

#: Numbers of a body of a scene in a plane, in their order: slot -> (name in C, how many).  Data
#: read of the frame of a cut hinge come first.
_BLOCK = {
    "body.A": ("A", 2), "body.x": ("X", 3), "body.v": ("V", 2), "body.motion": ("MOTION", 4),
    "body.S": ("S", 6), "body.e": ("E", 3), "body.R": ("R", 2), "body.tau": ("TAU", 1),
    "body.delta": ("DELTA", 3), "hinge.F": ("F", 1), "hinge.g": ("OFFSET", 1),
    "hinge.G": ("GAIN", 3),
}  # fmt: skip
#: Cut hinges use the storage of their massless frame that is unused otherwise: slot -> name.
_OF_CLOSURE = {"closure.J_A": "S", "closure.J_B": "S + 3", "closure.l": "DELTA"}
#: Data from the record of a body: slot -> (name in C, how many).
_GIVEN = {
    "connection.R": ("TURN", 2), "connection.r": ("SHIFT", 3), "body.rotor": ("ROTOR", 1),
    "body.floor": ("FLOOR", 1), "body.p": ("P", 4),
}  # fmt: skip
#: Variables with another declaration for planar scenes, where body and loops share one record.
FLAT_VARIABLES: dict[str, tuple[str, tuple[str, ...]]] = {
    "body": ("const mstmm_flat_body *body = &state->model->flat[{body}];", ()),
    "block": ("real *block = mstmm_flat_block(state, {body});", ("body",)),
    "nu": ("const int nu = 1;", ()),
    "looped": ("const mstmm_flat_body *looped = body;", ("body",)),
    "closure": ("const mstmm_closure *closure = &state->model->closures[index];", ()),
    **{
        name: (f"real *{name} = mstmm_flat_block(state, {of}->{member});", (of,))
        for name, of, member in (
            ("parent", "body", "parent"), ("on", "load", "body"), ("axes", "load", "axes"),
            ("from", "force", "body_f"), ("to", "force", "body_t"),
            ("outboard", "closure", "outboard"), ("meeting", "row", "body"),
        )
    },
}  # fmt: skip


def flat_place(slot: str) -> str | None:
    """C expression of a slot of a planar body; None if it has none."""
    owner, _, name = slot.partition(".")
    if slot in _GIVEN:
        return f"body->given + MSTMM_GIVEN_{_GIVEN[slot][0]}"
    if slot == "law.tau":
        return "block + MSTMM_FLAT_TAU"
    if slot in _OF_CLOSURE:
        return f"block + MSTMM_FLAT_{_OF_CLOSURE[slot]}"
    if owner not in (*ROLES, "body", "hinge"):
        return None
    start, inner = (owner, "body") if owner in ROLES else ("block", owner)
    kept = f"{inner}.{'motion' if name == 'w' else name}"
    return f"{start} + MSTMM_FLAT_{_BLOCK[kept][0]}" if kept in _BLOCK else None


def flat_layout() -> list[str]:
    """C constants of the offsets and sizes of the planar layouts."""
    lines = []
    for total, layout in (("FLAT", _BLOCK), ("GIVEN", _GIVEN)):
        at = 0
        for name, count in layout.values():
            lines.append(f"#define MSTMM_{total}_{name} {at}")
            at += count
        lines.append(f"#define MSTMM_{total} {at}")
    return lines
