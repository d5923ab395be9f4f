"""Passes in a plane: of scenes with closed loops where every hinge is a free pin and all pins are
parallel.

What such a scene has is known beforehand: steps whose conditions do not hold go, and conditions
that do.  Kernels are those in a plane, where there are such.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from .pass_steps import (
    Add,
    Call,
    Copy,
    EachSpeed,
    ForEach,
    Move,
    Pass,
    Run,
    RunPass,
    ScatterSpeeds,
    SelectColumns,
    Step,
    Sweep,
)

#: Entries of a load or a direction that lie in the plane.
LOAD = (0, 1, 5)
#: What holds of such a scene, and of evaluations of accelerations that nobody observes.
_HOLDS = {
    **dict.fromkeys(("own", "free", "moving", "hinged", "known", "posed", "looped"), True),
    **dict.fromkeys(
        ("parts", "whole", "staged", "section", "outward", "modal", "imposed", "distance", "plane",
         "rolling", "coupled", "soft", "corrected", "gaping", "placing", "slipping", "refined",
         "inverse", "weightless", "balance", "kept", "unmoved", "linked", "driven", "flexible",
         "couplings", "product", "qr"), False,
    ),
}  # fmt: skip
#: What could be met one by one, and is not there.
_NONE = ("own", "bent")
#: Kernels that there are in a plane.
_KERNELS = {
    "hinge.forward", "body.inertia", "body.bias_load",
    *(f"frames.{name}" for name in (
        "pose", "velocity", "point", "turning", "end_frame", "applied_load",
    )),
    *(f"generic{{free}}.{name}" for name in (
        "factor", "push", "push_on_ground", "answer", "divide", "couple", "answered", "pull",
    )),
    *(f"loops.{name}" for name in (
        "meet", "slip", "drift", "row", "known", "told", "act", "close", "shed", "multiplier_more",
    )),
}  # fmt: skip
#: What nobody asks of the frame of a hinge that closes a loop.
_OF_MASS = {"body.inertia", "body.bias_load"}
#: Slots of the free speeds -> those of all speeds; rows of a hinge -> where they are carried from;
#: what is the same in every position -> where it is given.
_SLOTS = {
    "hinge.J_free": "body.rotor", "hinge.tau_free": "body.tau", "hinge.rates": "body.udot",
    "closure.J_A[6 * c]": "side.inner", "closure.J_B[6 * c]": "side.outer",
    "closure.W": "plane", "closure.W[6 * k]": "plane", "closure.W[6 * c]": "plane[3 * c]",
    "body.r": "connection.r", "hinge.p": "none",
}  # fmt: skip
#: What no later pass reads.
_PASSING = {f"closure.{name}": f"local.{name}" for name in ("R_C", "lever", "d", "slip")}
#: Ports of what is the same for all pins, or zero.
_SAME = {
    ("H", "hinge.H_free"), ("H", "hinge.H"), ("v_rel", "hinge.v"), ("W", "zero"),
    ("s", "body.s"), ("delta", "zero"), ("gravity", "zero"),
}  # fmt: skip
#: What a plane has no need to write: it stands in its records.
_WRITTEN = {"generic{nu}.complement", "frames.pivot_floor"}
#: Nobody asks rows for more than the bodies' own motions do.
_UNASKED = {"rows_asked"}
#: A pin prescribes nothing.
_NOTHING = "body.s"


def sweep_in_plane(whole: Sweep) -> Sweep:
    """The sweep for scenes in a plane.  Loops are closed as soon as the bodies are known that they
    close on, before anything else acts on these."""
    runs = [run for run in _steps(whole.runs) if isinstance(run, Run) and _has_part(run)]
    begun, closed = _taken(runs, "rows_begun"), _taken(runs, "closures_in_plane")
    acting = next(k for k, run in enumerate(runs) if run.whole and run.whole.subject == "load")
    found = (begun, *runs[:acting], closed, *runs[acting:])
    return replace(whole, name=f"{whole.name}_in_plane", runs=found)


def _has_part(run: Run) -> bool:
    return bool(run.whole.steps) if run.whole else run.hook not in _UNASKED


def _taken(runs: list[Run], name: str) -> Run:
    """The run of this name, which is none of the others from now on."""
    at = [run.whole.name if run.whole else run.hook for run in runs].index(name)
    return runs.pop(at)


def _in_plane(whole: Pass) -> Pass:
    """The pass for scenes in a plane, whose closed loops are met one by one."""
    spares = "" if "linked" in whole.spares_links.split() else whole.spares_links
    subject, skip = ("closure", "") if whole.skip == "!cut" else (whole.subject, whole.skip)
    return replace(
        whole, name=f"{whole.name}_in_plane", subject=subject, skip=skip, given=(), flat=True,
        steps=tuple(_steps(whole.steps)), spares_links=spares,
    )  # fmt: skip


def _steps(steps: tuple[Step, ...]) -> Iterator[Step]:
    for step in steps:
        if any(_HOLDS.get(trait, wanted) != wanted for trait, wanted in step.traits):
            continue
        if isinstance(step, (SelectColumns, ScatterSpeeds)) or (
            isinstance(step, ForEach) and step.of in _NONE
        ):
            continue
        if isinstance(step, Call) and step.kernel in _WRITTEN:
            continue
        if isinstance(step, Copy) and step.to == _NOTHING:
            continue
        if isinstance(step, Move) and _SLOTS.get(step.source) == step.to:
            continue
        if isinstance(step, EachSpeed):
            yield from map(_of_the_speed, _steps(step.steps))
            continue
        left = [word for word in step.when.split() if word.lstrip("!") not in _HOLDS]
        if isinstance(step, Call) and step.kernel in _OF_MASS:
            left.append("!aside")
        yield _replaced(replace(step, when=" ".join(left)))


def _replaced(step: Step) -> Step:
    if isinstance(step, (RunPass, Run)) and step.whole is not None:
        return replace(step, whole=_in_plane(step.whole))
    if isinstance(step, ForEach):
        return replace(step, steps=tuple(_steps(step.steps)))
    if isinstance(step, Copy) and step.source == _NOTHING:
        return replace(step, source="")
    if isinstance(step, Call) and step.kernel in _KERNELS:
        return _in_plane_called(step)
    return step


def _of_the_speed(step: Step) -> Step:
    """A step for every speed, of which a pin has one."""
    if isinstance(step, Add):
        return replace(step, to=step.to.replace("[k]", "[0]"))
    assert isinstance(step, Call)
    ports = tuple((port, slot.partition("[")[0]) for port, slot in step.ports)
    return replace(step, ports=ports)


def _in_plane_called(step: Call) -> Call:
    kernel = step.kernel.partition(".")[2]
    ports = tuple(
        (port, _SLOTS.get(slot, _PASSING.get(slot, slot)))
        for port, slot in step.ports
        if (port, slot) not in _SAME and (kernel, port) != ("forward", "r")
    )
    return replace(step, kernel=f"planar.{kernel}", ports=ports)
