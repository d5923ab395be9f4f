"""Prefetching of the data that a pass reads and writes of a body."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import astuple, dataclass, replace
from math import prod

from ..schedule.slope import D, ports_of
from ..schedule.steps import Along, Call, Do, EachSpeed, Pass, Step
from ..schedule.words import SLOTS
from .steps import never
from .storage import BLOCK, PER_SPEED, SHARED, TANGENT, VARIABLES, place, reads, size_of

_NAMED = ("to", "source", "free", "imposed")
_VARIABLES = ("block", "d_block", "tangent", "nu", "nq")
#: Traits of steps that concern few bodies of a scene.
_RARE = {
    **dict.fromkeys(
        ("modal", "section", "outward", "placed", "drag", "imposed", "parts", "curved"), True
    ),
    "directed": False,
}
#: Scene data that passes read of a body, stored contiguously (runtime/pack/records/bodies.py).
_GIVEN = ("connection.R", "body.rotor", "hinge.p", "body.p")
_FIRST = ("body->connection", "body->rotor", "body->hinge_p", "body->body_p")
_LAST = ("body->rotor", "body->hinge_p", "body->body_p", "body->body_p + MSTMM_RIGID_NUMBERS")
#: Largest gap that is fetched as well: a cache line holds eight numbers.
_LINE = 8


@dataclass(frozen=True)
class _Stretch:
    """Contiguous numbers, `begin` to `end` for a hinge of one speed, and as C expressions."""

    variable: str
    begin: int
    end: int
    first: str
    last: str


def fetching(name: str, passes: Iterable[Pass]) -> str:
    """C function that prefetches the data of body `index` for the passes; "" if none.

    Planar passes need none: the data of a body are small enough for the hardware prefetcher."""
    passes = [whole for whole in passes if not whole.flat]
    slots = {slot for whole in passes if whole.subject == "body" for slot in _slots(whole)}
    stretches = _merged(stretch for slot in slots if (stretch := _stretch(slot)))
    if not stretches:
        return ""
    lines = [f"    mstmm_fetch({one.first}, {one.last});" for one in stretches]
    told = [at for at, slot in enumerate(_GIVEN) if slot in slots]
    if told:
        lines.append(f"    mstmm_fetch({_FIRST[told[0]]}, {_LAST[told[-1]]});")
    used = [word for word in _VARIABLES if any(reads(line, word) for line in lines)]
    declared = [f"    {VARIABLES[word][0]}" for word in used]
    given = "const mstmm_state *state, int index, int ahead"
    return (
        f"MSTMM_AT_ONCE void mstmm_fetch_{name}({given})\n{{\n"
        "    const mstmm_body *body = mstmm_coming(state->model, index, ahead);\n"
        "    if (!body) return;\n" + "\n".join([*declared, *lines]) + "\n}\n"
    )


def _slots(whole: Pass) -> Iterator[str]:
    for step in whole.steps:
        yield from _slots_of(step)


def _slots_of(step: Step) -> Iterator[str]:
    if never(step) or any(_RARE.get(trait) == wanted for trait, wanted in step.traits):
        return
    if isinstance(step, Do) and step.whole is not None:
        yield from _slots(step.whole)
    elif isinstance(step, (EachSpeed, Along)):
        for part in step.steps:
            yield from _slots_of(part)
    elif isinstance(step, Call):
        yield from ports_of(step).values()
    else:
        yield from (str(value) for name, value in vars(step).items() if name in _NAMED)


def _stretch(slot: str) -> _Stretch | None:
    """Memory range of a slot of the body itself; None for other slots."""
    name = slot.partition("[")[0]
    own = name.removeprefix(D)
    begin = _PLACES.get(SHARED.get(own, own))
    found = place(name)
    if begin is None or found is None or own not in SLOTS:
        return None
    numbers = prod(int(word) for word in SLOTS[own].size.split() if word.isdigit())
    named = (word for word in ("d_block", "block", "tangent") if reads(found.text, word))
    last = f"{found.text} + {size_of(own).replace('free', 'nu')}"
    return _Stretch(next(named, "body"), begin, begin + numbers, found.text, last)


def _merged(stretches: Iterable[_Stretch]) -> list[_Stretch]:
    """Merge stretches separated by small gaps."""
    found: list[_Stretch] = []
    for one in sorted(stretches, key=astuple):
        before = found[-1] if found else None
        if before is None or before.variable != one.variable or one.begin > before.end + _LINE:
            found.append(one)
        elif one.end > before.end:
            found[-1] = replace(before, end=one.end, last=one.last)
    return found


def _laid(layouts: Iterable[Iterable[tuple[str, int]]]) -> dict[str, int]:
    """Offset of each slot in its layout, for a hinge of one speed."""
    found: dict[str, int] = {}
    for layout in layouts:
        at = 0
        for slot, count in layout:
            found[slot] = at
            at += count
    return found


_PLACES = _laid(
    (
        [(slot, int(SLOTS[slot].size)) for slot in BLOCK]
        + [(slot, count) for slot, (_, count) in PER_SPEED.items()],
        [(slot, sum(counts)) for slot, counts in TANGENT.items()],
    )
)
