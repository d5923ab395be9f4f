"""All that acts between two ends, in the order of the scene's `forces`."""

from __future__ import annotations

from mstmm.scene import Scene

from ..expression_tapes import Moving
from ..scene_frames import Frames
from ..system import ForceNumbers
from .bushings import bushing_of
from .springs import spring_of


def forces_of(frames: Frames, nodes: Scene, moving: Moving) -> tuple[ForceNumbers, ...]:
    """Springs, then bushings, of the scene of nodes."""
    springs = (spring_of(frames, spring, moving) for spring in nodes.spring)
    return (*springs, *(bushing_of(frames, bushing) for bushing in nodes.bushing))
