"""Numbers of force elements between two ends: springs, user-defined types and bushings."""

from __future__ import annotations

from mstmm.numerics.rotations import Matrix, Vector, product, rotate, to_matrix, transpose
from mstmm.scene import Bushing, Scene, Spring

from .expression_tapes import SeedPorts, effort_kernel
from .scene_elements import declared_numbers
from .scene_frames import Frames
from .system import ForceNumbers, Numbers


def force_element_numbers(
    frames: Frames, nodes: Scene, moving: SeedPorts
) -> tuple[ForceNumbers, ...]:
    """Numbers of the springs, then the bushings, of the scene of nodes, in this order."""
    springs = (_spring_numbers(frames, spring, moving) for spring in nodes.spring)
    return (*springs, *(_bushing_numbers(frames, bushing) for bushing in nodes.bushing))


def _spring_numbers(frames: Frames, spring: Spring, moving: SeedPorts) -> ForceNumbers:
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


def _bushing_numbers(frames: Frames, bushing: Bushing) -> ForceNumbers:
    """Force element between the unloaded pose, fixed to the body of `from`, and the end `to`.

    The axes of its two ends coincide in the unloaded pose.
    """
    body, axes, position = _end(frames, bushing, bushing.from_)
    bushing_axes = product(axes, bushing.rotation)
    shift = rotate(bushing_axes, bushing.rest.position)
    rest = (position[0] + shift[0], position[1] + shift[1], position[2] + shift[2])
    to_body, to_axes, to_position = _end(frames, bushing, bushing.to)
    to_axes = product(to_axes, transpose(bushing.rest.rotation))
    ends = (
        (body, _row_major_entries(bushing_axes), rest),
        (to_body, _row_major_entries(to_axes), to_position),
    )
    return ForceNumbers(("force", bushing.element), ends, bushing.numbers, None)


def _end(frames: Frames, bushing: Bushing, reference: str) -> tuple[int, Matrix, Vector]:
    """Position in the tree, axes and offset (m) of an end."""
    body, (a, b, c, d, e, f, g, h, i), offset = frames.end(reference)
    x, y, z = bushing.position if body < 0 else offset
    return body, to_matrix([[a, b, c], [d, e, f], [g, h, i]]), (x, y, z)


def _row_major_entries(matrix: Matrix) -> Numbers:
    return (*matrix[0], *matrix[1], *matrix[2])
