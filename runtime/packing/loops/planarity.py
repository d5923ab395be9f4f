"""Whether all of a mechanism moves in a plane, whatever its state."""

from __future__ import annotations

import numpy as np

from mstmm.array_validation import Array
from mstmm.graph.mechanism_graph import GROUND

from ..bodies import RIGID
from ..scene_elements import Elements
from ..system import BodyNumbers, System

#: How far entries of a rotation may be off that a turn about z leaves zero: rounding.
_ROUNDING = 1e-14
#: Force elements that act alike whichever axes all their numbers are told in.
_ALIKE = {("force", "spring"), ("force", "bushing6"), ("force", "bearing6"), ("force", "bearing3")}


def motion_plane(system: System, elements: Elements) -> Array | None:
    """Axes (3, 3) of the plane in inertial ones, z across it, if hinges alone close the loops, all
    are free and turn about one axis, and all bodies are rigid; else None.

    Where bodies lie across the plane makes no difference, nor what acts across it; but in a plane
    with axes of its own nothing may act that is told in inertial ones.
    """
    if not system.closures or system.couplings:
        return None
    if any(one.kind != "hinge" for one in system.closures):
        return None
    if not all(_is_pinned(body, elements) for body in system.distinct):
        return None
    standing, hanging = _rotations(system)
    if not all(map(_turns_in_it, hanging)):
        return None
    if all(map(_turns_in_it, standing)):
        return np.eye(3)
    axes = standing[0]
    together = all(_turns_in_it(axes.T @ rotation) for rotation in standing)
    return axes if together and not _acts_from_outside(system) else None


def _is_pinned(body: BodyNumbers, elements: Elements) -> bool:
    """Whether the body is a rigid one on a free hinge that there are kernels for."""
    known = ("sweep", f"planar_{body.hinge[1]}") in elements
    return known and body.body[1] == RIGID and not any(body.imposed)


def _rotations(system: System) -> tuple[list[Array], list[Array]]:
    """Of the hinges on the ground, and of those on bodies."""
    standing, hanging = list[Array](), list[Array]()
    for run in system.bodies:
        for k, body in enumerate(run.alike):
            on_ground = k == 0 and run.parent == GROUND
            found = np.reshape(body.connection[:9], (3, 3))
            (standing if on_ground else hanging).append(found)
    return standing, hanging


def _turns_in_it(rotation: Array) -> bool:
    across = (rotation[0, 2], rotation[1, 2], rotation[2, 0], rotation[2, 1])
    return bool(rotation[2, 2] > 0.0) and all(abs(entry) <= _ROUNDING for entry in across)


def _acts_from_outside(system: System) -> bool:
    if any(load.axes == GROUND for load in system.loads):
        return True
    return any(
        force.element not in _ALIKE or GROUND in (body for body, _, _ in force.ends)
        for force in system.forces
    )
