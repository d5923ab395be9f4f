"""Calls of the looped engine with NumPy arrays; failure messages name the element."""

from __future__ import annotations

import threading
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np

from mstmm.array_validation import Array

from ..packing.packed_scene import PackedScene
from .failure_messages import failure_text


@dataclass(frozen=True)
class Probe:
    """Point with axes on a body: topology index (-1: ground), axes (9) and offset (3), internal."""

    body: int
    axes: tuple[float, ...]
    offset: tuple[float, ...]


@dataclass(frozen=True)
class Observation:
    """Observed quantities of n states, in inertial axes.

    points: (n, probes, 24): position, velocity, acceleration, angular velocity, angular
    acceleration, rotation matrix (row by row).  loads: (n, bodies, 6) force and moment of each
    inboard hinge.  efforts, udot: (n, nu).  sums: (n, 10): kinetic, gravity and spring energy,
    power, momentum (3), angular momentum about the inertial origin (3).  rows: (n, rows)
    multipliers of closed loops.
    """

    points: Array
    loads: Array
    efforts: Array
    udot: Array
    sums: Array
    rows: Array
    failures: tuple[str, ...] = ()


#: Names of the arrays of an Observation.
OBSERVATION_PARTS = ("points", "loads", "efforts", "udot", "sums", "rows")


