"""Passes differentiated: the same calls over the same slots, and their derivatives beside them.

Of a slot `x` the derivative along a direction is the slot `d:x`.  It lies where `x` lies, in a
second workspace; of numbers that no state moves it is zero.  A differentiated pass runs behind the
pass itself, whose slots it reads; what the pass kept in local arrays alone is made again.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from .pass_steps import Add, Call, Copy, EachSpeed, Evaluate, ForEach, Gather, Pass, RunPass, Step

#: Prefix of the derivative of a slot.
D = "d:"
#: Suffix of a kernel's derivative, and of a pass's.
SLOPE = "_slope"
#: Conditions under which derivatives have nothing to do: sums of energy, code for one scene.
_WITHOUT = ("balance", "staged")


def differentiate_pass(whole: Pass) -> Pass:
    """The derivative of a pass."""
    return replace(
        whole,
        name=whole.name + SLOPE,
        purpose=f"Derivatives: {whole.purpose[0].lower()}{whole.purpose[1:]}",
        steps=tuple(slopes(whole.steps)),
        given=tuple(D + slot for slot in whole.given),
    )


def slopes(steps: Iterable[Step]) -> Iterator[Step]:
    """Steps and their derivatives, in an order in which both can be done."""
    kept = [step for step in steps if not any((trait, True) in step.traits for trait in _WITHOUT)]
    met = Counter(_local_slots(kept))
    wanted = {slot for slot, calls in met.items() if calls > 1}
    for step in kept:
        yield from _step(step, wanted)
        wanted -= set(_local_slots([step]))  # made by now


def _local_slots(steps: Iterable[Step]) -> Iterator[str]:
    """Local arrays that calls fill or read, once a call."""
    for step in steps:
        if isinstance(step, Call):
            yield from (slot.partition("[")[0] for _, slot in step.ports if _is_local(slot))
        elif isinstance(step, Evaluate):
            yield from (slot for slot in (step.to, *dict(step.given).values()) if _is_local(slot))
        elif isinstance(step, (Gather, Copy)) and _is_local(step.to):
            yield step.to
        elif isinstance(step, (ForEach, EachSpeed)):
            yield from _local_slots(step.steps)


def _is_local(slot: str) -> bool:
    return slot.startswith("local.")


def _step(step: Step, wanted: set[str]) -> Iterator[Step]:
    """A step differentiated, behind the step itself where it makes local arrays that are wanted."""
    if isinstance(step, Call):
        if any(slot in wanted for _, slot in step.ports):
            yield step
        yield DifferentiatedCall(step.when, step.kernel + SLOPE, step.ports)
    elif isinstance(step, (Copy, Add)):
        if step.to in wanted:
            yield step
        yield replace(step, to=D + step.to, source=D + step.source if step.source else "")
    elif isinstance(step, (Gather, Evaluate)):
        yield step
        yield replace(step, to=D + step.to)
    elif isinstance(step, (ForEach, EachSpeed)):
        yield replace(step, steps=tuple(part for s in step.steps for part in _step(s, wanted)))
    elif isinstance(step, RunPass):
        assert step.whole is not None
        yield replace(step, whole=differentiate_pass(step.whole))
    else:
        raise ValueError(f"no derivative of a {type(step).__name__}")


@dataclass(frozen=True)
class DifferentiatedCall(Call):
    """A call of a differentiated kernel: `ports` are those of the kernel itself, of which those in
    `still` do not move."""

    still: tuple[str, ...] = ()


def differentiate_call(step: Call, *ports: str) -> DifferentiatedCall:
    """The derivative of a call in which these ports do not move."""
    return DifferentiatedCall(step.when, step.kernel + SLOPE, step.ports, still=ports)


def ports_of(step: Call) -> dict[str, str]:
    """port -> slot; a differentiated kernel has ports of derivatives besides."""
    ports = dict(step.ports)
    if isinstance(step, DifferentiatedCall):
        ports |= {f"d_{port}": D + slot for port, slot in ports.items()}
        ports |= {f"d_{port}": "zero" for port in step.still}
    return ports
