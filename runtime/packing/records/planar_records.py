"""C records of the bodies of a planar mechanism, which moves in a plane in every state."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from mstmm.array_validation import Array
from mstmm.graph.mechanism_graph import GROUND

from ...kernels.c_records import CRecords, Memory
from ...kernels.prebuilt_kernels import Elements
from ..bodies import RIGID
from ..system import BodyNumbers, Numbers, System

_LOOP_FIELDS = ("first_row", "n_rows", "n_pending", "pending")


def attach_planar_bodies(
    model: Any,
    system: System,
    elements: Elements,
    memory: Memory,
    lib: Any,
    looped: CRecords,
    axes: Array,
    place: int,
) -> int:
    """Write the bodies of a planar mechanism, and reserve workspace for them at offset `place`.

    `axes` (3, 3) are those of the plane, `looped` the records of the closed loops by body.
    Returns the offset behind the numbers.
    """
    distinct, shared = list(_bodies_in_plane(system, axes)), dict[Numbers, Any]()
    floors = _Floors(elements, memory.ffi)
    prototypes = CRecords(memory.ffi, "mstmm_flat_body", len(distinct))
    for record, body in zip(prototypes.array, distinct, strict=False):
        numbers = _planar_numbers(body, floors.inertia_floor(body))
        if numbers not in shared:
            shared[numbers] = memory.reals(numbers)
        record.given = shared[numbers]
        record.idle = record.omitted = int(body.idle)
    records = CRecords(memory.ffi, "mstmm_flat_body", system.count)
    records.copy(slice(None), prototypes, system.distinct_indices)
    places = system.first_indices
    for name, column in {"parent": system.parents, "q": places["q"], "u": places["u"]}.items():
        records.write(name, column)
    for name in _LOOP_FIELDS:
        records.column(name)[:] = looped.column(name)
    records.column("omitted")[[closure.frame for closure in system.closures]] = 1
    memory.keep_alive.append(records)
    gravity = (axes.T @ system.gravity)[:2].tolist()
    memory.fill(model, flat=records.array, flat_numbers=place, flat_gravity=gravity)
    return place + int(lib.MSTMM_FLAT) * (1 + system.count)


def _bodies_in_plane(system: System, axes: Array) -> Iterator[BodyNumbers]:
    """Distinct bodies, with connections to the ground in the axes of the plane."""
    for run in system.bodies:
        for k, body in enumerate(run.members):
            if k or run.parent != GROUND:
                yield body
                continue
            rotation = axes.T @ np.reshape(body.connection[:9], (3, 3))
            shift = axes.T @ body.connection[9:12]
            yield replace(body, connection=(*rotation.ravel().tolist(), *shift.tolist()))


def _planar_numbers(body: BodyNumbers, floor: float) -> Numbers:
    """Numbers of MSTMM_GIVEN, in their order."""
    connection, mass = body.connection, body.body_p
    rotation, shift = (connection[0], connection[3]), connection[9:12]
    return (*rotation, *shift, body.rotor[0], floor, *mass[:3], mass[9])


class _Floors:
    """Moments of inertia of bodies below which they count as rounding."""

    def __init__(self, elements: Elements, ffi: Any) -> None:
        kind = "int (*)(const double *, double *)"
        self.mass, self.floors = ffi.new("double[21]"), ffi.new("double[2]")
        self.inertia = ffi.cast(kind, elements["body", RIGID].functions["inertia"])
        self.floor = ffi.cast(kind, elements["sweep", "frames"].functions["pivot_floor"])

    def inertia_floor(self, body: BodyNumbers) -> float:
        """Floor of the moments of inertia about any axis of a body, kg m^2."""
        self.inertia(list(body.body_p), self.mass)
        self.floor(self.mass, self.floors)
        return float(self.floors[1])


# --- detection ------------------------------------------------------------------------------------

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
