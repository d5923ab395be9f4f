"""Bodies of a scene in a plane -> C records, and room for their numbers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from mstmm.array_validation import Array
from mstmm.graph.mechanism_graph import GROUND

from ...kernels.c_records import CRecords
from ..bodies import RIGID
from ..scene_elements import Elements
from ..system import BodyNumbers, Numbers, System
from .memory import Memory

_OF_LOOPS = ("first_row", "n_rows", "n_pending", "pending")


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
    """Give the model the bodies of a plane with these axes (3, 3) and a place for their numbers in
    the workspace; returns the place behind them.  `looped` are the records of their closed loops.
    """
    distinct, shared = list(_in_axes(system, axes)), dict[Numbers, Any]()
    floors = _Floors(elements, memory.ffi)
    prototypes = CRecords(memory.ffi, "mstmm_flat_body", len(distinct))
    for record, body in zip(prototypes.array, distinct, strict=False):
        given = _given(body, floors.of(body))
        if given not in shared:
            shared[given] = memory.reals(given)
        record.given = shared[given]
        record.idle = record.aside = int(body.idle)
    records = CRecords(memory.ffi, "mstmm_flat_body", system.count)
    records.copy(slice(None), prototypes, system.which)
    places = system.places
    for name, column in {"parent": system.parents, "q": places["q"], "u": places["u"]}.items():
        records.write(name, column)
    for name in _OF_LOOPS:
        records.column(name)[:] = looped.column(name)
    records.column("aside")[[closure.frame for closure in system.closures]] = 1
    memory.kept.append(records)
    model.flat, model.flat_numbers = records.array, place
    model.flat_gravity = (axes.T @ system.gravity)[:2].tolist()
    return place + int(lib.MSTMM_FLAT) * (1 + system.count)


def _in_axes(system: System, axes: Array) -> Iterator[BodyNumbers]:
    """Every body that differs from others, told in the axes of the plane where it stands on the
    ground."""
    for run in system.bodies:
        for k, body in enumerate(run.alike):
            if k or run.parent != GROUND:
                yield body
                continue
            turned = axes.T @ np.reshape(body.connection[:9], (3, 3))
            shift = axes.T @ body.connection[9:12]
            yield replace(body, connection=(*turned.ravel().tolist(), *shift.tolist()))


def _given(body: BodyNumbers, floor: float) -> Numbers:
    """Numbers of MSTMM_GIVEN, in their order."""
    rotation, mass = body.connection, body.body_p
    turned, shift = (rotation[0], rotation[3]), rotation[9:12]
    return (*turned, *shift, body.rotor[0], floor, *mass[:3], mass[9])


class _Floors:
    """Least moments of inertia of bodies that are not rounding."""

    def __init__(self, elements: Elements, ffi: Any) -> None:
        kind = "int (*)(const double *, double *)"
        self.mass, self.found = ffi.new("double[21]"), ffi.new("double[2]")
        self.inertia = ffi.cast(kind, elements["body", RIGID].functions["inertia"])
        self.floor = ffi.cast(kind, elements["sweep", "frames"].functions["pivot_floor"])

    def of(self, body: BodyNumbers) -> float:
        """About any axis of the body."""
        self.inertia(list(body.body_p), self.mass)
        self.floor(self.mass, self.found)
        return float(self.found[1])
