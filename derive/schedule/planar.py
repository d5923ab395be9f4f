"""Passes in a plane: of scenes where every hinge is a free pin and all pins are parallel.

What such a scene has is known beforehand: steps whose conditions do not hold go, and conditions
that do.  Kernels are those in a plane, where there are such.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from .steps import Call, Do, Each, EachSpeed, Pass, Pick, Spread, Step

#: What holds of such a scene, and of evaluations of accelerations that nobody observes.
_HOLDS = {
    **dict.fromkeys(("own", "free", "moving", "hinged", "known"), True),
    **dict.fromkeys(
        ("parts", "whole", "staged", "section", "outward", "modal", "imposed", "distance", "plane",
         "rolling", "coupled", "soft", "corrected", "gaping", "placing", "slipping", "refined",
         "inverse", "balance", "kept", "unmoved"), False,
    ),
}  # fmt: skip
#: What could be met one by one, and is not there.
_NONE = ("own", "bent")
#: Kernels that there are in a plane.
_KERNELS = {
    *("hinge.forward", "body.inertia", "body.bias_load", "frames.pose", "frames.velocity"),
    "generic{nu}.complement",
    *(f"generic{{free}}.{name}" for name in (
        "factor", "push", "push_on_ground", "answer", "divide", "couple", "answered", "pull",
    )),
    *(f"loops.{name}" for name in (
        "meet", "slip", "drift", "row", "known", "told", "act", "close", "shed", "multiplier_more",
    )),
}  # fmt: skip
#: Slots of the free speeds -> those of all speeds.
_SLOTS = {"hinge.J_free": "body.rotor", "hinge.tau_free": "body.tau", "hinge.rates": "body.udot"}
#: Ports of what is the same for all pins.
_SAME = {("H", "hinge.H_free"), ("H", "hinge.H"), ("v_rel", "hinge.v"), ("W", "zero")}


def in_plane(whole: Pass) -> Pass:
    """The pass for scenes in a plane."""
    return replace(whole, name=f"{whole.name}_in_plane", steps=tuple(_steps(whole.steps)))


def _steps(steps: tuple[Step, ...]) -> Iterator[Step]:
    for step in steps:
        if any(_HOLDS.get(trait, wanted) != wanted for trait, wanted in step.traits):
            continue
        if isinstance(step, (Pick, Spread)) or (isinstance(step, Each) and step.of in _NONE):
            continue
        left = [word for word in step.when.split() if word.lstrip("!") not in _HOLDS]
        yield _replaced(replace(step, when=" ".join(left)))


def _replaced(step: Step) -> Step:
    if isinstance(step, Do):
        assert step.whole is not None
        return replace(step, whole=in_plane(step.whole))
    if isinstance(step, (Each, EachSpeed)):
        return replace(step, steps=tuple(_steps(step.steps)))
    if isinstance(step, Call) and step.kernel in _KERNELS:
        ports = [(port, _SLOTS.get(slot, slot)) for port, slot in step.ports
                 if (port, slot) not in _SAME]  # fmt: skip
        return replace(step, kernel=f"planar.{step.kernel.partition('.')[2]}", ports=tuple(ports))
    return step
