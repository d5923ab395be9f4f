"""Messages on the end of a run, and risks of steps and switches that it did not resolve."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure
from mstmm.risk import RUN, Risk

from ..engine.failure_messages import (
    describe_curve_end,
    find_nonfinite_derivative,
    find_nonfinite_expression,
)
from ..engine.looped_engine import LoopedEngine
from ..flexible.mass_definiteness import is_definite_at
from ..flexible.supports import Supports
from ..integrate.c_loop import Integrator, Status
from ..integrate.steppers import get
from ..packing.packed_scene import PackedScene

if TYPE_CHECKING:
    from .scene_system import SceneSystem
    from .trajectory import Trajectory


#: Statuses of failed callbacks of the scene, whose failure record gives the cause.
_CALLBACK_FAILURES = (
    Status.RHS_FAILED, Status.EVENT_FAILED, Status.TANGENT_FAILED, Status.ACCEPT_FAILED,
    Status.FIRE_FAILED,
)  # fmt: skip


#: Statuses that a non-finite expression may cause.
_NONFINITE_FAILURES = (
    Status.NOT_FINITE, Status.STEP_TOO_SMALL, Status.RHS_FAILED, Status.TANGENT_FAILED,
    Status.NOT_CONVERGED,
)  # fmt: skip
#: Statuses that a switch may cause, and the largest distance of the switch from the last good
#: state, in steps.
_SWITCH_FAILURES = (Status.TOO_MANY_STEPS, Status.STEP_TOO_SMALL, Status.NOT_CONVERGED)
_SWITCH_DISTANCE = 2.0

#: Search for a non-finite expression past the last good state: growth of the time ahead from trial
#: to trial, and its largest value relative to t.  A run ends within rounding of such a point.
_AHEAD_FACTOR, _MAX_AHEAD = 4.0, 1e-9


def stop_message(system: SceneSystem, run: Integrator) -> str:
    """Sentence on how a run ended, or on its present state."""
    if run.status is Status.FINISHED:
        return run.message()
    failure = run.failure
    cause = ""
    if failure is not None:
        curve_end = curve_end_message(system, run.t, run.y, failure.time)
        if curve_end:
            return f"{curve_end}; last good state at t = {run.t:.9g} s"
        implicit = run.tableau.implicit
        cause = expression_cause(system, failure.status, run.t, run.y, failure.time, implicit)
    if failure is not None and failure.code and failure.status in _CALLBACK_FAILURES:
        text = cause or system.engine.failure_text(system.run.failure, failure.time)
        return f"{text}; last good state at t = {run.t:.9g} s"
    message = run.message(system.components(), system.event_names, cause)
    message += rest_note(system, run.event) if run.status is Status.STOPPED else ""
    if failure is not None and failure.status in _SWITCH_FAILURES and run.chatter is not None:
        return f"{message}; {chattering_note(system, run.chatter)}"
    work_failed = failure is not None and failure.component == system.engine.nq + system.engine.nu
    message += fastest_speed(system, run.t, run.y) if work_failed else ""
    step_too_small = failure is not None and failure.status is Status.STEP_TOO_SMALL
    message += _indefinite_mass_note(system, run.y) if step_too_small else ""
    return message if cause else message + _switch_note(system, run)


def rest_note(system: SceneSystem, event: int) -> str:
    """Ending of the message of a run that accumulating bounces of an event stopped, else ""."""
    if all(bounce.event != event for bounce in system.engine.packed.event_functions.bounces):
        return ""
    return (
        ": its bounces accumulate and have come to rest on the contact; to continue the run at "
        "rest, use a stop with a stiffness (law.limits) instead of a restitution"
    )


def expression_cause(
    system: SceneSystem, status: Status, t: float, y: Array, failed_at: float, implicit: bool
) -> str:
    """Expression or curve end that stopped a run with last good state (t, y); "" if none did.

    Implicit methods also fail at derivatives that are not finite.
    """
    cause = curve_end_message(system, t, y, failed_at)
    if cause or status not in _NONFINITE_FAILURES:
        return cause
    engine = system.engine
    q, u = y[: engine.nq], y[engine.nq : engine.nq + engine.nu]
    cause = _nonfinite_expression_ahead(engine, t, q, u, system.memory, failed_at)
    return cause or (find_nonfinite_derivative(engine, t, q, u) if implicit else "")


def curve_end_message(system: SceneSystem, t: float, y: Array, failed_at: float) -> str:
    """Message on the curve whose end stopped a run with last good state (t, y); "" if none did."""
    engine = system.engine
    q, u = y[: engine.nq], y[engine.nq : engine.nq + engine.nu]
    return describe_curve_end(engine, t, q, u, 2 * max(failed_at - t, 4 * math.ulp(t)))


def _nonfinite_expression_ahead(
    engine: LoopedEngine, t: float, q: Array, u: Array, memory: Array, failed_at: float
) -> str:
    """Non-finite expression at the last good state or at an extrapolation of it; "" if none.

    `failed_at` is the time (s) of the failed trial step.
    """
    cause = find_nonfinite_expression(engine, t, q, u)
    if cause:
        return cause
    try:
        qdot, udot = engine.accelerations(t, q[None].copy(), u[None].copy(), memory[None].copy())
    except NumericalFailure:
        return ""
    ahead = max(failed_at - t, 4 * math.ulp(t))
    max_ahead = max(2 * ahead, _MAX_AHEAD * max(1.0, abs(t)))
    while ahead <= max_ahead and not cause:
        cause = find_nonfinite_expression(
            engine, t + ahead, q + ahead * qdot[0], u + ahead * udot[0]
        )
        ahead *= _AHEAD_FACTOR
    return cause


def _indefinite_mass_note(system: SceneSystem, y: Array) -> str:
    """Note on flexible bodies whose mass matrix is indefinite, a cause of too small steps."""
    packed = system.engine.packed
    if not packed.flexible:
        return ""
    bodies = _indefinite_bodies(packed, y[: system.engine.nq])
    names = ", ".join(f'"{name}"' for name in bodies[:3]) + (", ..." if len(bodies) > 3 else "")
    return (
        f"; the mass matrix of flexible body {names} is not positive definite at its deflection: "
        'leave frame = "auto" and quadrature = "auto", or split the body'
        if bodies
        else ""
    )


def _indefinite_bodies(packed: PackedScene, q: Array) -> list[str]:
    """Names of the flexible bodies whose mass matrix is not positive definite at q (nq,)."""
    expanded, supports = packed.expanded, Supports(packed.user_scene)
    return [
        name
        for name, body in packed.flexible.items()
        if expanded is not None and not body.points and not is_definite_at(
            body, body.ports[expanded.inboard_ends[name]], supports.support_of(name),
            q[packed.layout.modal[name].q_slice][None],
        )
    ]  # fmt: skip


def fastest_speed(system: SceneSystem, t: float, y: Array) -> str:
    """Note on the speed with the largest acceleration, for messages that name no hinge."""
    engine = system.engine
    q, u = y[: engine.nq][None].copy(), y[engine.nq : engine.nq + engine.nu][None].copy()
    observed = engine.observe(np.array([t]), q, u, system.memory[None].copy(), parts=("udot",))
    rates = np.nan_to_num(np.abs(observed.udot[0]), nan=0.0, posinf=np.inf)
    if not rates.any():
        return ""
    return f"; the fastest change is that of {engine.packed.layout.u_name(int(rates.argmax()))}"


def _switch_note(system: SceneSystem, run: Integrator) -> str:
    """Note on a switch within a step or two of the failure of a run; "" if there is none."""
    failure = run.failure
    if failure is None or failure.status not in _SWITCH_FAILURES or not system.system.n_switches:
        return ""
    engine, t, y = system.engine, run.t, run.y
    n_q, n = engine.nq, engine.nq + engine.nu
    q, u = y[None, :n_q].copy(), y[None, n_q:n].copy()
    try:
        qdot, udot = engine.accelerations(t, q, u, system.memory[None].copy())
    except NumericalFailure:
        return ""
    distance = _SWITCH_DISTANCE * max(failure.time - t, run.last_step, 4 * math.ulp(t))
    rates = np.zeros(len(y))
    rates[:n] = np.concatenate([qdot[0], udot[0]])
    before, after = (_switch_margins(system, t + s, y + s * rates) for s in (-distance, distance))
    crossed = np.flatnonzero(~(before * after > 0))
    if not len(crossed):
        return ""
    return (
        f"; {system.switches[int(crossed[0])].description} switches there: if the motion stays "
        f"at the "
        "switch, make it smooth, such as tanh(u/0.001) for sign(u), or use the friction of the "
        "hinge's law"
    )


def _switch_margins(system: SceneSystem, t: float, y: Array) -> Array:
    """Margins (n_switches,) of the switches, zero where they switch; ones if not evaluable."""
    values = system.event_values(t, y)
    return np.ones(system.system.n_switches) if values is None else values[system.system.n_events :]


#: Largest estimated error of fixed steps, relative to the distance travelled, without a risk.
_MAX_ERROR = 0.02

#: Error of the recommended step, relative to _MAX_ERROR.
_TARGET = 0.5


def step_too_long_note(run: Trajectory) -> tuple[Risk, ...]:
    """Risk that the fixed step of an implicit method is far too long for the motion.

    The criterion is the local error estimate that controls adaptive steps.  Stability does not
    bound such a step, and the energy shows nothing of motions that it damps.
    """
    settings, statistics = run.settings, run.statistics
    if settings.step is None:
        return ()
    error, tableau = statistics.sum_of_local_errors, get(settings.method, settings.radius)
    if not tableau.implicit:
        return ()
    if settings.step > settings.t_end - settings.t_start:
        span = settings.t_end - settings.t_start
        return (Risk(
            "step-accuracy", RUN,
            f"step = {settings.step:.4g} s is longer than the run of {span:.4g} s, which becomes "
            "one step", f"use a step below {span:.4g} s", settings.step, span, "s",
            seen_before_run=True,
        ),)  # fmt: skip
    if error is None or len(run.t) < 3:
        return ()
    speed = float(np.sqrt(np.mean(run.u**2, axis=1)).mean()) if run.u.size else 0.0
    distance = speed * (run.t[-1] - run.t[0])
    if not (distance > 0.0 and error > _MAX_ERROR * distance + settings.atol * statistics.steps):
        return ()
    ratio = (_TARGET * _MAX_ERROR * distance / error) ** (1 / tableau.error_order)
    return (Risk(
        "step-accuracy", RUN,
        f"step = {settings.step:.4g} s is too long for the motion: estimated error of its steps "
        f"{error / distance:.0%} of the distance travelled",
        f"use a step below {settings.step * ratio:.2g} s, or leave step out",
        error / distance, _MAX_ERROR,
    ),)  # fmt: skip


def switch_notes(
    system: SceneSystem, chatter: tuple[int, float] | None, missed: tuple[int, float] | None
) -> list[Risk]:
    """Risks of a switch that chatters, and of an event or switch that a step may have missed."""
    return [
        *([] if chatter is None else [chattering_note(system, chatter)]),
        *([] if missed is None else [missed_switch_note(system, *missed)]),
    ]


def missed_switch_note(system: SceneSystem, index: int, since: float) -> Risk:
    """Risk that a step missed a fast event or, for an index past the events, a fast switch."""
    n = len(system.event_names)
    where = system.event_names[index] if index < n else system.switches[index - n].description
    return Risk(
        "switches", where,
        f"the condition of {where} changes so fast from t = {since:.9g} s on that it may have held "
        "between two evaluations", "make the feature wider, or give max_step",
    )  # fmt: skip


def chattering_note(system: SceneSystem, chatter: tuple[int, float]) -> Risk:
    """Risk that a switch chatters, from its index and the time (s) at which it began."""
    where, since = system.switches[chatter[0]].description, chatter[1]
    return Risk(
        "chatter", where,
        f"{where} chatters from t = {since:.9g} s on: the forces on both sides drive the motion "
        "back to the switch, and later steps do not end there",
        "make it smooth, such as tanh(u/0.001) for sign(u), or use the friction of the hinge's law",
    )  # fmt: skip
