"""Why a run ended, in words: the expression, the element or the speed that is behind it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mstmm.arrays import Array

from .culprit import culprit_ahead
from .integrate import Run, Status
from .run_notes import endless

if TYPE_CHECKING:
    from .simulate import SceneSystem


#: What a run ends with where call-backs of the scene fail; their code says how.
_EVALUATIONS = (Status.RHS_FAILED, Status.EVENT_FAILED)


def message_of(system: SceneSystem, run: Run) -> str:
    """How a run ended or stands, as a sentence."""
    failure = run.failure
    cause = "" if failure is None else cause_of(system, failure.status, run.t, run.y, failure.time)
    if failure is not None and failure.code and failure.status in _EVALUATIONS:
        text = cause or system.engine.failure_text(system.run.failure, failure.time)
        return f"{text}; last good state at t = {run.t:.9g} s"
    message = run.message(system.components(), system.event_names, cause)
    sticks = failure is not None and failure.status is Status.TOO_MANY_STEPS
    if sticks and run.chatter is not None:
        return f"{message}; {endless(system, run.chatter)}"
    work = failure is not None and failure.component == system.engine.nq + system.engine.nu
    message += busiest(system, run.t, run.y) if work else ""
    small = failure is not None and failure.status is Status.STEP_TOO_SMALL
    return message + (_indefinite(system, run.y) if small else "")


def cause_of(system: SceneSystem, status: Status, t: float, y: Array, failed_at: float) -> str:
    """The expression that stopped a run whose last good state is (t, y); empty if none did."""
    if status not in (Status.NOT_FINITE, Status.STEP_TOO_SMALL, Status.RHS_FAILED):
        return ""
    engine = system.engine
    q, u = y[: engine.nq], y[engine.nq : engine.nq + engine.nu]
    return culprit_ahead(engine, t, q, u, system.memory, failed_at)


def _indefinite(system: SceneSystem, y: Array) -> str:
    """Which mass matrices were lost, in words: the reason of many a step that is too small."""
    packed = system.engine.packed
    if not packed.flexible:
        return ""
    from .flexible.definiteness import indefinite_bodies

    lost = indefinite_bodies(packed, y[: system.engine.nq])
    names = ", ".join(f'"{name}"' for name in lost[:3]) + (", ..." if len(lost) > 3 else "")
    return (
        f"; the mass matrix of flexible body {names} is not positive definite at its deflection: "
        'leave frame = "auto" and quadrature = "auto", or split the body'
        if lost
        else ""
    )


def busiest(system: SceneSystem, t: float, y: Array) -> str:
    """Which speed changes fastest at a state, for messages that name no hinge by themselves."""
    engine = system.engine
    q, u = y[: engine.nq][None].copy(), y[engine.nq : engine.nq + engine.nu][None].copy()
    seen = engine.observe(np.array([t]), q, u, system.memory[None].copy(), parts=("udot",))
    rates = np.nan_to_num(np.abs(seen.udot[0]), nan=0.0, posinf=np.inf)
    if not rates.any():
        return ""
    return f"; the fastest change is that of {engine.packed.layout.u_name(int(rates.argmax()))}"
