"""Storage of planar bodies in the looped engine, and C expressions that read it."""

from __future__ import annotations

from ..schedule.slot_definitions import ROLES

#: Numbers of a body of a scene in a plane, in their order: slot -> (name in C, how many).  Data
#: read of the frame of a cut hinge come first.
_BLOCK_SLOTS = {
    "body.A": ("A", 2), "body.x": ("X", 3), "body.v": ("V", 2), "body.motion": ("MOTION", 4),
    "body.S": ("S", 6), "body.e": ("E", 3), "body.R": ("R", 2), "body.tau": ("TAU", 1),
    "body.delta": ("DELTA", 3), "hinge.F": ("F", 1), "hinge.g": ("OFFSET", 1),
    "hinge.G": ("GAIN", 3),
}  # fmt: skip
#: Cut hinges use the storage of their massless frame that is unused otherwise: slot -> name.
_CLOSURE_SLOTS = {"closure.J_A": "S", "closure.J_B": "S + 3", "closure.l": "DELTA"}
#: Data from the record of a body: slot -> (name in C, how many).
_RECORD_SLOTS = {
    "connection.R": ("TURN", 2), "connection.r": ("SHIFT", 3), "body.rotor": ("ROTOR", 1),
    "body.floor": ("FLOOR", 1), "body.p": ("P", 4),
}  # fmt: skip
#: Variables with another declaration for planar scenes, where body and loops share one record.
PLANAR_VARIABLES: dict[str, tuple[str, tuple[str, ...]]] = {
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


def planar_slot_text(slot: str) -> str | None:
    """C expression of a slot of a planar body; None if it has none."""
    owner, _, name = slot.partition(".")
    if slot in _RECORD_SLOTS:
        return f"body->given + MSTMM_GIVEN_{_RECORD_SLOTS[slot][0]}"
    if slot == "law.tau":
        return "block + MSTMM_FLAT_TAU"
    if slot in _CLOSURE_SLOTS:
        return f"block + MSTMM_FLAT_{_CLOSURE_SLOTS[slot]}"
    if owner not in (*ROLES, "body", "hinge"):
        return None
    start, inner = (owner, "body") if owner in ROLES else ("block", owner)
    stored_slot = f"{inner}.{'motion' if name == 'w' else name}"
    return (
        f"{start} + MSTMM_FLAT_{_BLOCK_SLOTS[stored_slot][0]}"
        if stored_slot in _BLOCK_SLOTS
        else None
    )


def planar_layout() -> list[str]:
    """C constants of the offsets and sizes of the planar layouts."""
    lines = []
    for total, layout in (("FLAT", _BLOCK_SLOTS), ("GIVEN", _RECORD_SLOTS)):
        offset = 0
        for name, count in layout.values():
            lines.append(f"#define MSTMM_{total}_{name} {offset}")
            offset += count
        lines.append(f"#define MSTMM_{total} {offset}")
    return lines
