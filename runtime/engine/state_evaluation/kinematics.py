"""Points of a scene at given states: positions, motion, and Jacobians.

Given coordinates and speeds are used unchanged, including driven ones; laws, loads and gravity are
omitted, so that no acceleration has to be determined.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from mstmm.argument_validation import require_texts
from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure

from ...kernels.prepared_calls import PreparedCall, prepare_call, unavailable_call
from ...kernels.scene_libraries import FusedLibrary
from ..fused_code import FusedCode
from ..looped_engine import LoopedEngine, Probe
from ..quantity_registry import POINT_COLUMNS, BodyReferences
from .state_calls import is_small

#: Columns of a probe: velocity and angular velocity; acceleration and angular acceleration.
_VELOCITY_COLUMNS = [*range(3, 6), *range(9, 12)]
_ACCELERATION_COLUMNS = [*range(6, 9), *range(12, 15)]
_ANGULAR_VELOCITY_COLUMNS = POINT_COLUMNS["angular_velocity"]

#: Name of one body or end, or several names.
Names = str | Sequence[str]


#: Kind of a call of `Kinematics.call` -> whether it needs u in addition to q, and the result shape
#: for one point.
_CALL_SHAPES: dict[str, tuple[bool, tuple[int, ...]]] = {
    "places": (False, (3,)), "poses": (False, (4, 4)), "velocities": (True, (6,)),
    "jacobian": (False, (6,)), "jacobian_rate": (True, (6,)),
}  # fmt: skip

#: Entries (by, row, column, value) of the rotation of increments: the rate of `row` due to `column`
#: is `value` times the speed `by`.
Brackets = list[tuple[int, int, int, float]]


class Kinematics:
    """Kinematic calls on one packed scene; thread-safe.

    Rows of states are arrays (n, nq), (n, nu).  `brackets` returns those of the increments, None if
    they depend on the state.  Requests for bodies trigger a search for code of the scene.
    """

    def __init__(
        self, engine: LoopedEngine, fusion: FusedCode, references: BodyReferences,
        brackets: Callable[[], Brackets | None],
    ) -> None:  # fmt: skip
        self._engine, self._fusion, self._references = engine.inertia_only, fusion, references
        self._brackets, self._has_modes = brackets, bool(engine.packed.layout.modal)
        self._probes_by_names = dict[Names, list[Probe]]()
        self._records = dict[Names, tuple[Any, int]]()
        self._calls = dict[tuple[str, Names], PreparedCall]()
        #: Number of requests of bodies or ends without code of the scene.
        self._request_counts = dict[Names, int]()
        self._local = threading.local()
        self._numbers = int(engine.lib.MSTMM_PROBE_NUMBERS)

    def prepared_call(self, kind: str, of: Names) -> PreparedCall:
        """Prepared call on one state, q (nq,) or q and u (nu,), for bodies or ends.

        `kind` is "places", "poses", "velocities", "jacobian" or "jacobian_rate".
        """
        key = tuple(of) if type(of) is list else of
        try:
            call = self._calls.get((kind, key))
        except TypeError:  # no names: `require_texts` raises the error
            call = None
        if call is None:
            key = of if isinstance(of, str) else require_texts("of", of, "rod1.tip")
            call = self._calls.get((kind, key))
        if call is None or key in self._request_counts:
            call = self._sought(kind, key)
        return call

    def _sought(self, kind: str, key: Names) -> PreparedCall:
        """Prepared call; calls number 1, 2, 4, 8, ... search for code first."""
        request_count = self._request_counts[key] = self._request_counts.get(key, 0) + 1
        call = self._calls.get((kind, key))
        if call is None or request_count & (request_count - 1) == 0:
            bodies = [probe.body for probe in self._probes_of(key)]
            needs_loops = (
                self._has_modes or min(bodies, default=-1) < 0 or bool(self._fusion.obstacle)
            )
            codes = (
                []
                if needs_loops
                else [self._fusion.ready_points(body, request_count) for body in bodies]
            )
            available = [code for code in codes if code is not None]
            is_complete = not needs_loops and len(available) == len(bodies)
            if is_complete:  # prepare calls of the looped engine again
                for other_kind in _CALL_SHAPES:
                    self._calls.pop((other_kind, key), None)
            if is_complete or needs_loops:
                self._request_counts.pop(key, None)
            call = self._calls[kind, key] = self._prepare(
                kind, key, available if is_complete else None
            )
        return call

    def evaluate_rows(
        self, kind: str, of: Names, general: Callable[..., Array], *states: Array
    ) -> Array:
        """Evaluate "jacobian" or "jacobian_rate" (n, k, 6, nu) at rows of states.

        The prepared call is used, or `general(of, row, ...)` where it returns None.
        """
        call, count = self.prepared_call(kind, of), self._probes(of)[1]
        rows = np.empty((len(states[0]), count, 6, self._engine.nu))
        for row, state in zip(rows, zip(*states, strict=True), strict=True):
            result = call(*state)
            row[:] = general(of, *state) if result is None else result
        return rows

    def _prepare(self, kind: str, of: Names, codes: list[FusedLibrary] | None) -> PreparedCall:
        engine, (probes, count) = self._engine, self._probes(of)
        if codes is not None:
            fused_record = _FusedPointsRecord(engine, self._fusion, self._probes_of(of), codes)
            return self._prepare_record_call(kind, of, "compiled_points", fused_record)
        needs_jacobian = kind.startswith("jacobian")
        brackets = self._brackets() if kind == "jacobian_rate" and not self._has_modes else []
        if brackets is None or not is_small(engine) or (needs_jacobian and self._has_modes):
            return unavailable_call
        record = _LoopedPointsRecord(engine, self._workspace, probes, count, brackets)
        return self._prepare_record_call(kind, of, "points", record)

    def _prepare_record_call(
        self, kind: str, of: Names, functions: str, record: Any
    ) -> PreparedCall:
        nq, nu = self._engine.nq, self._engine.nu
        needs_speeds, shape = _CALL_SHAPES[kind]
        point_axis = () if isinstance(of, str) else (len(of),)
        return prepare_call(
            f"mstmm_{functions}_{kind}", record.record, (nq, nu)[: 1 + needs_speeds],
            (*point_axis, *shape, *((nu,) if kind.startswith("jacobian") else ())), kept=record,
        )  # fmt: skip

    @cached_property
    def _workspace(self) -> Any:
        """Workspace shared by all prepared calls, of which only one runs at a time."""
        return self._engine.pointer(np.zeros(self._engine.packed.workspace))

    def points(self, of: Names, q: Array, u: Array, udot: Array) -> Array:
        """Motion (n, k, 24) of k bodies or ends; see `Observation`."""
        probes, count = self._probes(of)
        points_found = np.empty((len(q), count, self._numbers))
        pointers = (self._engine.pointer(array) for array in (q, u, udot))
        self._run(
            "moving_points", len(q), *pointers, count, probes, self._engine.pointer(points_found)
        )
        return points_found

    def points_at_rest(self, of: Names, q: Array) -> Array:
        """Result of `points` for n states at rest."""
        zeros = np.zeros((len(q), self._engine.nu))
        return self.points(of, q, zeros, zeros)

    def velocities(self, of: Names, q: Array, u: Array) -> Array:
        """Velocity and angular velocity (n, k, 6) in inertial axes."""
        return self.points(of, q, u, np.zeros(u.shape))[..., _VELOCITY_COLUMNS]

    def jacobian(self, of: Names, q: Array) -> Array:
        """Jacobian (k, 6, nu) at one state: derivative of `velocities` with respect to speeds."""
        if self._has_modes:
            return self._jacobian_by_unit_speeds(of, q)
        probes, count = self._probes(of)
        jacobian_matrix = np.empty((count, 6, self._engine.nu))
        self._run(
            "jacobians",
            self._engine.pointer(q),
            count,
            probes,
            self._engine.pointer(jacobian_matrix),
        )
        return jacobian_matrix

    def _jacobian_by_unit_speeds(self, of: Names, q: Array) -> Array:
        """Jacobian (k, 6, nu) from unit speeds, including modal rates."""
        nu = self._engine.nu
        q_rows, units = np.tile(q, (nu, 1)), np.eye(nu)
        return np.moveaxis(
            self.points(of, q_rows, units, np.zeros((nu, nu)))[..., _VELOCITY_COLUMNS], 0, -1
        )

    def jacobian_rate(self, of: Names, q: Array, u: Array, turning: Array | None) -> Array:
        """Rate (k, 6, nu) of `jacobian` along speeds u (nu,), at one state.

        Accelerations at udot = 0 are quadratic in the speeds; half of their derivative along u is
        the part of J' that is symmetric in u and the speed of the column.  The antisymmetric part
        is the bracket of both: the cross product of the angular velocities, and J times the bracket
        of the speeds, -`turning` (nu, nu; None: zero), which is the rate of the increments.
        """
        nu = self._engine.nu
        size = max(1.0, float(np.abs(u).max(initial=0.0)))
        steps = size * np.eye(nu)
        speeds = np.concatenate([u + steps, u - steps])
        accelerations = self.points(of, np.tile(q, (2 * nu, 1)), speeds, np.zeros((2 * nu, nu)))
        accelerations = accelerations[..., _ACCELERATION_COLUMNS]
        rate = np.moveaxis(accelerations[:nu] - accelerations[nu:], 0, -1) / (4 * size)
        jacobian = self.jacobian(of, q)
        angular_velocities = (jacobian @ u)[:, 3:]
        rate[:, 3:] += np.cross(angular_velocities[:, :, None], jacobian[:, 3:], axis=1) / 2
        return rate if turning is None else rate - jacobian @ turning / 2

    def _probes(self, of: Names) -> tuple[Any, int]:
        """Cached C records of bodies and ends; raises SceneError for an unknown name."""
        key = of if isinstance(of, str) else tuple(of)
        record = self._records.get(key)
        if record is None:
            probes = self._probes_of(of)
            record = self._records[key] = self._engine.probes(probes), len(probes)
        return record

    def _probes_of(self, of: Names) -> list[Probe]:
        key = of if isinstance(of, str) else require_texts("of", of, "rod1.tip")
        probes = self._probes_by_names.get(key)
        if probes is None:
            names = [key] if isinstance(key, str) else key
            canonical_names = map(self._references.canonical_name, names)
            probes = self._probes_by_names[key] = [
                Probe(*self._engine.packed.end(name_of_end)) for name_of_end in canonical_names
            ]
        return probes

    def _run(self, function: str, *given: Any) -> None:
        record = self._thread_record()
        c_function = getattr(self._engine.lib, f"mstmm_{function}")
        if c_function(record.record, *given, record.failure):
            raise NumericalFailure(self._engine.failure_text(record.failure, 0.0))

    def _thread_record(self) -> _KinematicsRecord:
        """Record of this thread."""
        record: _KinematicsRecord | None = getattr(self._local, "made", None)
        if record is None:
            record = self._local.made = _KinematicsRecord(self._engine)
        return record


class _KinematicsRecord:
    """C record for the general calls of one thread."""

    __slots__ = ("_references", "failure", "record")

    def __init__(self, engine: LoopedEngine) -> None:
        self.record = engine.ffi.new("mstmm_kinematics *")
        self.failure = engine.ffi.new("mstmm_failure *")
        self._references = _fill_record(self.record, engine, engine.workspace())


class _FusedPointsRecord:
    """C record for prepared calls with fused code."""

    def __init__(
        self,
        engine: LoopedEngine,
        fusion: FusedCode,
        probes: list[Probe],
        codes: list[FusedLibrary],
    ) -> None:
        ffi, pointer = engine.ffi, engine.pointer
        self.record = record = ffi.new("mstmm_compiled_points *")
        ends = np.array([[*probe.offset, *probe.axes] for probe in probes])
        arrays = ends.ravel(), np.array(fusion.numbers), engine.start_memory(), np.zeros(engine.nu)
        pointers = [pointer(array) for array in arrays]
        record.ends, record.p, record.memory, record.none = pointers
        libraries = ffi.new("mstmm_fused *[]", [ffi.cast("mstmm_fused *", library.descriptor)
                                                for library in codes])  # fmt: skip
        record.n_probes, record.codes = len(codes), libraries
        self._references = *pointers, libraries, codes


class _LoopedPointsRecord:
    """C record for prepared calls of the looped engine for given bodies or ends."""

    def __init__(
        self, engine: LoopedEngine, room: Any, probes: Any, count: int, brackets: Brackets
    ) -> None:
        nu, bodies = engine.nu, engine.packed.topology.count
        self.record = record = engine.ffi.new("mstmm_points *")
        pointers = [engine.pointer(np.empty(size)) for size in (nu, 6 * nu)]
        record.speeds, record.rows = pointers
        path = engine.ffi.from_buffer("int[]", np.empty(bodies, dtype=np.int32))
        bracket_records = engine.ffi.new("mstmm_bracket[]", brackets)
        record.n_probes, record.probes, record.way = count, probes, path
        record.n_brackets, record.brackets = len(brackets), bracket_records
        self._references = (
            *pointers,
            probes,
            path,
            bracket_records,
            *_fill_record(record.at, engine, room),
            room,
            engine,
        )


def point_motions(
    engine: LoopedEngine, probes: Sequence[Probe], q: Array, u: Array, udot: Array
) -> Array:
    """Motion (k, 24) of k points in one state, also where no accelerations can be determined."""
    record = _KinematicsRecord(engine)
    motions = np.empty((len(probes), int(engine.lib.MSTMM_PROBE_NUMBERS)))
    pointers = [engine.pointer(np.ascontiguousarray(x, dtype=np.float64)) for x in (q, u, udot)]
    if engine.lib.mstmm_moving_points(
        record.record, 1, *pointers, len(probes), engine.probes(probes), engine.pointer(motions),
        record.failure,
    ):  # fmt: skip
        raise NumericalFailure(engine.failure_text(record.failure, 0.0))
    return motions


def _fill_record(record: Any, engine: LoopedEngine, workspace: Any) -> list[Any]:
    """Fill an `mstmm_kinematics` record; returns the memory to which it points."""
    arrays = engine.start_memory(), np.zeros(engine.nu), np.empty(engine.nu)
    pointers = [engine.pointer(array) for array in arrays]
    record.model, record.workspace = engine.packed.model, workspace
    record.memory, record.none, record.work = pointers
    return pointers
