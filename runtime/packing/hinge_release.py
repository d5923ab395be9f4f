"""Hinges that are released during a run."""

from __future__ import annotations

from mstmm.scene import Scene


def releasable_hinges(scene: Scene) -> list[str]:
    """Names of hinges that may be released, by their own `release` or by an event."""
    names = [h.name for h in scene.hinge if h.release is not None]
    for event in scene.event:
        if event.do == "release" and event.hinge not in names:
            names.append(str(event.hinge))
    return names


def hinges_released_by_time(scene: Scene, t: float) -> list[str]:
    """Names of hinges that are released at t (s) by conditions that depend on time only."""
    releases = [(h.name, h.release) for h in scene.hinge if h.release is not None]
    events = [(str(e.hinge), e.when) for e in scene.event if e.do == "release"]
    return [
        name for name, condition in releases + events
        if condition.depends_on_time_only and condition.evaluate(lambda _: t) > 0
    ]  # fmt: skip
