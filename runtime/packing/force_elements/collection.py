"""Numbers of all force elements, in the order of the scene's `forces`."""

from __future__ import annotations

from mstmm.scene import Scene

from ..expression_tapes import SeedPorts
from ..scene_frames import Frames
from ..system import ForceNumbers
from .bushings import bushing_numbers
from .springs import spring_numbers


def force_element_numbers(
    frames: Frames, nodes: Scene, moving: SeedPorts
) -> tuple[ForceNumbers, ...]:
    """Numbers of the springs, then the bushings, of the scene of nodes."""
    springs = (spring_numbers(frames, spring, moving) for spring in nodes.spring)
    return (*springs, *(bushing_numbers(frames, bushing) for bushing in nodes.bushing))
