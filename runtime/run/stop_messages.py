"""Why a run ended, in words: the expression, the element or the speed that is behind it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure

from ..engine.failure_source import (
    describe_curve_end,
    find_nonfinite_derivative,
    find_nonfinite_expression,
)
from ..engine.looped_engine import LoopedEngine
from ..flexible.mass_definiteness import is_definite_at
from ..flexible.support_motion import Supports
from ..integrate.c_loop import Integrator, Status
from ..packing.packed_scene import PackedScene
from .run_notes import chattering_note

if TYPE_CHECKING:
    from .scene_system import SceneSystem


#: What a run ends with where call-backs of the scene fail; their code says how.
_EVALUATIONS = (
    Status.RHS_FAILED, Status.EVENT_FAILED, Status.TANGENT_FAILED, Status.ACCEPT_FAILED,
    Status.FIRE_FAILED,
)  # fmt: skip


#: What a run may end with where an expression stops being a number.
_BY_EXPRESSIONS = (
    Status.NOT_FINITE, Status.STEP_TOO_SMALL, Status.RHS_FAILED, Status.TANGENT_FAILED,
    Status.NOT_CONVERGED,
)  # fmt: skip
#: What a run may end with at a switch, and how many steps before or after the last good state
#: the motion passes it at most.
_AT_SWITCHES = (Status.TOO_MANY_STEPS, Status.STEP_TOO_SMALL, Status.NOT_CONVERGED)
_PASSING = 2.0

#: States looked at past the last good one lie this many times farther ahead each, up to this part
#: of the time: a run ends within rounding of the place where an expression stops being a number.
_FARTHER, _FARTHEST = 4.0, 1e-9


def message_of(system: SceneSystem, run: Integrator) -> str:
    """How a run ended or stands, as a sentence."""
    if run.status is Status.FINISHED:
        return run.message()
    failure = run.failure
    cause = ""
    if failure is not None:
        end = end_of_curve(system, run.t, run.y, failure.time)
        if end:
            return f"{end}; last good state at t = {run.t:.9g} s"
        implicit = run.tableau.implicit
        cause = cause_of(system, failure.status, run.t, run.y, failure.time, implicit)
    if failure is not None and failure.code and failure.status in _EVALUATIONS:
        text = cause or system.engine.failure_text(system.run.failure, failure.time)
        return f"{text}; last good state at t = {run.t:.9g} s"
    message = run.message(system.components(), system.event_names, cause)
    message += rest_of(system, run.event) if run.status is Status.STOPPED else ""
    if failure is not None and failure.status in _AT_SWITCHES and run.chatter is not None:
        return f"{message}; {chattering_note(system, run.chatter)}"
    work = failure is not None and failure.component == system.engine.nq + system.engine.nu
    message += fastest_speed(system, run.t, run.y) if work else ""
    small = failure is not None and failure.status is Status.STEP_TOO_SMALL
    message += _indefinite(system, run.y) if small else ""
    return message if cause else message + _switch_at(system, run)


def rest_of(system: SceneSystem, event: int) -> str:
    """What ends the message of a run that an event stopped: words for bounces, which stop it where
    they follow ever faster."""
    if all(one.event != event for one in system.engine.packed.watched.bounces):
        return ""
    return (
        ": its bounces follow ever faster, what bounces has come to rest there; what lies still "
        "needs a stop that carries it (law.limits with a stiffness)"
    )


def cause_of(
    system: SceneSystem, status: Status, t: float, y: Array, failed_at: float, implicit: bool
) -> str:
    """The expression that stopped a run whose last good state is (t, y); empty if none did.
    Implicit methods are stopped by slopes as well."""
    found = end_of_curve(system, t, y, failed_at)
    if found or status not in _BY_EXPRESSIONS:
        return found
    engine = system.engine
    q, u = y[: engine.nq], y[engine.nq : engine.nq + engine.nu]
    found = _culprit_ahead(engine, t, q, u, system.memory, failed_at)
    return found or (find_nonfinite_derivative(engine, t, q, u) if implicit else "")


def end_of_curve(system: SceneSystem, t: float, y: Array, failed_at: float) -> str:
    """The curve whose end stopped a run whose last good state is (t, y); empty if none did."""
    engine = system.engine
    q, u = y[: engine.nq], y[engine.nq : engine.nq + engine.nu]
    return describe_curve_end(engine, t, q, u, 2 * max(failed_at - t, 4 * math.ulp(t)))


def _culprit_ahead(
    engine: LoopedEngine, t: float, q: Array, u: Array, memory: Array, failed_at: float
) -> str:
    """The same at the last good state of a run, or where its rates lead from there; `failed_at` is
    the time of the trial that failed."""
    found = find_nonfinite_expression(engine, t, q, u)
    if found:
        return found
    try:
        qdot, udot = engine.accelerations(t, q[None].copy(), u[None].copy(), memory[None].copy())
    except NumericalFailure:
        return ""
    ahead = max(failed_at - t, 4 * math.ulp(t))
    farthest = max(2 * ahead, _FARTHEST * max(1.0, abs(t)))
    while ahead <= farthest and not found:
        found = find_nonfinite_expression(
            engine, t + ahead, q + ahead * qdot[0], u + ahead * udot[0]
        )
        ahead *= _FARTHER
    return found


def _indefinite(system: SceneSystem, y: Array) -> str:
    """Which mass matrices were lost, in words: the reason of many a step that is too small."""
    packed = system.engine.packed
    if not packed.flexible:
        return ""
    lost = _indefinite_bodies(packed, y[: system.engine.nq])
    names = ", ".join(f'"{name}"' for name in lost[:3]) + (", ..." if len(lost) > 3 else "")
    return (
        f"; the mass matrix of flexible body {names} is not positive definite at its deflection: "
        'leave frame = "auto" and quadrature = "auto", or split the body'
        if lost
        else ""
    )


def _indefinite_bodies(packed: PackedScene, q: Array) -> list[str]:
    """Names of the flexible bodies whose mass matrix is not positive definite at q (nq,)."""
    expanded, supports = packed.expanded, Supports(packed.described)
    return [
        name
        for name, body in packed.flexible.items()
        if expanded is not None and not body.points and not is_definite_at(
            body, body.ports[expanded.held[name]], supports.of(name),
            q[packed.layout.modal[name].q_slice][None],
        )
    ]  # fmt: skip


def fastest_speed(system: SceneSystem, t: float, y: Array) -> str:
    """Which speed changes fastest at a state, for messages that name no hinge by themselves."""
    engine = system.engine
    q, u = y[: engine.nq][None].copy(), y[engine.nq : engine.nq + engine.nu][None].copy()
    seen = engine.observe(np.array([t]), q, u, system.memory[None].copy(), parts=("udot",))
    rates = np.nan_to_num(np.abs(seen.udot[0]), nan=0.0, posinf=np.inf)
    if not rates.any():
        return ""
    return f"; the fastest change is that of {engine.packed.layout.u_name(int(rates.argmax()))}"


def _switch_at(system: SceneSystem, run: Integrator) -> str:
    """The switch that the motion passes within a step or two of where the run failed, as words that
    end a message; empty where none does."""
    failure = run.failure
    if failure is None or failure.status not in _AT_SWITCHES or not system.system.n_switches:
        return ""
    engine, t, y = system.engine, run.t, run.y
    n_q, n = engine.nq, engine.nq + engine.nu
    q, u = y[None, :n_q].copy(), y[None, n_q:n].copy()
    try:
        qdot, udot = engine.accelerations(t, q, u, system.memory[None].copy())
    except NumericalFailure:
        return ""
    reach = _PASSING * max(failure.time - t, run.last_step, 4 * math.ulp(t))
    rates = np.zeros(len(y))
    rates[:n] = np.concatenate([qdot[0], udot[0]])
    before, after = (_margins(system, t + s, y + s * rates) for s in (-reach, reach))
    passed = np.flatnonzero(~(before * after > 0))
    if not len(passed):
        return ""
    return (
        f"; {system.switches[int(passed[0])].what} switches there: if the motion sticks to it, "
        "make it smooth, such as tanh(u/0.001) for sign(u), or use the friction of the hinge's law"
    )


def _margins(system: SceneSystem, t: float, y: Array) -> Array:
    """Of all switches that are watched: each is zero where it switches."""
    values = system.watched(t, y)
    return np.ones(system.system.n_switches) if values is None else values[system.system.n_events :]
