"""Numbers of springs and of user-defined force elements."""

from __future__ import annotations

from mstmm.scene import Spring

from ..expression_tapes import SeedPorts, effort_kernel
from ..scene_elements import declared_numbers
from ..scene_frames import Frames
from ..system import ForceNumbers, Numbers


def spring_numbers(frames: Frames, spring: Spring, moving: SeedPorts) -> ForceNumbers:
    """Force element between the ends of a spring, with its effort expression if it has one."""
    element = frames.elements.get("force", spring.type, spring.name)
    from_end, to_end = (
        (body, axes, spring.position if body < 0 else offset)
        for body, axes, offset in map(frames.end, (spring.from_, spring.to))
    )
    law, effort = spring.law, None
    if spring.type == "spring":
        p: Numbers = (law.stiffness, law.rest, law.damping)
        if not law.effort.is_zero:
            effort = effort_kernel(law.effort, frames.layout, moving)
    else:
        p = declared_numbers(element.declared, spring.parameters, f'spring "{spring.name}"')
    return ForceNumbers(("force", spring.type), (from_end, to_end), p, effort)
