"""Differentiated passes: the same calls on the same slots, and on their derivatives.

The derivative of slot `x` along a direction is the slot `d:x`.  It has the same position in a
second workspace; the derivative of constant data is zero.  A differentiated pass runs after the
pass itself, whose slots it reads; values that the pass kept only in local arrays are recomputed.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from .pass_steps import Add, Call, Copy, EachSpeed, Evaluate, ForEach, Gather, Pass, RunPass, Step

#: Prefix of the derivative of a slot.
D = "d:"
#: Suffix of differentiated kernels and passes.
SLOPE = "_slope"
#: Conditions whose steps are not differentiated: energy sums, and code for one scene.
_SKIPPED_TRAITS = ("balance", "staged")


def differentiate_pass(whole: Pass) -> Pass:
    """Pass that computes the derivatives of a pass."""
    return replace(
        whole,
        name=whole.name + SLOPE,
        purpose=f"Derivatives: {whole.purpose[0].lower()}{whole.purpose[1:]}",
        steps=tuple(slopes(whole.steps)),
        given=tuple(D + slot for slot in whole.given),
    )


def slopes(steps: Iterable[Step]) -> Iterator[Step]:
    """Steps and their derivatives, in an executable order."""
    retained = [
        step for step in steps if not any((trait, True) in step.traits for trait in _SKIPPED_TRAITS)
    ]
    uses = Counter(_local_slots(retained))
    reused = {slot for slot, calls in uses.items() if calls > 1}
    for step in retained:
        yield from _derivative_steps(step, reused)
        reused -= set(_local_slots([step]))  # computed from here on


def _local_slots(steps: Iterable[Step]) -> Iterator[str]:
    """Local arrays that calls write or read, once per call."""
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


def _derivative_steps(step: Step, reused: set[str]) -> Iterator[Step]:
    """Derivative of a step, preceded by the step if it computes `reused` local arrays."""
    if isinstance(step, Call):
        if any(slot in reused for _, slot in step.ports):
            yield step
        yield DifferentiatedCall(step.when, step.kernel + SLOPE, step.ports)
    elif isinstance(step, (Copy, Add)):
        if step.to in reused:
            yield step
        yield replace(step, to=D + step.to, source=D + step.source if step.source else "")
    elif isinstance(step, (Gather, Evaluate)):
        yield step
        yield replace(step, to=D + step.to)
    elif isinstance(step, (ForEach, EachSpeed)):
        yield replace(
            step, steps=tuple(part for s in step.steps for part in _derivative_steps(s, reused))
        )
    elif isinstance(step, RunPass):
        assert step.whole is not None
        yield replace(step, whole=differentiate_pass(step.whole))
    else:
        raise ValueError(f"no derivative of a {type(step).__name__}")


@dataclass(frozen=True)
class DifferentiatedCall(Call):
    """Call of a differentiated kernel.

    `ports` are those of the kernel itself; those in `still` have zero derivative.
    """

    still: tuple[str, ...] = ()


def differentiate_call(step: Call, *ports: str) -> DifferentiatedCall:
    """Derivative of a call in which these ports are constant."""
    return DifferentiatedCall(step.when, step.kernel + SLOPE, step.ports, still=ports)


def ports_of(step: Call) -> dict[str, str]:
    """port -> slot; for differentiated kernels with the ports of derivatives."""
    ports = dict(step.ports)
    if isinstance(step, DifferentiatedCall):
        ports |= {f"d_{port}": D + slot for port, slot in ports.items()}
        ports |= {f"d_{port}": "zero" for port in step.still}
    return ports
