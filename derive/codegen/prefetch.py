"""Prefetching of the data that a pass reads and writes of a body."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import astuple, dataclass, replace
from math import prod

from ..schedule.differentiated_passes import D, ports_of
from ..schedule.pass_steps import Call, EachSpeed, ForEachDirection, Pass, RunPass, Step
from ..schedule.slot_definitions import SLOTS
from .slot_storage import (
    BLOCK_SLOTS,
    SHARED_SLOTS,
    SPEED_SLOTS,
    TANGENT_SLOTS,
    VARIABLES,
    reads_variable,
    slot_expression,
    slot_size,
)
from .step_text import is_fused_only

_SLOT_ATTRIBUTES = ("to", "source", "free", "imposed")
_BODY_VARIABLES = ("block", "d_block", "tangent", "nu", "nq")
#: Traits of steps that concern few bodies of a scene.
_RARE_TRAITS = {
    **dict.fromkeys(
        ("modal", "section", "outward", "placed", "drag", "imposed", "parts", "curved"), True
    ),
    "directed": False,
}
#: Scene data that passes read of a body, stored contiguously
#: (runtime/packing/records/body_records.py).
_RECORD_SLOTS = ("connection.R", "body.rotor", "hinge.p", "body.p")
_RECORD_STARTS = ("body->connection", "body->rotor", "body->hinge_p", "body->body_p")
_RECORD_ENDS = (
    "body->rotor",
    "body->hinge_p",
    "body->body_p",
    "body->body_p + MSTMM_RIGID_NUMBERS",
)
#: Largest gap that is fetched as well: a cache line holds eight numbers.
_MAX_GAP = 8


@dataclass(frozen=True)
class _MemoryRange:
    """Contiguous numbers, `begin` to `end` for a hinge of one speed, and as C expressions."""

    variable: str
    start: int
    end: int
    first: str
    last: str


def prefetch_function(name: str, passes: Iterable[Pass]) -> str:
    """C function that prefetches the data of body `index` for the passes; "" if none.

    Planar passes need none: the data of a body are small enough for the hardware prefetcher."""
    passes = [sweep_pass for sweep_pass in passes if not sweep_pass.flat]
    slots = {
        slot
        for sweep_pass in passes
        if sweep_pass.subject == "body"
        for slot in _slots_of_pass(sweep_pass)
    }
    stretches = _merge_ranges(stretch for slot in slots if (stretch := _range_of_slot(slot)))
    if not stretches:
        return ""
    lines = [f"    mstmm_fetch({span.first}, {span.last});" for span in stretches]
    record_indices = [index for index, slot in enumerate(_RECORD_SLOTS) if slot in slots]
    if record_indices:
        lines.append(
            f"    mstmm_fetch({_RECORD_STARTS[record_indices[0]]}, "
            f"{_RECORD_ENDS[record_indices[-1]]});"
        )
    variables_read = [
        variable
        for variable in _BODY_VARIABLES
        if any(reads_variable(line, variable) for line in lines)
    ]
    declarations = [f"    {VARIABLES[variable][0]}" for variable in variables_read]
    parameters = "const mstmm_state *state, int index, int ahead"
    return (
        f"MSTMM_AT_ONCE void mstmm_fetch_{name}({parameters})\n{{\n"
        "    const mstmm_body *body = mstmm_coming(state->model, index, ahead);\n"
        "    if (!body) return;\n" + "\n".join([*declarations, *lines]) + "\n}\n"
    )


def _slots_of_pass(whole: Pass) -> Iterator[str]:
    for step in whole.steps:
        yield from _slots_of_step(step)


def _slots_of_step(step: Step) -> Iterator[str]:
    if is_fused_only(step) or any(
        _RARE_TRAITS.get(trait) == trait_value for trait, trait_value in step.traits
    ):
        return
    if isinstance(step, RunPass) and step.whole is not None:
        yield from _slots_of_pass(step.whole)
    elif isinstance(step, (EachSpeed, ForEachDirection)):
        for part in step.steps:
            yield from _slots_of_step(part)
    elif isinstance(step, Call):
        yield from ports_of(step).values()
    else:
        yield from (str(value) for name, value in vars(step).items() if name in _SLOT_ATTRIBUTES)


def _range_of_slot(slot: str) -> _MemoryRange | None:
    """Memory range of a slot of the body itself; None for other slots."""
    name = slot.partition("[")[0]
    slot_name = name.removeprefix(D)
    begin = _OFFSETS.get(SHARED_SLOTS.get(slot_name, slot_name))
    slot_location = slot_expression(name)
    if begin is None or slot_location is None or slot_name not in SLOTS:
        return None
    numbers = prod(
        int(variable) for variable in SLOTS[slot_name].size.split() if variable.isdigit()
    )
    variables_read = (
        variable
        for variable in ("d_block", "block", "tangent")
        if reads_variable(slot_location.text, variable)
    )
    end_text = f"{slot_location.text} + {slot_size(slot_name).replace('free', 'nu')}"
    return _MemoryRange(
        next(variables_read, "body"), begin, begin + numbers, slot_location.text, end_text
    )


def _merge_ranges(stretches: Iterable[_MemoryRange]) -> list[_MemoryRange]:
    """Merge stretches separated by small gaps."""
    merged: list[_MemoryRange] = []
    for stretch in sorted(stretches, key=astuple):
        previous = merged[-1] if merged else None
        if (
            previous is None
            or previous.variable != stretch.variable
            or stretch.start > previous.end + _MAX_GAP
        ):
            merged.append(stretch)
        elif stretch.end > previous.end:
            merged[-1] = replace(previous, end=stretch.end, last=stretch.last)
    return merged


def _slot_offsets(layouts: Iterable[Iterable[tuple[str, int]]]) -> dict[str, int]:
    """Offset of each slot in its layout, for a hinge of one speed."""
    offsets: dict[str, int] = {}
    for layout in layouts:
        offset = 0
        for slot, count in layout:
            offsets[slot] = offset
            offset += count
    return offsets


_OFFSETS = _slot_offsets(
    (
        [(slot, int(SLOTS[slot].size)) for slot in BLOCK_SLOTS]
        + [(slot, count) for slot, (_, count) in SPEED_SLOTS.items()],
        [(slot, sum(counts)) for slot, counts in TANGENT_SLOTS.items()],
    )
)
