"""Reject starts on or past a contact: a bounce event or a hard stop.

An event whose condition holds at the start fires there, so that a motion into the contact bounces.
A motion at rest on the contact does not bounce and would pass through it.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure, SceneError

from ..engine.looped_engine import LoopedEngine
from ..packing.event_functions import Bounce

#: Relative tolerance within which a state counts as on the contact and as at rest there: of the
#: positions and speeds that the condition reads, at least of 1 rad or m and of 1 rad/s or m/s.
_TOLERANCE = 1e-9
#: Times in s over which the acceleration may release a resting contact: the longer one for slow
#: releases, the shorter one for fast rotations.
_RELEASE_TIMES = 1e-3, 1e-6


class ContactSystem(Protocol):
    """Part of `SceneSystem` that this check needs."""

    engine: LoopedEngine
    memory: Array

    def event_values(self, t: float, y: Array) -> Array | None: ...
    def approach_rate(self, event: int, t: float, y: Array, u: Array) -> Any: ...


def check_contact_start(system: ContactSystem, t: float, y: Array) -> None:
    """Reject a start on or past a contact.

    Raises SceneError where the state rests on a bounce event or a hard stop, is past a bounce event
    without leaving it, or is past a hard stop.
    """
    bounces = system.engine.packed.event_functions.bounces
    values = system.event_values(t, y) if bounces else None
    if values is None:
        return
    for bounce in bounces:
        try:
            _check_bounce(system, bounce, float(values[bounce.event]), t, y)
        except NumericalFailure:  # the run meets the same failure and reports it
            continue


def _check_bounce(system: ContactSystem, bounce: Bounce, value: float, t: float, y: Array) -> None:
    contact = system.approach_rate(bounce.event, t, y, _speeds(system, y))
    tolerance = _TOLERANCE * contact.reach
    if not value >= -tolerance:
        return
    rate, is_past = _approach_rate(system, bounce, t, y), value > tolerance
    if rate == 0 or (is_past and (rate > 0 or _is_hard_stop(system, bounce))):
        raise SceneError(_message(system, bounce, y, value, is_past))


def _is_hard_stop(system: ContactSystem, bounce: Bounce) -> bool:
    return bounce.event >= len(system.engine.packed.scene.event)


def _speeds(system: ContactSystem, y: Array) -> Array:
    engine = system.engine
    return y[engine.nq : engine.nq + engine.nu]


def _approach_rate(system: ContactSystem, bounce: Bounce, t: float, y: Array) -> float:
    """Rate in 1/s at which a state moves into the contact.

    Negative where the state leaves the contact or its acceleration releases it, 0 where it rests.
    """
    contact = system.approach_rate(bounce.event, t, y, _speeds(system, y))
    tolerance = _TOLERANCE * (contact.size + contact.steepness)
    if abs(contact.rate) > tolerance:
        return float(contact.rate)
    rates = []
    for dt in _RELEASE_TIMES:
        later = _extrapolate(system, t, y, dt)
        contact = system.approach_rate(bounce.event, t + dt, later, _speeds(system, later))
        rates.append(float(contact.rate))
    return min(rates) if min(rates) < -tolerance else 0.0


def _extrapolate(system: ContactSystem, t: float, y: Array, dt: float) -> Array:
    """State after dt (s) with the accelerations at t."""
    engine = system.engine
    q, u, memory = (np.array(x)[None] for x in (y[: engine.nq], _speeds(system, y), system.memory))
    delta_u = dt * engine.accelerations(t, q, u, memory)[1]
    delta_q = dt * engine.accelerations(t, q, u + delta_u / 2, memory)[0]
    return np.concatenate([(q + delta_q)[0], (u + delta_u)[0]])


def _message(system: ContactSystem, bounce: Bounce, y: Array, value: float, is_past: bool) -> str:
    packed = system.engine.packed
    where, when = packed.scene.event_label(bounce.event), packed.scene.events[bounce.event].when
    if not _is_hard_stop(system, bounce):
        found = (
            f"past the contact by {value:.6g} and does not leave it"
            if is_past
            else "at rest on the contact"
        )
        return (
            f"{where}: the run starts {found} ({when.text!r} holds), so that it cannot bounce; "
            "start where the condition does not hold, or with a speed away from the contact"
        )
    assert when.comparison is not None
    coordinate, limit = bounce.places[0][0], when.comparison[2].constant or 0.0
    return (
        f"{where}: the run starts with {packed.layout.q_names[coordinate]} = "
        f"{y[coordinate]:.9g}, {'past' if is_past else 'at rest on'} the stop at {limit:.9g}, so "
        "that it cannot bounce; start between the stops, or with a speed away from the stop"
    )
