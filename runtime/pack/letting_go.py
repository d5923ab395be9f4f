"""Hinges that let go during a run."""

from __future__ import annotations

from mstmm.scene import Scene


def releasable(scene: Scene) -> list[str]:
    """Hinges that let go during the run, by their own `release` or by an event."""
    names = [h.name for h in scene.hinge if h.release is not None]
    for event in scene.event:
        if event.do == "release" and event.hinge not in names:
            names.append(str(event.hinge))
    return names
