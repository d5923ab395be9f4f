"""Passes in a plane: of scenes with closed loops where every hinge is a free pin and all pins are
parallel.

What such a scene has is known beforehand: steps whose conditions do not hold go, and conditions
that do.  Kernels are those in a plane, where there are such.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from .steps import Call, Do, Each, EachSpeed, Move, Pass, Pick, Run, Spread, Step, Sweep

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
    *("hinge.forward", "body.inertia", "body.bias_load", "frames.pose", "frames.velocity"),
    *(f"generic{{free}}.{name}" for name in (
        "factor", "push", "push_on_ground", "answer", "divide", "couple", "answered", "pull",
    )),
    *(f"loops.{name}" for name in (
        "meet", "slip", "drift", "row", "known", "told", "act", "close", "shed", "multiplier_more",
    )),
}  # fmt: skip
#: What nobody asks of the frame of a hinge that closes a loop.
_OF_MASS = {"body.inertia", "body.bias_load", "frames.pivot_floor"}
#: Slots of the free speeds -> those of all speeds; rows of a hinge -> where they are carried from.
_SLOTS = {
    "hinge.J_free": "body.rotor", "hinge.tau_free": "body.tau", "hinge.rates": "body.udot",
    "closure.J_A[6 * c]": "side.inner", "closure.J_B[6 * c]": "side.outer",
}  # fmt: skip
#: What is the same in every position, and stands in a table.
_TABLES = {"closure.W": "plane"}
#: Ports of what is the same for all pins.
_SAME = {("H", "hinge.H_free"), ("H", "hinge.H"), ("v_rel", "hinge.v"), ("W", "zero")}
#: The kernel that would fill the table.
_TABULATED = "generic{nu}.complement"


def sweep_in_plane(whole: Sweep) -> Sweep:
    """The sweep for scenes in a plane."""
    runs = (run for run in _steps(whole.runs) if isinstance(run, Run))
    return replace(whole, name=f"{whole.name}_in_plane", runs=tuple(runs))


def _in_plane(whole: Pass) -> Pass:
    """The pass for scenes in a plane, where it is another one."""
    spares = "" if "linked" in whole.spares_links.split() else whole.spares_links
    found = replace(whole, steps=tuple(_steps(whole.steps)), spares_links=spares)
    return whole if found == whole else replace(found, name=f"{whole.name}_in_plane")


def _steps(steps: tuple[Step, ...]) -> Iterator[Step]:
    for step in steps:
        if any(_HOLDS.get(trait, wanted) != wanted for trait, wanted in step.traits):
            continue
        if isinstance(step, (Pick, Spread)) or (isinstance(step, Each) and step.of in _NONE):
            continue
        if isinstance(step, Call) and step.kernel == _TABULATED:
            continue
        if isinstance(step, Move) and _SLOTS.get(step.source) == step.to:
            continue
        left = [word for word in step.when.split() if word.lstrip("!") not in _HOLDS]
        if isinstance(step, Call) and step.kernel in _OF_MASS:
            left.append("!aside")
        yield _replaced(replace(step, when=" ".join(left)))


def _replaced(step: Step) -> Step:
    if isinstance(step, (Do, Run)) and step.whole is not None:
        return replace(step, whole=_in_plane(step.whole))
    if isinstance(step, (Each, EachSpeed)):
        return replace(step, steps=tuple(_steps(step.steps)))
    if isinstance(step, Call) and step.kernel in _KERNELS:
        ports = [(port, _slot(slot)) for port, slot in step.ports if (port, slot) not in _SAME]
        return replace(step, kernel=f"planar.{step.kernel.partition('.')[2]}", ports=tuple(ports))
    return step


def _slot(slot: str) -> str:
    name, picked, entry = slot.partition("[")
    return _SLOTS.get(slot, f"{_TABLES.get(name, name)}{picked}{entry}")
