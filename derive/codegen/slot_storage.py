"""C expressions of the storage of schedule slots in the looped engine."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, field
from math import prod

from mstmm.ir import scene_structure

from ..schedule.differentiated_passes import D
from ..schedule.slot_definitions import ROLES, SLOTS
from .planar_storage import PLANAR_VARIABLES, planar_layout, planar_slot_text

#: Numbers of a body's block in the workspace, in their order: slot -> name in C.  Slots
#: that the same passes use are adjacent, for cache lines; e follows S (links.c).
BLOCK_SLOTS = {
    "body.A": "A", "body.x": "X", "body.v": "V", "body.delta": "DELTA", "body.floor": "FLOOR",
    "hinge.R": "HINGE_R", "hinge.d": "HINGE_D", "body.R": "R", "body.r": "SHIFT",
    "hinge.v": "HINGE_V", "hinge.w": "HINGE_W", "hinge.c": "HINGE_C", "body.S": "S",
    "body.e": "E", "body.motion": "MOTION",
}  # fmt: skip
#: Slots after them, which have numbers per speed: slot -> name in C.
SPEED_SLOTS = {
    "body.s": "S", "body.tau": "TAU", "hinge.H": "H", "hinge.g": "OFFSET", "hinge.rates": "RATES",
    "hinge.G": "GAIN", "hinge.H_free": "H_FREE",
}  # fmt: skip


@dataclass(frozen=True)
class Layout:
    """Slots of one owner side by side in memory from the C expression `start` on.

    `arguments` are those of the macros of their offsets, which `parameters` name.
    """

    start: str
    names: str
    parameters: str = ""
    arguments: str = ""

    def offsets(self, owner: str) -> dict[str, Counter[str]]:
        """Slot -> its offset, and "" -> the length: so many times products of sizes."""
        offsets, total = dict[str, Counter[str]](), Counter[str]()
        for name in self.names.split():
            offsets[f"{owner}.{name}"] = total.copy()
            total += size_terms(f"{owner}.{name}")
        return offsets | {"": total}


_COUPLING_NAMES = " ".join(scene_structure.COUPLING_NUMBERS)
_BODY_SIZES = ("(nu, nq)", "(body->nu, body->nq)")
#: Owner -> layout: a hinge that closes a loop, a coupling, a row; a flexible body and a section in
#: the workspace; the tangent of a body, of one whose loads depend on its position, of a flexible
#: body, and of a section.
LAYOUTS = {
    "closure": Layout("closed", "W J_A J_B l R_C d lever gap slip"),
    "coupling": Layout("loops + coupling->numbers", _COUPLING_NAMES),
    "row": Layout("line", "K known pivot inverse x previous_x"),
    "modes": Layout(
        "modes", "S_rf S_rf_I A right gain A_drag S_ff work e_f etadd", "(n)", "(n)"
    ),
    "section": Layout(
        "laid", "Phi H push H6 x Psi xd Psid xdd Psidd dC1 dC2 dX S_rf", "(n)", "(n)"
    ),
    "tangent": Layout(
        "tangent", "S B G W laws H V gain inverse y known along rates_by_speeds"
        " rates_by_coordinates unit rates Q Q_work", *_BODY_SIZES,
    ),
    "place": Layout("place", "S z known B gain", *_BODY_SIZES),
    "bend": Layout(
        "bend", "B G W zero_H K Z_z Z_x V D right gain work rest y place_B place_Z place_gain",
        "(n)", "(n)",
    ),
    "port": Layout(
        "port", "B G W K place_B outboard_K outboard_Z_z outboard_Z_p", "(n)", "(n)"
    ),
}  # fmt: skip


def size_terms(slot: str) -> Counter[str]:
    """Length of a slot: product of sizes -> how many times, of a slot without size one number."""
    factors = SLOTS[slot].size.replace("free", "nu").split() if slot in SLOTS else ["1"]
    number = prod(int(factor) for factor in factors if factor.isdigit())
    return Counter({" ".join(factor for factor in factors if not factor.isdigit()): number})


#: Slots that share the storage of another slot, which is not needed at that time.
SHARED_SLOTS = {
    "hinge.F": "hinge.H", "modes.load_effort": "modes.right", "bend.place_right": "bend.right",
    "body.U": "body.S", "body.d": "body.delta",
    # Only one of the two tangents exists at a time.
    "mass.S": "tangent.S", "mass.F": "tangent.gain", "mass.G": "tangent.V",
    "shapes.S_rf": "bend.V", "shapes.S_rf_I": "bend.G", "shapes.S_ff": "bend.D",
    "shapes.right": "bend.right", "shapes.gain": "bend.gain", "port.S_rf": "port.outboard_K",
    # Displacement and rotation vector are adjacent.
    "section.Om": "section.x", "section.Omd": "section.xd", "section.Omdd": "section.xdd",
}  # fmt: skip

#: Vectors of the state and of results that have slots of the same name.
_STATE = ("given", "efforts", "udot", "required", "column", "answer")
#: Owner -> C expression of its record, whose fields have the names of other slots of it.
_RECORDS = {
    "law": "law->", "load": "load->", "force": "force->", "closure": "closure->",
    "moments": "modal->moments.", "drag": "modal->drag->", "section": "section->",
    "pending": "loops + pending->", "own": "loops + own->", "bent": "loops + bent->",
}  # fmt: skip


def _station_text(numbers: str, section_slot: str, modal_slot: str) -> str:
    """C expression of columns at the previous station; of the modes for the first segment."""
    offset = "tangent" if "tangents" in numbers else "place"
    return (
        f"{numbers} + (section->previous"
        f" ? section->previous->{offset} + {_macro_name(section_slot)}(n)"
        f" : modal->{offset} + {_macro_name(modal_slot)}(n))"
    )


def _macro_name(slot: str) -> str:
    return f"MSTMM_{slot.replace('.', '_').upper()}"


_TANGENT_NUMBERS = "state->tangents->numbers"
_INBOARD_TANGENT = "state->tangents->numbers + mstmm_tangent_at(state, body->parent)"
#: C expressions of scene data and of results.
_SLOT_TEXTS = {
    "body.p": "body->body_p", "body.rotor": "body->rotor", "hinge.p": "body->hinge_p",
    "connection.R": "body->connection", "connection.r": "body->connection + 9",
    "body.q": "state->q + body->q", "body.u": "state->u + body->u",
    "body.qdot": "state->qdot + body->q", "body.w": "block + MSTMM_BLOCK_MOTION",
    **{f"body.{name}": f"state->{name} + body->u" for name in _STATE},
    "modes.eta": "state->q + modal->q", "modes.etad": "state->u + modal->u",
    "modes.qdot": "state->qdot + modal->q",
    **{f"modes.{name}": f"state->{name} + modal->u" for name in _STATE},
    "modes.K": "modal->stiffness", "modes.D": "modal->damping",
    "inboard.S_rf": _station_text("state->workspace", "section.S_rf", "modes.S_rf"),
    "inboard.shapes_S_rf": _station_text(_TANGENT_NUMBERS, "port.outboard_K", "bend.V"),
    "inboard.K": _station_text(_TANGENT_NUMBERS, "port.outboard_K", "bend.K"),
    "inboard.Z_z": _station_text(_TANGENT_NUMBERS, "port.outboard_Z_z", "bend.Z_z"),
    "inboard.Z_p": _station_text(_TANGENT_NUMBERS, "port.outboard_Z_p", "bend.place_Z"),
    "drive.value": "mstmm_drive_values(state) + 3 * index",
    "drive.rate": "mstmm_drive_values(state) + 3 * index + 1",
    "drive.acceleration": "mstmm_drive_values(state) + 3 * index + 2",
    "drive.q": "mstmm_filled_q(state) + body->q + drive->coordinate",
    "drive.u": "mstmm_filled_u(state) + body->u + drive->speed",
    "drive.s": "block + MSTMM_BLOCK_FIXED + drive->speed",
    "speed.effort": "state->efforts + index", "speed.u": "state->u + index",
    "law.q": "state->q + body->q + law->coordinate",
    "law.u": "state->u + body->u + law->speed", "law.turn": "state->memory + law->twist",
    "law.tau": "block + MSTMM_BLOCK_FIXED + MSTMM_SPEED_TAU * body->nu + law->speed",
    "force.offset_F": "force->offset_f", "force.offset_T": "force->offset_t",
    "force.axes_F": "force->axes_f", "force.axes_T": "force->axes_t",
    "law.slopes": "tangent + MSTMM_TANGENT_LAWS(body->nu, body->nq) + body->nu * c + law->speed",
    "law.own_slopes": "tangent + MSTMM_TANGENT_LAWS(body->nu, body->nq)"
    " + body->nu * (law->speed + c) + law->speed",
    "tangent.S": "state->tangents->numbers + mstmm_carried_at(state->tangents, body)",
    "inboard.S": _INBOARD_TANGENT, "inboard.mass": _INBOARD_TANGENT,
    "inboard.place": "state->tangents->numbers + mstmm_place_at(state->model, body->parent)",
    "inboard.z": "state->tangents->numbers + mstmm_place_at(state->model, body->parent)"
    " + MSTMM_PLACE_Z(0, 0)",
    "step.rate": "&state->tangents->rate", "step.s": "&state->tangents->s",
    "step.closing": "&state->closing",
    "step.q": "&state->tangents->sq", "step.kappa": "&state->tangents->kappa",
    "body.rho": "state->tangents->rho + body->q",
    "body.change": "state->tangents->change + body->q",
    "row.floor": "mstmm_row_floor(state, row)",
    "line.softness": "&state->model->rows[closure->rows[c]].softness",
    "side.inner": "loops + closure->inner[c]", "side.outer": "loops + closure->outer[c]",
    "pending.K": "loops + pending->column",
    "before.y": "loops + looped->pending[b].y",
    "coupling.x": "loops + MSTMM_ROW * (int64_t)coupling->row + MSTMM_ROW_X",
    "coupling.previous_x": "loops + MSTMM_ROW * (int64_t)coupling->row + MSTMM_ROW_PREVIOUS_X",
    "pair.L": "loops + pending->pairs[b]",
    "bent.K": "loops + bent->column",
    "bent_before.modes": "loops + looped->bent[b].modes",
    "bent_pair.L": "loops + bent->pairs[b]",
    "other.K": "loops + other->column", "other.L": "loops + other->pair",
    "second.L": "loops + row->others[b].pair", "both.L": "loops + other->pairs[b]",
    "scene.t": "&state->t", "sums.power": "&state->balance->power",
    "sums.potential": "&state->balance->potential", "identity": "mstmm_identity",
    "zero": "mstmm_zeros", "none": "mstmm_zeros", "plane": "mstmm_directions",
    "link.b": "at.numbers", "link.p": "at.numbers + 11", "link.numbers": "at.numbers + 12",
    "link.q": "at.q", "link.u": "at.u", "link.qdot": "at.qdot", "link.udot": "at.udot",
    "link.tau": "at.tau", "link.turn": "at.link + MSTMM_LINK_TURN(at.nu)",
    "link.shift": "at.link + MSTMM_LINK_SHIFT", "link.motion": "at.link + MSTMM_LINK_MOTION",
    "link.load": "at.link + MSTMM_LINK_LOAD", "link.g": "at.link + MSTMM_LINK_FIXED",
    "link.G": "at.link + MSTMM_LINK_FIXED + at.nu", "outer.motion": "at.outer_motion",
    "outer.delta": "at.outer_delta", "outer.S": "at.outer", "outer.e": "at.outer + 21",
    "inner.S": "at.inner", "inner.e": "at.inner + 21",
}  # fmt: skip

#: Variables of the printed functions: name -> (declaration, variables it needs).
VARIABLES: dict[str, tuple[str, tuple[str, ...]]] = {
    "model": ("const mstmm_model *model = state->model;", ()),
    "law": ("const mstmm_law *law = &state->model->laws[index];", ()),
    "load": ("const mstmm_load *load = &state->model->loads[index];", ()),
    "force": ("const mstmm_force *force = &state->model->forces[index];", ()),
    "drive": ("const mstmm_drive *drive = &state->model->drives[index];", ()),
    "body": ("const mstmm_body *body = &state->model->bodies[{body}];", ()),
    "block": ("real *block = state->workspace + body->block;", ("body",)),
    "parent": ("real *parent = mstmm_block(state->model, state->workspace, body->parent);",
               ("body",)),
    "on": ("real *on = mstmm_block(state->model, state->workspace, load->body);", ("load",)),
    "axes": ("real *axes = mstmm_block(state->model, state->workspace, load->axes);", ("load",)),
    "from": ("real *from = mstmm_block(state->model, state->workspace, force->body_f);",
             ("force",)),
    "to": ("real *to = mstmm_block(state->model, state->workspace, force->body_t);", ("force",)),
    "nu": ("const int nu = body->nu;", ("body",)),
    "nq": ("const int nq = body->nq;", ("body",)),
    "tangent": ("real *tangent = state->tangents->numbers + body->tangent;", ("body",)),
    "place": ("real *place = state->tangents->numbers + body->place;", ("body",)),
    "modal": ("const mstmm_modal *modal = mstmm_modal_of(body);", ("body",)),
    "n": ("const int n = mstmm_modes_of(modal);", ("modal",)),
    "modes": ("real *modes = modal ? state->workspace + modal->place : NULL;", ("modal",)),
    "section": ("const mstmm_section *section = body->section;", ("body",)),
    "laid": ("real *laid = section ? state->workspace + section->place : NULL;", ("section",)),
    "bend": ("real *bend = modal ? state->tangents->numbers + modal->tangent : NULL;", ("modal",)),
    "port": ("real *port = section ? state->tangents->numbers + section->tangent : NULL;",
             ("section",)),
    "looped": ("const mstmm_looped *looped = &state->model->looped[index];", ()),
    "closure": ("const mstmm_closure *closure = looped->closure;", ("looped",)),
    "outboard": (
        "real *outboard ="
        " closure ? mstmm_block(state->model, state->workspace, closure->outboard) : NULL;",
        ("closure",),
    ),
    "loops": ("real *loops = state->workspace + state->model->loops;", ()),
    "closed": (
        "real *closed = closure ? loops + closure->numbers : NULL;", ("loops", "closure"),
    ),
    "coupling": ("const mstmm_coupling *coupling = &state->model->couplings[index];", ()),
    "row": ("const mstmm_loop_row *row = &state->model->rows[index];", ()),
    "line": ("real *line = loops + MSTMM_ROW * (int64_t)index;", ("loops",)),
    "meeting": ("real *meeting = mstmm_block(state->model, state->workspace, row->body);",
                ("row",)),
    "columns": ("int columns[6];", ()),
    "speeds": ("const int speeds = mstmm_free_speeds(state->memory, body, columns);",
               ("body", "columns")),
}  # fmt: skip
#: Variables with a counterpart in the second workspace, which holds derivatives.
_DERIVATIVE_VARIABLES = (
    "block", "parent", "on", "axes", "from", "to", "modes", "laid", "outboard", "loops", "closed",
)  # fmt: skip


def _derivative_text(text: str) -> str:
    """C expression of the derivative of a number; "" for a constant number."""
    pattern = re.compile(
        r"(?<![\w>.])(state)(?!->(?:memory|model))|(?<![\w>.])("
        + "|".join(_DERIVATIVE_VARIABLES)
        + r")\b"
    )
    if not pattern.search(text):
        return ""
    return pattern.sub(lambda m: "state->slope" if m[1] else f"d_{m[2]}", text)


VARIABLES |= {
    f"d_{name}": (
        VARIABLES[name][0].replace(f"*{name} ", f"*d_{name} ")
        .replace("state->workspace", "state->slope->workspace")
        .replace("? loops", "? d_loops"),
        tuple(f"d_{word}" if word == "loops" else word for word in VARIABLES[name][1]),
    )
    for name in _DERIVATIVE_VARIABLES
}  # fmt: skip
# The closure defines its body.
_PLANAR_VARIABLES = {"closure": PLANAR_VARIABLES["closure"], **VARIABLES, **PLANAR_VARIABLES}


def pass_variables(flat: bool) -> dict[str, tuple[str, tuple[str, ...]]]:
    """Variables of the pass functions, of planar scenes if `flat`."""
    return _PLANAR_VARIABLES if flat else VARIABLES


#: C expression of the body that the subject of a pass refers to.
BODY_OF_SUBJECT = {
    "body": "index", "law": "law->body", "drive": "drive->body", "load": "load->body",
    "force": "mstmm_force_body(force)", "closure": "closure->frame",
}  # fmt: skip


@dataclass
class SlotExpression:
    """C expression of a slot, and the variables it reads."""

    text: str
    variables: set[str] = field(default_factory=set)


def slot_expression(slot: str, flat: bool = False) -> SlotExpression | None:
    """Storage of a slot, of a planar scene if `flat`; None for a local slot."""
    if slot.startswith(D):
        return _derivative_expression(slot.removeprefix(D))
    name, _, entry_index = slot.partition("[")
    slot = SHARED_SLOTS.get(name, name)
    text_of_slot = (
        (planar_slot_text(name) if flat else None)
        or _SLOT_TEXTS.get(slot)
        or _stored_expression(slot)
    )
    if text_of_slot is None:
        return None
    text = f"{text_of_slot} + {entry_index.rstrip(']')}" if entry_index else text_of_slot
    return SlotExpression(
        text, {variable for variable in VARIABLES if reads_variable(text, variable)}
    )


def _derivative_expression(slot: str) -> SlotExpression | None:
    value = slot_expression(slot)
    if value is None:
        return None
    text = _derivative_text(value.text) or "mstmm_zeros"
    return SlotExpression(
        text, {variable for variable in VARIABLES if reads_variable(text, variable)}
    )


#: Row index in a loop over rows, by slot.
_ROW_INDICES = {
    "line.known": "closure->rows[c]", "line.x": "closure->rows[c]",
    "line.previous_x": "closure->rows[c]", "other.known": "other->row", "other.x": "other->row",
    "pending.known": "pending->row", "pending.x": "pending->row",
    "pending.previous_x": "pending->row", "own.previous_x": "own->row",
    "own.known": "own->row", "own.x": "own->row",
    "bent.known": "bent->row", "bent.x": "bent->row",
}  # fmt: skip


def _stored_expression(slot: str) -> str | None:
    owner, _, name = slot.partition(".")
    if owner in ROLES:
        inner = f"body.{'motion' if name == 'w' else name}"
        inner = SHARED_SLOTS.get(inner, inner)
        return f"{owner} + MSTMM_BLOCK_{BLOCK_SLOTS[inner]}" if inner in BLOCK_SLOTS else None
    if slot in BLOCK_SLOTS:
        return f"block + MSTMM_BLOCK_{BLOCK_SLOTS[slot]}"
    if slot in SPEED_SLOTS:
        return f"mstmm_of_speeds(block, nu, MSTMM_SPEED_{SPEED_SLOTS[slot]})"
    if slot in _ROW_INDICES:
        return f"loops + MSTMM_ROW * (int64_t){_ROW_INDICES[slot]} + {_macro_name('row.' + name)}"
    layout = LAYOUTS.get(owner)
    if layout is not None and name in layout.names.split():
        return f"{layout.start} + {_macro_name(slot)}{layout.arguments}"
    return f"{_RECORDS[owner]}{name}" if owner in _RECORDS else None


#: Factor of a length -> C expression of a macro.
_FACTORS = {"n": "(size_t)(n)", "n n": "(size_t)(n) * (n)"} | {
    f"{a} {b}".strip(): f"({a}) * ({b})" if b else f"({a})"
    for a, b in (("nu", ""), ("nu", "nu"), ("nq", "nq"), ("nq", "nu"))
}


def _layout_macros(owner: str) -> list[str]:
    """C constants or macros of the offsets of a layout, and of its length."""
    layout = LAYOUTS[owner]
    total, lines = f"MSTMM_{owner.upper()}" + "_NUMBERS" * bool(layout.parameters), []
    for slot, offset in layout.offsets(owner).items():
        terms = [f"{n} * {_FACTORS[size]}" if size else str(n) for size, n in offset.items() if n]
        text = " + ".join(terms) or ("0 * (size_t)(n)" if layout.parameters == "(n)" else "0")
        name = _macro_name(slot) if slot else total
        text = f"({text})" if layout.parameters else text
        lines.append(f"#define {name}{layout.parameters} {text}")
    return lines


def _per_mode_constants(owner: str) -> list[str]:
    """C constants of the slots whose offset is a multiple of the number of modes."""
    return [
        f"#define {_macro_name(slot)}_PER_MODE {offset['n']}"
        for slot, offset in LAYOUTS[owner].offsets(owner).items()
        if slot and offset.total() == offset["n"]
    ]


def reads_variable(text: str, word: str) -> bool:
    """Whether a C expression names a variable (no member of a record)."""
    return re.search(rf"(?<![\w>.]){word}\b", text) is not None


def slot_size(slot: str) -> str:
    """C expression of the length of a slot."""
    name, _, entry_index = slot.removeprefix(D).partition("[")
    if entry_index:
        return "1"
    if name.startswith("law."):
        return "law->n"
    owner, _, slot_name = name.partition(".")
    factors = SLOTS[f"body.{slot_name}" if owner in ROLES else name].size.split()
    return " * ".join({"nu": "nu", "n": "n"}.get(factor, factor) for factor in factors)


def layout_header() -> str:
    """`layout.h`: offsets of a body's numbers in the workspace."""
    block, offset = list[str](), 0
    for slot, name in BLOCK_SLOTS.items():
        block.append(f"#define MSTMM_BLOCK_{name} {offset}")
        offset += size_terms(slot).total()
    block.append(f"#define MSTMM_BLOCK_FIXED {offset}")
    speeds, offset = list[str](), 0
    for slot, name in SPEED_SLOTS.items():
        speeds.append(f"#define MSTMM_SPEED_{name} {offset}")
        offset += size_terms(slot).total()
    speeds.append(f"#define MSTMM_BLOCK_PER_SPEED {offset}")

    def macros(*owners: str) -> list[str]:
        return [line for owner in owners for line in _layout_macros(owner)]

    return "\n".join([
        "/* Generated by mstmm; do not edit.  Numbers of a body's block in the workspace; the",
        " * ground's block comes first. */",
        "#ifndef MSTMM_LAYOUT_H", "#define MSTMM_LAYOUT_H", "", "/* cdef begin */", *block,
        "/* Behind them arrays of the speeds, from FIXED + their number times the speeds. */",
        *speeds,
        "/* Flexible bodies and sections: arrays after a number of values per mode. */",
        *_per_mode_constants("modes"), *_per_mode_constants("section"),
        "/* A cut hinge; a coupling; a row. */", *macros("closure", "coupling", "row"),
        "/* A body in a plane, and the values of its record. */", *planar_layout(),
        "/* cdef end */", "",
        "/* Arrays of a flexible body of n modes, and of one of its sections. */",
        *macros("modes", "section"),
        "/* Data of the tangent for a body, a flexible body, a section. */",
        *macros("tangent", "place", "bend", "port"), "", "#endif", "",
    ])  # fmt: skip
