"""Deflection of stiff springs, which the error estimate of a run does not include.

A stiff spring often models a constraint. The equations treat it like any other spring, so its
deflection is part of their solution, however accurate the run.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array

from .certificate_data import SpringDeflection
from .result_record import Record

if TYPE_CHECKING:
    from mstmm.scene import Spring


#: Scenes with more springs are not checked.
_MAX_SPRINGS = 200


def stiffest_spring_deflection(result: Record) -> SpringDeflection | None:
    """Largest deflection of the stiffest spring of a scene.

    Of the springs and bushings between ends and of hinges with all motions free; None if there are
    none, without samples, and for scenes with too many springs.
    """
    scene = result.model.scene
    springs = [s for s in scene.spring if s.type == "spring" and s.law.stiffness > 0]
    mounts = [h for h in scene.hinge if h.facts is not None and h.facts.free_body]
    bushings = [b for b in scene.bushing if b.stiffest[0] > 0]
    if not len(result.t) or not 0 < len(springs) + len(mounts) + len(bushings) <= _MAX_SPRINGS:
        return None
    stiffest_spring = max(springs, key=lambda s: s.law.stiffness, default=None)
    deflections: list[SpringDeflection] = []
    if stiffest_spring is not None:
        deflections.append(
            SpringDeflection(
                f'spring "{stiffest_spring.name}"',
                stiffest_spring.law.stiffness,
                _max_stretch(result, stiffest_spring),
            )
        )
    stiffest_bushing = max(bushings, key=lambda b: b.stiffest[0], default=None)
    if stiffest_bushing is not None:
        deflection = result.quantity(f"{stiffest_bushing.name}.deflection").values
        deflections.append(
            SpringDeflection(
                f'bushing "{stiffest_bushing.name}"',
                stiffest_bushing.stiffest[0],
                _max_length(deflection),
            )
        )
    for mount in mounts:
        entries = [mount.law.entry(k) for k in range(3)]
        if any(entry.stiffness > 0 for entry in entries):
            offsets = result.coordinates(mount.name)[:, :3] - [entry.rest for entry in entries]
            stiffness = max(entry.stiffness for entry in entries)
            sprung_offsets = offsets[:, [entry.stiffness > 0 for entry in entries]]
            deflections.append(
                SpringDeflection(f'hinge "{mount.name}"', stiffness, _max_length(sprung_offsets))
            )
    return max(deflections, key=lambda give: give.stiffness, default=None)


def _max_stretch(result: Record, spring: Spring) -> float:
    """Largest |length - rest| in m."""
    ends = [
        np.array(spring.position) if end == "ground" else result.position(end)
        for end in (spring.from_, spring.to)
    ]
    difference = np.asarray(ends[1] - ends[0])
    return _max_length((np.linalg.norm(difference, axis=1) - spring.law.rest)[:, None])


def _max_length(rows: Array) -> float:
    lengths = np.linalg.norm(rows, axis=1)
    return float(np.max(lengths[np.isfinite(lengths)], initial=0.0))
