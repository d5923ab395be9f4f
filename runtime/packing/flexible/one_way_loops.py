"""Bodies that respond one way in closed loops: where loops pass them, and that they do not move
there.

The run closes loops with these bodies rigid.  A response on top of it leaves them closed where the
sections that a loop passes stay in the floating frame, but for turns that its hinges let go: beams
between pins, with the shapes of simply supported ones.  Loads of loops do no work on such shapes
then, those that rigid bodies do not determine among them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.graph.closure_plan import ClosurePlan
from mstmm.graph.tree_paths import Paths
from mstmm.scene import Constraint, Hinge, Scene, split_reference
from mstmm.scene.tables.closures import ROLLING

from ...flexible.modal_body import ModalBody
from ...flexible.modal_port import ModalPort
from .held_rotations import constrained_rotations

#: What a section moves by in parts of the size of the shape that is rounding.
_ROUNDING = 1e-6


def loop_elements(scene: Scene, plan: ClosurePlan) -> tuple[Hinge | Constraint, ...]:
    """The hinges around all loops, cut or not, and the constraints."""
    mechanism, paths = plan.mechanism, Paths(plan.mechanism, plan.tree)
    first = len(plan.cut_of)
    closing = [
        *(mechanism.groups[cut] for cut in plan.cut_of),
        *plan.groups[first : first + len(scene.constraint)],
    ]
    passed = {plan.tree[body] for group in closing for body, _ in paths.crossed(group)}
    hinges = scene.skeleton.hinges
    return (*(hinges[number] for number in sorted(passed.union(plan.cut_of))), *scene.constraint)


def check_loop_ends(
    bodies: Mapping[str, ModalBody], elements: tuple[Hinge | Constraint, ...]
) -> None:
    """SceneError for a shape of one of the bodies that moves a section which a loop passes."""
    for name, body in bodies.items():
        for element, end, inboard in ends_on_body(name, elements):
            port = body.ports[end]
            shift, turn = _moved(body, port, _held(element, port, inboard))
            moving = shift + turn > _ROUNDING
            if not moving.any():
                continue
            table = "constraint" if isinstance(element, Constraint) else "hinge"
            first = int(moving.argmax())
            does = "moves" if shift[first] > _ROUNDING else "turns"
            raise SceneError(
                f'"{name}": model: shape {body.modes[first]} {does} the end "{end}", where {table} '
                f'"{element.name}" closes a loop, and a body that responds one way does not close '
                'it again; on a beam between pins take basis = "simply-supported" and frame = '
                '"chord", or else model = "flexible"'
            )


def ends_on_body(
    name: str, elements: tuple[Hinge | Constraint, ...]
) -> Iterator[tuple[Hinge | Constraint, str, bool]]:
    """(element, end of the body on it, whether it is the inboard one)."""
    for element in elements:
        pair = (
            (element.from_, element.to) if isinstance(element, Constraint)
            else (element.inboard, element.outboard)
        )  # fmt: skip
        for inboard, reference in zip((True, False), pair, strict=True):
            body, end = split_reference(reference)
            if body == name:
                yield element, end, inboard


def _held(element: Hinge | Constraint, port: ModalPort, inboard: bool) -> Array:
    """(3, 3) projection on the turns of a section that an element holds."""
    if isinstance(element, Constraint):
        return np.eye(3) * (element.type == ROLLING)
    axes = port.rotation @ np.array(element.rotation) if inboard else port.rotation
    return constrained_rotations(element, axes, unknown=np.eye(3))


def _moved(body: ModalBody, port: ModalPort, held: Array) -> tuple[Array, Array]:
    """(modes,) twice: how far each shape shifts a section, and turns it by what is held, in parts
    of its own size."""
    size = np.sqrt(np.diag(body.Mff) / body.mass)
    places = np.array([one.position for one in body.ports.values()])
    length = float(np.linalg.norm(np.ptp(places, axis=0))) or 1.0
    shift, turn = np.abs(port.phi).max(axis=0), np.abs(held @ port.theta).max(axis=0)
    return shift / size, length * turn / size