class EngineCalls:
    """Calls of the compiled engine on one packed scene; thread-safe."""

    def __init__(self, packed: PackedScene) -> None:
        self.packed = packed
        self.ffi, self.lib = packed.ffi, packed.lib
        self.nq, self.nu = packed.layout.nq, packed.layout.nu
        #: Data of each thread.
        self.local = threading.local()

    def workspace(self) -> Any:
        """Workspace of this thread as `real *`."""
        size = self.packed.workspace
        if getattr(self.local, "size", None) != size:
            self.local.array = np.zeros(size)
            self.local.pointer = self.pointer(self.local.array)
            self.local.size = size
        return self.local.pointer

    def workspace_array(self) -> Array:
        """View of this thread's workspace after its last call."""
        self.workspace()
        return np.asarray(self.local.array)

    def pointer(self, array: Array) -> Any:
        """`real *` to a contiguous array of doubles."""
        return self.ffi.from_buffer("real[]", array)

    def start_memory(self) -> Array:
        """Initial memory: no releases, no turns counted, stored inputs at their initial values."""
        system = self.packed.system
        memory = np.zeros(max(1, system.n_memory))
        memory[system.held_inputs.first : system.n_memory] = system.held_inputs.start
        return memory

    @cached_property
    def inertia_only(self) -> Self:
        """Calls on the same tree without gravity, laws, drives and loads."""
        return self._with_gravity((0.0, 0.0, 0.0))

    @cached_property
    def gravity_only(self) -> Self:
        """Calls on the same tree with its gravity, without laws, drives and loads."""
        return self._with_gravity(tuple(self.packed.model.gravity))

    @cached_property
    def unit_gravity(self) -> tuple[Self, ...]:
        """Calls like `gravity_only`, with gravity of 1 m/s^2 along each inertial axis."""
        return tuple(self._with_gravity(tuple(row)) for row in np.eye(3).tolist())

    def _with_gravity(self, gravity: tuple[float, ...]) -> Self:
        model = self.ffi.new("mstmm_model *", self.packed.model[0])
        model.gravity = list(gravity)
        model.n_laws = model.n_drives = model.n_values = 0
        model.n_loads = model.n_forces = 0
        model.needs_pose = int(self.packed.system.has_loops)
        model.product = self.ffi.NULL
        return type(self)(replace(self.packed, model=model))

    def probes(self, probes: Sequence[Probe]) -> Any:
        """Probes as a C array `mstmm_probe[]`."""
        records = self.ffi.new("mstmm_probe[]", max(1, len(probes)))
        for record, probe in zip(records, probes, strict=False):
            record.body = probe.body
            record.axes = list(probe.axes)
            record.offset = list(probe.offset)
        return records

    def observe(
        self,
        t: Array,
        q: Array,
        u: Array,
        memory: Array,
        probes: Sequence[Probe] = (),
        parts: Collection[str] = OBSERVATION_PARTS,
    ) -> Observation:
        """Compute the arrays named in `parts` for n states.

        The row of a state that cannot be evaluated is nan; `failures` contains a message for the
        first failure of each kind.  Arrays that are not requested have no columns.
        """
        n, part_indices = len(t), {name: i for i, name in enumerate(OBSERVATION_PARTS)}
        bodies, numbers = self.packed.topology.count, int(self.lib.MSTMM_PROBE_NUMBERS)
        loops = self.packed.written.loops
        shapes = [
            (len(probes), numbers), (bodies, 6), (self.nu,), (self.nu,),
            (int(self.lib.MSTMM_SUM_NUMBERS),), (0 if loops is None else loops.count,),
        ]  # fmt: skip
        arrays = [
            np.full((n, *shape), np.nan) if name in parts else np.empty((n, *shape[:-1], 0))
            for name, shape in zip(OBSERVATION_PARTS, shapes, strict=True)
        ]
        states = [np.ascontiguousarray(x, dtype=np.float64) for x in (t, q, u, memory)]
        observation_record = self.ffi.new("mstmm_observation *")
        records = self.probes(probes)
        observation_record.n_probes, observation_record.probes = len(probes), records
        failure, failed_row = self.ffi.new("mstmm_failure *"), self.ffi.new("int64_t *")
        failures: dict[tuple[int, int], list[str]] = {}
        first = 0
        while first < n:
            for name in parts:
                setattr(observation_record, name, self.pointer(arrays[part_indices[name]][first:]))
            code = self.lib.mstmm_observe_many(
                self.packed.model, self.workspace(), n - first,
                *(self.pointer(x[first:]) for x in states), observation_record, failure, failed_row,
            )  # fmt: skip
            if not code:
                break
            text = self.failure_text(failure, float(states[0][first + int(failed_row[0])]))
            failures.setdefault((int(failure.reason), int(failure.element)), []).append(text)
            first += int(failed_row[0]) + 1
        points, loads, efforts, udot, sums, rows = arrays
        return Observation(
            points,
            loads,
            efforts,
            udot,
            sums,
            rows,
            tuple(map(_first_with_count, failures.values())),
        )

    def sums(self, t: float, q: Array, u: Array, memory: Array) -> tuple[Array, str]:
        """Compute `Observation.sums` of one state; nan with a message if that fails, else ""."""
        sums_found = np.full(int(self.lib.MSTMM_SUM_NUMBERS), np.nan)
        observation_record, failure = (
            self.ffi.new("mstmm_observation *"),
            self.ffi.new("mstmm_failure *"),
        )
        observation_record.sums = self.pointer(sums_found)
        state = (self.pointer(np.ascontiguousarray(x, dtype=np.float64)) for x in (q, u, memory))
        if self.lib.mstmm_observe(
            self.packed.model, self.workspace(), t, *state, observation_record, failure
        ):
            return sums_found, self.failure_text(failure, t)
        return sums_found, ""

    # --- messages -------------------------------------------------------------------------------

    def hinge_name(self, position: int) -> str:
        """Name of the inboard hinge of the body at a topology index."""
        packed = self.packed
        return packed.scene.hinges.name(packed.topology.scene_indices(position)[1])

    def closing_label(self, position: int) -> str:
        """Label of the element that closes a loop with the frame at a topology index."""
        name, _, table = self.hinge_name(position).partition("/")
        return f'{table or "hinge"} "{name}"'

    def is_flexible(self, position: int) -> bool:
        """True if the body at a topology index is a node of a flexible body."""
        expanded = self.packed.expanded
        return expanded is not None and expanded.is_node(self.body_name(position))

    def body_name(self, position: int) -> str:
        """Name of the body at a topology index."""
        packed = self.packed
        return packed.scene.bodies.name(packed.topology.scene_indices(position)[0])

    def failure_text(self, failure: Any, t: float) -> str:
        """Message for a failure of the engine: element, time, cause, remedy."""
        reason, element, code = int(failure.reason), int(failure.element), int(failure.code)
        return failure_text(self, reason, element, code, t)


def _first_with_count(texts: list[str]) -> str:
    """First of several failures of one kind, with the number of further samples."""
    further_count = len(texts) - 1
    return texts[0] + (f" (and {further_count} more samples)" if further_count else "")
