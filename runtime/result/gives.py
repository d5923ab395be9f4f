"""Deflection of stiff springs, which the error estimate of a run does not count.

A stiff spring often stands for a constraint.  To the equations it is a spring like any other, so
that what it gives by is part of their solution, however accurate the run.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mstmm.arrays import Array

from .evidence import Give
from .record import Record

if TYPE_CHECKING:
    from mstmm.scene import Spring


#: Scenes with more springs are not checked.
_MOST = 200


def stiffest(result: Record) -> Give | None:
    """Of the springs and bushings between ends and of hinges with all motions free; None where
    there is none, where nothing was sampled, and for scenes of very many."""
    scene = result.model.scene
    springs = [s for s in scene.spring if s.type == "spring" and s.law.stiffness > 0]
    mounts = [h for h in scene.hinge if h.facts is not None and h.facts.free_body]
    bushings = [b for b in scene.bushing if b.stiffest[0] > 0]
    if not len(result.t) or not 0 < len(springs) + len(mounts) + len(bushings) <= _MOST:
        return None
    stiff = max(springs, key=lambda s: s.law.stiffness, default=None)
    found: list[Give] = []
    if stiff is not None:
        found.append(Give(f'spring "{stiff.name}"', stiff.law.stiffness, _stretch(result, stiff)))
    stiff_one = max(bushings, key=lambda b: b.stiffest[0], default=None)
    if stiff_one is not None:
        moved = result.quantity(f"{stiff_one.name}.deflection").values
        found.append(Give(f'bushing "{stiff_one.name}"', stiff_one.stiffest[0], _largest(moved)))
    for mount in mounts:
        entries = [mount.law.entry(k) for k in range(3)]
        if any(e.stiffness > 0 for e in entries):
            away = result.coordinate(mount.name)[:, :3] - [e.rest for e in entries]
            stiffness = max(e.stiffness for e in entries)
            held = away[:, [e.stiffness > 0 for e in entries]]
            found.append(Give(f'hinge "{mount.name}"', stiffness, _largest(held)))
    return max(found, key=lambda give: give.stiffness, default=None)


def _stretch(result: Record, spring: Spring) -> float:
    """Largest |length - rest| in m."""
    ends = [
        np.array(spring.position) if end == "ground" else result.position(end)
        for end in (spring.from_, spring.to)
    ]
    between = np.asarray(ends[1] - ends[0])
    return _largest((np.linalg.norm(between, axis=1) - spring.law.rest)[:, None])


def _largest(rows: Array) -> float:
    lengths = np.linalg.norm(rows, axis=1)
    return float(np.max(lengths[np.isfinite(lengths)], initial=0.0))
