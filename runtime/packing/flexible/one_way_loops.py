"""One-way coupled flexible bodies in closed loops: their shapes must keep the loops closed.

The run closes the loops with these bodies rigid.  The elastic response added afterwards keeps them
closed if the sections in a loop do not move in the floating frame, except for rotations that its
hinges leave free: beams between pins with simply supported shapes.  Constraint loads then do no
work on the shapes, including those that rigid bodies do not determine.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.graph.closure_plan import ClosurePlan
from mstmm.graph.mechanism_graph import Paths
from mstmm.scene import Constraint, Hinge, Scene, split_reference
from mstmm.scene.tables.closures import ROLLING

from ...flexible.modal_body import ModalBody
from ...flexible.modal_port import ModalPort
from .held_rotations import constrained_rotations

#: Largest motion of a section, relative to the size of the shape, that counts as rounding.
_ROUNDING = 1e-6


def loop_elements(scene: Scene, plan: ClosurePlan) -> tuple[Hinge | Constraint, ...]:
    """Hinges of all loops, cut or not, followed by the constraints."""
    mechanism, paths = plan.mechanism, Paths(plan.mechanism, plan.tree)
    first = len(plan.cut_of)
    row_groups = [
        *(mechanism.groups[cut] for cut in plan.cut_of),
        *plan.groups[first : first + len(scene.constraint)],
    ]
    crossed = {plan.tree[body] for group in row_groups for body, _ in paths.crossed_bodies(group)}
    hinges = scene.skeleton.hinges
    return (*(hinges[number] for number in sorted(crossed.union(plan.cut_of))), *scene.constraint)


def check_loop_ends(
    bodies: Mapping[str, ModalBody], elements: tuple[Hinge | Constraint, ...]
) -> None:
    """Raise SceneError if a shape of one of the bodies moves a section that is in a loop."""
    for name, body in bodies.items():
        for element, end, inboard in ends_on_body(name, elements):
            port = body.ports[end]
            projection = _constrained_projection(element, port, inboard)
            shift, rotation = _section_motion(body, port, projection)
            moving = shift + rotation > _ROUNDING
            if not moving.any():
                continue
            table = "constraint" if isinstance(element, Constraint) else "hinge"
            first = int(moving.argmax())
            motion = "moves" if shift[first] > _ROUNDING else "rotates"
            raise SceneError(
                f'"{name}": model: shape {body.modes[first]} {motion} the end "{end}", where '
                f'{table} "{element.name}" closes a loop that one-way coupling would open; for a '
                'beam between pins use basis = "simply-supported" and frame = "chord", otherwise '
                'model = "flexible"'
            )


def ends_on_body(
    name: str, elements: tuple[Hinge | Constraint, ...]
) -> Iterator[tuple[Hinge | Constraint, str, bool]]:
    """Ends of a body on the elements: (element, end, whether it is the element's inboard one)."""
    for element in elements:
        pair = (
            (element.from_, element.to) if isinstance(element, Constraint)
            else (element.inboard, element.outboard)
        )  # fmt: skip
        for inboard, reference in zip((True, False), pair, strict=True):
            body, end = split_reference(reference)
            if body == name:
                yield element, end, inboard


def _constrained_projection(element: Hinge | Constraint, port: ModalPort, inboard: bool) -> Array:
    """Projection (3, 3) onto the rotations of a section that an element constrains."""
    if isinstance(element, Constraint):
        return np.eye(3) * (element.type == ROLLING)
    axes = port.rotation @ np.array(element.rotation) if inboard else port.rotation
    return constrained_rotations(element, axes, unknown=np.eye(3))


def _section_motion(body: ModalBody, port: ModalPort, projection: Array) -> tuple[Array, Array]:
    """Displacement and constrained rotation (modes,) of a section, relative to the shapes' size."""
    size = np.sqrt(np.diag(body.Mff) / body.mass)
    positions = np.array([port.position for port in body.ports.values()])
    length = float(np.linalg.norm(np.ptp(positions, axis=0))) or 1.0
    shift = np.abs(port.phi).max(axis=0)
    rotation = np.abs(projection @ port.theta).max(axis=0)
    return shift / size, length * rotation / size
