"""What a run could not see or locate, one sentence each."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..pack.switches import MOST

if TYPE_CHECKING:
    from ..integrate.settings import Settings
    from .system import SceneSystem


def unseen(
    system: SceneSystem, settings: Settings, chatter: tuple[int, float] | None
) -> tuple[str, ...]:
    """Of a run's expressions: those that could not be mapped, are passed over by a fixed step, or
    switch without end (`chatter`: which one, and since when)."""
    known = system.engine.packed.time_map(settings.t_start, settings.t_end)
    found = list(known.notes)
    if settings.step is not None:
        found += [text] if (text := known.too_long(settings.step)) else []
    if len(system.switches) > MOST:
        found.append(
            f"more than {MOST} conditions depend on the motion; those behind the first {MOST} do "
            "not end a step where they switch: give max_step so that none is passed over"
        )
    if chatter is not None:
        found.append(endless(system, chatter))
    return tuple(found)


def endless(system: SceneSystem, chatter: tuple[int, float]) -> str:
    """A switch that holds the motion where it is."""
    switch, since = chatter
    return (
        f"{system.switches[switch].what} switches without end from t = {since:.9g} s on, because "
        "the forces on both sides drive the motion back to it, and no step ends there any more; "
        "make it smooth, such as tanh(u/0.001) for sign(u), or use the friction of the hinge's law"
    )
