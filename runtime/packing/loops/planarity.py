"""Detection of planar mechanisms, which move in a plane in every state."""

from __future__ import annotations

import numpy as np

from mstmm.array_validation import Array
from mstmm.graph.mechanism_graph import GROUND

from ..bodies import RIGID
from ..scene_elements import Elements
from ..system import BodyNumbers, System

#: Rounding error of the entries that are zero in a rotation about z.
_ROUNDING = 1e-14
#: Force elements that do not depend on the choice of the inertial axes.
_FRAME_INDEPENDENT = {
    ("force", "spring"),
    ("force", "bushing6"),
    ("force", "bearing6"),
    ("force", "bearing3"),
}


def motion_plane(system: System, elements: Elements) -> Array | None:
    """Axes (3, 3) of the plane of motion in inertial axes, z normal to it; None without one.

    All bodies must be rigid, on parallel free hinge axes, and only hinges may close loops.
    Positions and loads normal to the plane do not matter.  If the plane is not the inertial xy
    plane, no load or force element may be given in inertial axes.
    """
    if not system.closures or system.couplings:
        return None
    if any(closure.kind != "hinge" for closure in system.closures):
        return None
    if not all(_is_planar_body(body, elements) for body in system.distinct):
        return None
    on_ground, on_bodies = _rotations(system)
    if not all(map(_is_about_z, on_bodies)):
        return None
    if all(map(_is_about_z, on_ground)):
        return np.eye(3)
    axes = on_ground[0]
    parallel = all(_is_about_z(axes.T @ rotation) for rotation in on_ground)
    return axes if parallel and not _has_inertial_loads(system) else None


def _is_planar_body(body: BodyNumbers, elements: Elements) -> bool:
    """Whether a body is rigid and on a free hinge that has planar kernels."""
    known = ("sweep", f"planar_{body.hinge[1]}") in elements
    return known and body.body[1] == RIGID and not any(body.imposed)


def _rotations(system: System) -> tuple[list[Array], list[Array]]:
    """Rotations Rt (3, 3) of the hinges on the ground, and of those on bodies."""
    on_ground, on_bodies = list[Array](), list[Array]()
    for run in system.bodies:
        for k, body in enumerate(run.members):
            rotation = np.reshape(body.connection[:9], (3, 3))
            (on_ground if k == 0 and run.parent == GROUND else on_bodies).append(rotation)
    return on_ground, on_bodies


def _is_about_z(rotation: Array) -> bool:
    zeros = (rotation[0, 2], rotation[1, 2], rotation[2, 0], rotation[2, 1])
    return bool(rotation[2, 2] > 0.0) and all(abs(entry) <= _ROUNDING for entry in zeros)


def _has_inertial_loads(system: System) -> bool:
    """Whether loads or force elements depend on the choice of the inertial axes."""
    if any(load.axes == GROUND for load in system.loads):
        return True
    return any(
        force.element not in _FRAME_INDEPENDENT or GROUND in (body for body, _, _ in force.ends)
        for force in system.forces
    )
