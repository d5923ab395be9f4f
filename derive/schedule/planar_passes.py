"""Passes for planar scenes with closed loops, in which all hinges are free, parallel pins.

The traits of such a scene are known in advance: steps with false conditions and true conditions are
removed.  Planar kernels are used where they exist.
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

#: In-plane entries of a load or a direction.
LOAD = (0, 1, 5)
#: Traits of such a scene, and of unobserved evaluations of accelerations.
_TRAITS = {
    **dict.fromkeys(("own", "free", "moving", "hinged", "known", "poses", "looped"), True),
    **dict.fromkeys(
        ("parts", "whole", "staged", "section", "outward", "segment", "modal", "imposed",
         "distance", "plane", "rolling", "coupled", "soft", "corrected", "position_gap",
         "gap_closing", "refined", "qr", "velocity_error", "inverse", "weightless", "balance",
         "loads_read", "immobile", "linked", "driven", "flexible", "couplings", "product"), False,
    ),
}  # fmt: skip
#: Loops that are empty in such a scene.
_EMPTY_LOOPS = ("own", "bent")
#: Kernels with a planar form, by their prefix in calls, and the element that has them.
PLANAR_KERNELS = {
    "hinge": (("hinge", "pin"), "forward"),
    "body": (("body", "rigid"), "inertia bias_load"),
    "frames": (("sweep", "frames"), "pose velocity point angular_motion end_frame applied_load"),
    "generic{free}": (
        ("sweep", "generic1"), "factor column_load ground_column_load column_acceleration divide "
        "couple add_known_part add_multiplier_effort",
    ),
    "loops": (
        ("sweep", "loops"), "relative_pose slip drift row known_parts row_acceleration "
        "apply_effort eliminate_row update_column multiplier_of_motion",
    ),
}  # fmt: skip
_KERNELS = {f"{key}.{name}" for key, (_, names) in PLANAR_KERNELS.items() for name in names.split()}
#: Kernels of inertia, skipped for the massless frame of a cut hinge.
_INERTIA_KERNELS = {"body.inertia", "body.bias_load"}
#: Slots of free speeds -> slots of all speeds; rows of a hinge -> slots of the carried columns;
#: constant data -> where it is stored.
_SLOTS = {
    "hinge.J_free": "body.rotor", "hinge.tau_free": "body.tau", "hinge.rates": "body.udot",
    "closure.J_A[6 * c]": "side.inner", "closure.J_B[6 * c]": "side.outer",
    "closure.W": "plane", "closure.W[6 * k]": "plane", "closure.W[6 * c]": "plane[3 * c]",
    "body.r": "connection.r", "hinge.p": "none",
}  # fmt: skip
#: Slots that no later pass reads.
_LOCAL_SLOTS = {f"closure.{name}": f"local.{name}" for name in ("R_C", "lever", "d", "slip")}
#: Ports that are constant for all pins, or zero.
_CONSTANT_PORTS = {
    ("H", "hinge.H_free"), ("H", "hinge.H"), ("v_rel", "hinge.v"), ("W", "zero"),
    ("s", "body.s"), ("delta", "zero"), ("gravity", "zero"),
}  # fmt: skip
#: Slots that planar scenes read from records instead of writing them.
_OMITTED_KERNELS = {"generic{nu}.complement", "frames.pivot_floor"}
#: Rows have no target beyond the bodies' motion.
_OMITTED_HOOKS = {"set_row_targets"}
#: A pin has no prescribed motion.
_ZERO_SLOT = "body.s"


def planar_sweep(whole: Sweep) -> Sweep:
    """Sweep for planar scenes.

    Loops are closed as soon as both bodies of a cut hinge are known, before other loads act on
    them.
    """
    runs = [run for run in _planar_steps(whole.runs) if isinstance(run, Run) and _is_needed(run)]
    start, closures = _remove_run(runs, "begin_rows"), _remove_run(runs, "closures_in_plane")
    first_load = next(k for k, run in enumerate(runs) if run.whole and run.whole.subject == "load")
    runs_in_order = (start, *runs[:first_load], closures, *runs[first_load:])
    return replace(whole, name=f"{whole.name}_in_plane", runs=runs_in_order)


def _is_needed(run: Run) -> bool:
    return bool(run.whole.steps) if run.whole else run.hook not in _OMITTED_HOOKS


def _remove_run(runs: list[Run], name: str) -> Run:
    """Remove the run with this name from the list and return it."""
    at = [run.whole.name if run.whole else run.hook for run in runs].index(name)
    return runs.pop(at)


def _planar_pass(whole: Pass) -> Pass:
    """Pass for planar scenes, visiting closed loops one by one."""
    spares = "" if "linked" in whole.spares_links.split() else whole.spares_links
    subject, skip = ("closure", "") if whole.skip == "!cut" else (whole.subject, whole.skip)
    return replace(
        whole, name=f"{whole.name}_in_plane", subject=subject, skip=skip, given=(), flat=True,
        steps=tuple(_planar_steps(whole.steps)), spares_links=spares,
    )  # fmt: skip


def _planar_steps(steps: tuple[Step, ...]) -> Iterator[Step]:
    for step in steps:
        if any(_TRAITS.get(trait, required) != required for trait, required in step.traits):
            continue
        if isinstance(step, (SelectColumns, ScatterSpeeds)) or (
            isinstance(step, ForEach) and step.of in _EMPTY_LOOPS
        ):
            continue
        if isinstance(step, Call) and step.kernel in _OMITTED_KERNELS:
            continue
        if isinstance(step, Copy) and step.to == _ZERO_SLOT:
            continue
        if isinstance(step, Move) and _SLOTS.get(step.source) == step.to:
            continue
        if isinstance(step, EachSpeed):
            yield from map(_unroll_speed, _planar_steps(step.steps))
            continue
        remaining = [word for word in step.when.split() if word.lstrip("!") not in _TRAITS]
        if isinstance(step, Call) and step.kernel in _INERTIA_KERNELS:
            remaining.append("!omitted")
        yield _planar_step(replace(step, when=" ".join(remaining)))


def _planar_step(step: Step) -> Step:
    if isinstance(step, (RunPass, Run)) and step.whole is not None:
        return replace(step, whole=_planar_pass(step.whole))
    if isinstance(step, ForEach):
        return replace(step, steps=tuple(_planar_steps(step.steps)))
    if isinstance(step, Copy) and step.source == _ZERO_SLOT:
        return replace(step, source="")
    if isinstance(step, Call) and step.kernel in _KERNELS:
        return _planar_call(step)
    return step


def _unroll_speed(step: Step) -> Step:
    """Unrolled step over the single speed of a pin."""
    if isinstance(step, Add):
        return replace(step, to=step.to.replace("[k]", "[0]"))
    assert isinstance(step, Call)
    ports = tuple((port, slot.partition("[")[0]) for port, slot in step.ports)
    return replace(step, ports=ports)


def _planar_call(step: Call) -> Call:
    kernel = step.kernel.partition(".")[2]
    ports = tuple(
        (port, _SLOTS.get(slot, _LOCAL_SLOTS.get(slot, slot)))
        for port, slot in step.ports
        if (port, slot) not in _CONSTANT_PORTS and (kernel, port) != ("forward", "r")
    )
    return replace(step, kernel=f"planar.{kernel}", ports=ports)
