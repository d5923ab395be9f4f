"""Risks of switches, narrow features and step sizes that a run did not resolve."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mstmm.risk import RUN, Risk

from ..integrate.steppers import get

if TYPE_CHECKING:
    from .scene_system import SceneSystem
    from .trajectory import Trajectory

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
