"""What a run could not see, locate or resolve."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mstmm.risk import RUN, Risk

from ..integrate.steppers import get
from ..packing.switch_margins import MOST

if TYPE_CHECKING:
    from ..integrate.settings import Settings
    from ..packing.packed_scene import PackedScene
    from .scene_system import SceneSystem
    from .trajectory import Trajectory

#: Part of the way covered that fixed steps may err by, by their own estimate, without a word.
_PART = 0.02

#: The step that is named instead is to err by this part of it.
_SURE = 0.5


def unmapped_expression_notes(packed: PackedScene, settings: Settings) -> tuple[Risk, ...]:
    """Of the expressions of a scene: those that could not be mapped, or that a fixed step may pass
    over."""
    known = packed.time_map(settings.t_start, settings.t_end)
    found = list(known.notes)
    if settings.step is not None:
        found += [risk] if (risk := known.too_long(settings.step)) else []
    count = len(packed.watched.switches)
    if count > MOST:
        found.append(Risk(
            "switches", RUN,
            f"more than {MOST} conditions depend on the motion; those behind the first {MOST} do "
            "not end a step where they switch", "give max_step so that none is passed over",
            count, MOST, before=True,
        ))  # fmt: skip
    return tuple(found)


def step_too_long_note(run: Trajectory) -> tuple[Risk, ...]:
    """That the fixed step of an implicit method is far too long for the motion, by the estimates
    that adaptive steps go by.  Nothing else bounds such a step, and what it damps away leaves no
    energy that could tell."""
    settings, statistics = run.settings, run.statistics
    if settings.step is None:
        return ()
    error, tableau = statistics.sum_local_error, get(settings.method, settings.radius)
    if not tableau.implicit:
        return ()
    if settings.step > settings.t_end - settings.t_start:
        span = settings.t_end - settings.t_start
        return (Risk(
            "step-accuracy", RUN,
            f"step = {settings.step:.4g} s is longer than the run, which is one step then",
            f"take one below {span:.4g} s", settings.step, span, "s",
            before=True,
        ),)  # fmt: skip
    if error is None or len(run.t) < 3:
        return ()
    speed = float(np.sqrt(np.mean(run.u**2, axis=1)).mean()) if run.u.size else 0.0
    way = speed * (run.t[-1] - run.t[0])
    if not (way > 0.0 and error > _PART * way + settings.atol * statistics.steps):
        return ()
    shorter = settings.step * (_SURE * _PART * way / error) ** (1 / tableau.error_order)
    return (Risk(
        "step-accuracy", RUN,
        f"step = {settings.step:.4g} s is too long for the motion: by their own estimate its steps "
        f"err by {error / way:.0%} of the way that is covered",
        f"take a step below {shorter:.2g} s, or leave step out", error / way, _PART,
    ),)  # fmt: skip


def unseen(system: SceneSystem, number: int, since: float) -> Risk:
    """That an event, or behind the events a switch, changes too fast to be followed in a step."""
    n = len(system.event_names)
    what = system.event_names[number] if number < n else system.switches[number - n].what
    return Risk(
        "switches", what,
        f"the condition of {what} changes so fast from t = {since:.9g} s on that it may have held "
        "between two looks at it", "write it with something wider, or give max_step",
    )  # fmt: skip


def chattering_note(system: SceneSystem, chatter: tuple[int, float]) -> Risk:
    """A switch that holds the motion where it is: which one, and since when."""
    what, since = system.switches[chatter[0]].what, chatter[1]
    return Risk(
        "chatter", what,
        f"{what} switches without end from t = {since:.9g} s on, because the forces on both sides "
        "drive the motion back to it, and no step ends there any more",
        "make it smooth, such as tanh(u/0.001) for sign(u), or use the friction of the hinge's law",
    )  # fmt: skip
