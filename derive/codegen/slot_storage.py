"""C expressions of the storage of schedule slots in the looped engine."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

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
#: Slots after them: slot -> (C name, numbers per speed).
SPEED_SLOTS = {
    "body.s": ("S", 1), "body.tau": ("TAU", 1), "hinge.H": ("H", 6), "hinge.g": ("OFFSET", 1),
    "hinge.rates": ("RATES", 1), "hinge.G": ("GAIN", 6), "hinge.H_free": ("H_FREE", 6),
}  # fmt: skip
#: Numbers of a flexible body in the workspace: slot -> (per mode, per pair of modes).
MODE_SLOTS = {
    "modes.S_rf": (6, 0), "modes.S_rf_I": (6, 0), "modes.A": (6, 0), "modes.right": (7, 0),
    "modes.gain": (7, 0), "modes.A_drag": (6, 0), "modes.S_ff": (0, 1),
    "modes.work": (0, 1), "modes.e_f": (1, 0), "modes.etadd": (1, 0),
}  # fmt: skip
#: Numbers of a section in the workspace: slot -> (per mode, others).
SECTION_SLOTS = {
    "section.Phi": (6, 0), "section.H": (6, 0), "section.push": (6, 0), "section.H6": (0, 36),
    "section.x": (0, 3), "section.Psi": (0, 3), "section.xd": (0, 3), "section.Psid": (0, 3),
    "section.xdd": (0, 3), "section.Psidd": (0, 3), "section.dC1": (6, 0), "section.dC2": (6, 0),
    "section.S_rf": (6, 0),
}  # fmt: skip
#: Numbers of the tangent by body: slot -> so many, and so many times nu, nu nu, nq nq, nq nu.
TANGENT_SLOTS = {
    "tangent.S": (54, 0, 0, 0, 0), "tangent.B": (0, 9, 0, 0, 0), "tangent.G": (0, 6, 0, 0, 0),
    "tangent.W": (0, 0, 1, 0, 0), "tangent.laws": (0, 0, 1, 0, 0), "tangent.H": (0, 6, 0, 0, 0),
    "tangent.V": (0, 6, 0, 0, 0), "tangent.gain": (0, 9, 0, 0, 0),
    "tangent.inverse": (0, 0, 1, 0, 0), "tangent.y": (0, 1, 0, 0, 0),
    "tangent.known": (9, 0, 0, 0, 0),
    "tangent.along": (0, 0, 0, 0, 1), "tangent.rates_by_speeds": (0, 0, 0, 0, 1),
    "tangent.rates_by_coordinates": (0, 0, 0, 1, 0),
    "tangent.unit": (0, 0, 0, 1, 0), "tangent.rates": (0, 0, 0, 1, 0),
    "tangent.Q": (0, 0, 0, 1, 0), "tangent.Q_work": (0, 0, 0, 1, 0),
}  # fmt: skip
#: Numbers of the tangent of a body whose loads depend on its position.
PLACE_SLOTS = {
    "place.S": (54, 0, 0, 0, 0), "place.z": (9, 0, 0, 0, 0), "place.known": (9, 0, 0, 0, 0),
    "place.B": (0, 9, 0, 0, 0), "place.gain": (0, 9, 0, 0, 0),
}  # fmt: skip
#: Numbers of the tangent by flexible body, and by section: slot -> (per mode, per pair of modes).
BEND_SLOTS = {
    "bend.B": (9, 0), "bend.G": (6, 0), "bend.W": (0, 1), "bend.zero_H": (6, 0), "bend.K": (6, 0),
    "bend.Z_z": (9, 0), "bend.Z_x": (0, 1), "bend.V": (6, 0), "bend.D": (0, 1),
    "bend.right": (9, 0), "bend.gain": (9, 0), "bend.work": (0, 1), "bend.rest": (1, 0),
    "bend.y": (1, 0), "bend.place_B": (9, 0), "bend.place_Z": (9, 0), "bend.place_gain": (9, 0),
}  # fmt: skip
PORT_SLOTS = {
    "port.B": (9, 0), "port.G": (6, 0), "port.W": (0, 1), "port.K": (6, 0),
    "port.place_B": (9, 0), "port.outboard_K": (6, 0), "port.outboard_Z_z": (9, 0),
    "port.outboard_Z_p": (9, 0),
}  # fmt: skip
#: Numbers of a hinge that closes a loop, in their order: slot -> how many.
CLOSURE_SLOTS = {
    "closure.W": 36, "closure.J_A": 36, "closure.J_B": 36, "closure.l": 6, "closure.R_C": 9,
    "closure.d": 3, "closure.lever": 3, "closure.gap": 6, "closure.slip": 6,
}  # fmt: skip
COUPLING_SLOTS = {f"coupling.{name}": 1 for name in scene_structure.COUPLING_NUMBERS}
#: Numbers of a row: slot -> how many.
ROW_SLOTS = {"row.K": 6, "row.known": 1, "row.pivot": 1, "row.inverse": 1, "row.x": 1,
             "row.previous_x": 1}  # fmt: skip
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

_MOMENTS = {
    "p": "rigid", "C": "c", "P": "p", "B": "b",
    **{f"Z_{ab}": f"z[{k}]" for k, ab in enumerate(("xx", "xy", "xz", "yy", "yz", "zz"))},
    **{f"Y_{a}": f"y[{k}]" for k, a in enumerate("xyz")},
    **{f"G_{a}": f"g[{k}]" for k, a in enumerate("xyz")}, "M": "m",
}  # fmt: skip
_STATE = {"given": "given", "efforts": "efforts", "udot": "udot", "required": "required",
          "column": "column", "answer": "answer"}  # fmt: skip


def _station_text(numbers: str, section_slot: str, modal_slot: str) -> str:
    """C expression of columns at the station before a segment; of the modes at the first one."""
    offset = "tangent" if "tangents" in numbers else "place"
    return (
        f"{numbers} + (section->before"
        f" ? section->before->{offset} + {_macro_name(section_slot)}(n)"
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
    **{f"body.{name}": f"state->{to} + body->u" for name, to in _STATE.items()},
    "modes.eta": "state->q + modal->q", "modes.etad": "state->u + modal->u",
    "modes.qdot": "state->qdot + modal->q",
    **{f"modes.{name}": f"state->{to} + modal->u" for name, to in _STATE.items()},
    "modes.K": "modal->stiffness", "modes.D": "modal->damping",
    **{f"moments.{name}": f"modal->moments.{to}" for name, to in _MOMENTS.items()},
    **{f"drag.{name}": f"modal->drag->{to}" for name, to in _MOMENTS.items()},
    "section.b": "section->rest", "section.Bm": "section->shapes",
    "inboard.S_rf": _station_text("state->workspace", "section.S_rf", "modes.S_rf"),
    "inboard.shapes_S_rf": _station_text(_TANGENT_NUMBERS, "port.outboard_K", "bend.V"),
    "inboard.K": _station_text(_TANGENT_NUMBERS, "port.outboard_K", "bend.K"),
    "inboard.Z_z": _station_text(_TANGENT_NUMBERS, "port.outboard_Z_z", "bend.Z_z"),
    "inboard.Z_p": _station_text(_TANGENT_NUMBERS, "port.outboard_Z_p", "bend.place_Z"),
    "section.r": "section->point", "section.phi": "section->phi",
    "section.theta": "section->theta", "section.end": "section->end",
    **{f"section.g_{a}": f"section->drawn[{k}]" for k, a in enumerate("xyz")},
    **{f"section.h_{a}": f"section->turned[{k}]" for k, a in enumerate("xyz")},
    "drive.value": "mstmm_drive_values(state) + 3 * index",
    "drive.rate": "mstmm_drive_values(state) + 3 * index + 1",
    "drive.acceleration": "mstmm_drive_values(state) + 3 * index + 2",
    "drive.q": "mstmm_filled_q(state) + body->q + drive->coordinate",
    "drive.u": "mstmm_filled_u(state) + body->u + drive->speed",
    "drive.s": "block + MSTMM_BLOCK_FIXED + drive->speed",
    "speed.effort": "state->efforts + index", "speed.u": "state->u + index",
    "law.p": "law->p", "law.q": "state->q + body->q + law->coordinate",
    "law.u": "state->u + body->u + law->speed", "law.effort": "law->effort",
    "law.axes": "law->axes", "law.turn": "state->memory + law->twist",
    "law.tau": "block + MSTMM_BLOCK_FIXED + MSTMM_SPEED_TAU * body->nu + law->speed",
    "load.axes_own": "load->axes_own", "load.offset": "load->offset", "load.force": "load->force",
    "load.moment": "load->moment", "force.p": "force->p",
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
    "closure.turn": "closure->turn", "closure.end": "closure->end", "closure.p": "closure->p",
    "row.floor": "mstmm_row_floor(state, row)",
    "line.softness": "&state->model->rows[closure->rows[c]].softness",
    "side.inner": "loops + closure->inner[c]", "side.outer": "loops + closure->outer[c]",
    "pending.K": "loops + pending->column", "pending.onward": "loops + pending->onward",
    "pending.y": "loops + pending->y", "before.y": "loops + looped->pending[b].y",
    "pending.tau": "loops + pending->tau", "own.tau": "loops + own->tau",
    "own.inner": "loops + own->inner", "own.outer": "loops + own->outer",
    "coupling.x": "loops + MSTMM_ROW * (int64_t)coupling->row + MSTMM_ROW_X",
    "coupling.previous_x": "loops + MSTMM_ROW * (int64_t)coupling->row + MSTMM_ROW_PREVIOUS_X",
    "pair.L": "loops + pending->pairs[b]", "pending.modes": "loops + pending->modes",
    "bent.K": "loops + bent->column", "bent.modes": "loops + bent->modes",
    "bent.y": "loops + bent->y", "bent_before.modes": "loops + looped->bent[b].modes",
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
        return f"mstmm_of_speeds(block, nu, MSTMM_SPEED_{SPEED_SLOTS[slot][0]})"
    if slot in CLOSURE_SLOTS:
        return f"closed + {_macro_name(slot)}"
    if slot in COUPLING_SLOTS:
        return f"loops + coupling->numbers + {_macro_name(slot)}"
    if slot in ROW_SLOTS:
        return f"line + {_macro_name(slot)}"
    if slot in _ROW_INDICES:
        return f"loops + MSTMM_ROW * (int64_t){_ROW_INDICES[slot]} + {_macro_name('row.' + name)}"
    for layout, start in (
        (MODE_SLOTS, "modes"),
        (SECTION_SLOTS, "laid"),
        (BEND_SLOTS, "bend"),
        (PORT_SLOTS, "port"),
    ):
        if slot in layout:
            return f"{start} + {_macro_name(slot)}(n)"
    if slot in TANGENT_SLOTS:
        return f"tangent + {_macro_name(slot)}(body->nu, body->nq)"
    if slot in PLACE_SLOTS:
        return f"place + {_macro_name(slot)}(body->nu, body->nq)"
    return None


def _offset_constants(layout: Mapping[str, int], total: str) -> list[str]:
    """C constants of the offsets of a layout, and of its length."""
    lines, offset = [], 0
    for slot, count in layout.items():
        lines.append(f"#define {_macro_name(slot)} {offset}")
        offset += count
    return [*lines, f"#define {total} {offset}"]


def _per_mode_constants(layout: dict[str, tuple[int, int]]) -> list[str]:
    """C constants of the slots whose offset is a multiple of the number of modes."""
    lines, count = [], 0
    for slot, (per_mode, per_pair) in layout.items():
        lines.append(f"#define {_macro_name(slot)}_PER_MODE {count}")
        count += per_mode
        if per_pair:
            break
    return lines


def _offset_macros(layout: dict[str, tuple[int, int]], second: str) -> list[str]:
    """C macros of the offsets of a layout, by the number of modes."""
    lines, counts = [], [0, 0]
    for slot, sizes in layout.items():
        lines.append(
            f"#define {_macro_name(slot)}(n) ({counts[0]} * (size_t)(n) + {counts[1]}{second})"
        )
        counts = [a + b for a, b in zip(counts, sizes, strict=True)]
    return lines


_PAIRS = " * (size_t)(n) * (n)"


def _speed_offset_macros(layout: Mapping[str, tuple[int, ...]], total: str) -> list[str]:
    """C macros of offsets by the speeds and coordinates of a hinge, and of the `total` length."""
    lines, counts = [], [0] * 5

    def macro(name: str) -> str:
        terms = zip(counts, ("1", "(nu)", "(nu) * (nu)", "(nq) * (nq)", "(nq) * (nu)"), strict=True)
        return (
            f"#define {name}(nu, nq) "
            f"({' + '.join(f'{n} * {factor}' for n, factor in terms if n) or 0})"
        )

    for slot, sizes in layout.items():
        lines.append(macro(_macro_name(slot)))
        counts = [a + b for a, b in zip(counts, sizes, strict=True)]
    return [*lines, macro(total)]


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
    lines, offset = [], 0
    for slot, name in BLOCK_SLOTS.items():
        lines.append(f"#define MSTMM_BLOCK_{name} {offset}")
        offset += int(SLOTS[slot].size)
    lines.append(f"#define MSTMM_BLOCK_FIXED {offset}")
    speed_offset, rows = 0, []
    for name, count in SPEED_SLOTS.values():
        rows.append(f"#define MSTMM_SPEED_{name} {speed_offset}")
        speed_offset += count
    rows.append(f"#define MSTMM_BLOCK_PER_SPEED {speed_offset}")
    return (
        "/* Generated by mstmm; do not edit.  Numbers of a body's block in the workspace; the\n"
        " * ground's block comes first. */\n"
        "#ifndef MSTMM_LAYOUT_H\n#define MSTMM_LAYOUT_H\n\n/* cdef begin */\n"
        + "\n".join(lines)
        + "\n/* Behind them arrays of the speeds, from FIXED + their number times the speeds. */\n"
        + "\n".join(rows)
        + "\n/* Flexible bodies and sections: arrays after a number of values per mode. */\n"
        + "\n".join([*_per_mode_constants(MODE_SLOTS), *_per_mode_constants(SECTION_SLOTS)])
        + "\n/* A cut hinge; a coupling; a row. */\n"
        + "\n".join(
            [
                *_offset_constants(CLOSURE_SLOTS, "MSTMM_CLOSURE"),
                *_offset_constants(COUPLING_SLOTS, "MSTMM_COUPLING"),
                *_offset_constants(ROW_SLOTS, "MSTMM_ROW"),
            ]
        )
        + "\n/* A body in a plane, and the values of its record. */\n"
        + "\n".join(planar_layout())
        + "\n/* cdef end */\n\n"
        + "/* Arrays of a flexible body of n modes, and of one of its sections. */\n"
        + "\n".join([*_offset_macros(MODE_SLOTS, _PAIRS), *_offset_macros(SECTION_SLOTS, "")])
        + "\n/* Data of the tangent for a body, a flexible body, a section. */\n"
        + "\n".join(
            [
                *_speed_offset_macros(TANGENT_SLOTS, "MSTMM_TANGENT_NUMBERS"),
                *_speed_offset_macros(PLACE_SLOTS, "MSTMM_PLACE_NUMBERS"),
                *_offset_macros(BEND_SLOTS, _PAIRS),
                *_offset_macros(PORT_SLOTS, _PAIRS),
            ]
        )
        + "\n\n#endif\n"
    )
