"""Starts on or behind what throws back: refused where nothing would throw the motion back.

An event whose condition holds at the start happens there: what moves against it is thrown back.
What rests on it is not, and would fall through it.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure, SceneError

from ..engine.looped_engine import LoopedEngine
from ..packing.records.bounce_records import Bounce

#: Within this part of the places and speeds that it reads, or of 1 rad or m and a second, a state
#: is on what throws back, and does not move against it.
_CLOSE = 1e-9
#: Times, s, after one of which what rests there shows whether its acceleration takes it away:
#: gently, or while it turns fast.
_SOON = 1e-3, 1e-6


class ContactSystem(Protocol):
    """What is asked of a `SceneSystem`."""

    engine: LoopedEngine
    memory: Array

    def watched(self, t: float, y: Array) -> Array | None: ...
    def meeting(self, event: int, t: float, y: Array, u: Array) -> Any: ...


def check_contact_start(system: ContactSystem, t: float, y: Array) -> None:
    """SceneError for a run that begins at rest on an event that bounces, or on a hard stop; or
    behind one without leaving it, behind a hard stop in any case."""
    bounces = system.engine.packed.watched.bounces
    values = system.watched(t, y) if bounces else None
    if values is None:
        return
    for bounce in bounces:
        try:
            _refuse(system, bounce, float(values[bounce.event]), t, y)
        except NumericalFailure:  # which the run meets, and tells
            continue


def _refuse(system: ContactSystem, bounce: Bounce, value: float, t: float, y: Array) -> None:
    met = system.meeting(bounce.event, t, y, _speeds(system, y))
    close = _CLOSE * met.reach
    if not value >= -close:
        return
    rate, beyond = _rate(system, bounce, t, y), value > close
    if rate == 0 or (beyond and (rate > 0 or _is_stop(system, bounce))):
        raise SceneError(_said(system, bounce, y, value, beyond))


def _is_stop(system: ContactSystem, bounce: Bounce) -> bool:
    return bounce.event >= len(system.engine.packed.scene.event)


def _speeds(system: ContactSystem, y: Array) -> Array:
    engine = system.engine
    return y[engine.nq : engine.nq + engine.nu]


def _rate(system: ContactSystem, bounce: Bounce, t: float, y: Array) -> float:
    """That with which a state moves on into it, 1/s: below 0 where it leaves, or stands and is
    taken away by its acceleration; 0 where it rests there."""
    met = system.meeting(bounce.event, t, y, _speeds(system, y))
    still = _CLOSE * (met.size + met.steepness)
    if abs(met.rate) > still:
        return float(met.rate)
    rates = []
    for wait in _SOON:
        soon = _state_soon(system, t, y, wait)
        met = system.meeting(bounce.event, t + wait, soon, _speeds(system, soon))
        rates.append(float(met.rate))
    return min(rates) if min(rates) < -still else 0.0


def _state_soon(system: ContactSystem, t: float, y: Array, wait: float) -> Array:
    """The state that its acceleration leads to."""
    engine = system.engine
    q, u, memory = (np.array(x)[None] for x in (y[: engine.nq], _speeds(system, y), system.memory))
    gained = wait * engine.accelerations(t, q, u, memory)[1]
    moved = wait * engine.accelerations(t, q, u + gained / 2, memory)[0]
    return np.concatenate([(q + moved)[0], (u + gained)[0]])


def _said(system: ContactSystem, bounce: Bounce, y: Array, value: float, beyond: bool) -> str:
    packed = system.engine.packed
    what, when = packed.scene.happening(bounce.event), packed.scene.events[bounce.event].when
    where = "beyond" if beyond else "on"
    if not _is_stop(system, bounce):
        found = f"by {value:.6g}, without leaving it" if beyond else "and rests there"
        return (
            f"{what}: the run begins {where} it, {when.text!r}, {found}: nothing throws back what "
            "does not come to it; begin where that does not hold yet, or let it leave at the start"
        )
    assert when.comparison is not None
    place, limit = bounce.places[0][0], when.comparison[2].constant or 0.0
    return (
        f"{what}: {packed.layout.q_names[place]} = {y[place]:.9g} begins {where} it, "
        f"at {limit:.9g}, where nothing throws it back; begin between the stops, or let it leave "
        "at the start"
    )
