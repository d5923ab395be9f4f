"""Looped engine of a packed scene: observations, accelerations, inverse dynamics, mass matrix."""

from __future__ import annotations

import threading
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike

from mstmm.abi.failure_codes import FailureCode
from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure, UndeterminedMotionError

from ..packing.packed_scene import PackedScene
from .failure_messages import failure_text, find_nonfinite_expression

if TYPE_CHECKING:
    from mstmm.ir.scene_structure import Key
    from mstmm.scene import Spring


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


class LoopedEngine:
    """Looped engine on one packed scene; thread-safe.

    Errors name the element or expression that causes them.
    """

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
        observed = dict(zip(OBSERVATION_PARTS, arrays, strict=True))
        return Observation(**observed, failures=tuple(map(_first_with_count, failures.values())))

    def spring_motion(
        self, spring: Spring, t: Array, q: Array, u: Array, memory: Array
    ) -> tuple[Array, Array]:
        """Lengths (n,) of a spring, m, and their rates (n,), m/s, in n states."""
        ends = map(self.packed.end, (spring.from_, spring.to))
        probes = [Probe(i, axes, spring.position if i < 0 else r) for i, axes, r in ends]
        points = self.observe(t, q, u, memory, probes, ("points",)).points
        return length_and_rate(points[:, 1, :6] - points[:, 0, :6])

    def sums(self, t: float, q: Array, u: Array, memory: Array) -> tuple[Array, str]:
        """Compute `Observation.sums` of one state; nan with a message if that fails, else ""."""
        sums_found = np.full(int(self.lib.MSTMM_SUM_NUMBERS), np.nan)
        observation_record = self.ffi.new("mstmm_observation *")
        failure = self.ffi.new("mstmm_failure *")
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

    # --- single states --------------------------------------------------------------------------

    def call(self, function: str, state: tuple[float, Array, Array], *arguments: Any) -> None:
        """Call `mstmm_<function>` with model, workspace, arguments and a record of its failure.

        Arrays are passed as pointers.  Raises NumericalFailure, which names the element or
        expression that fails at the state (t, q, u).
        """
        failure = self.ffi.new("mstmm_failure *")
        c_arguments = [self.pointer(x) if isinstance(x, np.ndarray) else x for x in arguments]
        c_function = getattr(self.lib, f"mstmm_{function}")
        if c_function(self.packed.model, self.workspace(), *c_arguments, failure):
            raise self.evaluation_error(failure, *state)

    def accelerations(
        self, t: ArrayLike, q: Array, u: Array, memory: Array, efforts: Array | None = None
    ) -> tuple[Array, Array]:
        """Compute qdot, udot of n states; q (n, nq), u (n, nu), memory (n, m), efforts (n, nu)."""
        n = len(q)
        times = np.empty(n)
        times[:] = t
        qdot, udot = np.empty((n, self.nq)), np.empty((n, self.nu))
        failure, failed_row = self.ffi.new("mstmm_failure *"), self.ffi.new("int64_t *")
        code = self.lib.mstmm_accelerations_many(
            self.packed.model, self.workspace(), n, self.pointer(times), self.pointer(q),
            self.pointer(u), self.pointer(memory),
            self.ffi.NULL if efforts is None else self.pointer(efforts),
            self.pointer(qdot), self.pointer(udot), failure, failed_row,
        )  # fmt: skip
        if code:
            row = int(failed_row[0])
            raise self.evaluation_error(failure, float(times[row]), q[row], u[row])
        if not np.isfinite(udot).all():
            row, column = (int(k[0]) for k in np.nonzero(~np.isfinite(udot)))
            name = self.packed.layout.u_name(column)
            raise self.not_finite(f"the acceleration of {name}", float(times[row]), q[row], u[row])
        return qdot, udot

    def evaluation_error(self, failure: Any, t: float, q: Array, u: Array) -> NumericalFailure:
        """Error for a state that cannot be evaluated; names the expression or the element."""
        cause = find_nonfinite_expression(self, t, q, u)
        if cause:
            return NumericalFailure(cause)
        text = self.failure_text(failure, t)
        if failure.reason == FailureCode.UNDETERMINED:
            return UndeterminedMotionError(text, int(failure.element))
        return NumericalFailure(text)

    def not_finite(self, what: str, t: float, q: Array, u: Array) -> NumericalFailure:
        """Error for a state with a non-finite quantity `what`; names the causing expression."""
        cause = find_nonfinite_expression(self, t, q, u)
        return NumericalFailure(f"{what} is not finite at t = {t:.9g} s{cause and ': '}{cause}")

    def inverse_dynamics(self, t: float, q: Array, u: Array, udot: Array, memory: Array) -> Array:
        """Efforts (nu,) that `udot` requires at one state, in addition to those of laws."""
        efforts = np.empty(self.nu)
        self.call("inverse_dynamics", (t, q, u), t, q, u, memory, udot, efforts)
        if not np.isfinite(efforts).all():
            name = self.packed.layout.u_name(int(np.argmin(np.isfinite(efforts))))
            raise self.not_finite(f"the effort of {name}", t, q, u)
        return efforts

    def mass_matrix_product(self, q: Array, accelerations: Array) -> Array:
        """Product of M(q) and n accelerations (n, nu), all speeds free; O(bodies) each."""
        engine, zero_speeds = self.inertia_only, np.zeros(self.nu)
        memory = engine.start_memory()
        base_efforts = engine.inverse_dynamics(0.0, q, zero_speeds, zero_speeds, memory)
        rows = [
            engine.inverse_dynamics(0.0, q, zero_speeds, row, memory) - base_efforts
            for row in np.ascontiguousarray(accelerations)
        ]
        return np.reshape(rows, (len(rows), self.nu))

    def kinetic_energies(self, q: Array, speeds: Array) -> Array:
        """Kinetic energies (n, bodies), J, at q (nq,) and n speeds (n, nu), O(bodies) each.

        Bodies are in the order of the topology; rotors count with the outboard body of their hinge,
        drives are ignored.
        """
        engine, n, zero_speeds = self.inertia_only, len(speeds), np.zeros(self.nu)
        energies = np.empty((n, self.packed.topology.count))
        states = (np.ascontiguousarray(x, dtype=np.float64) for x in (q, speeds))
        arrays = *states, engine.start_memory(), zero_speeds, np.empty(self.nu), energies
        engine.call("kinetic_energies", (0.0, q, zero_speeds), n, *arrays)
        return energies

    def inertia_matrix(self, kind: Key, numbers: Sequence[float]) -> Array:
        """Inertia matrix (6, 6) of a single body about its internal origin, by its kernel."""
        upper, kernel = np.zeros(21), self.packed.elements[kind].functions["inertia"]
        c_function = self.ffi.cast("void (*)(const double *, double *)", kernel)
        c_function(list(numbers), self.ffi.from_buffer("double[]", upper))
        return symmetric_matrices(upper)

    def mass_matrix(self, q: Array) -> Array:
        """Symmetric mass matrix (nu, nu) of one state; driven coordinates count as free."""
        if self.packed.layout.modal:
            matrix = self.mass_matrix_product(q, np.eye(self.nu)).T
            return np.asarray((matrix + matrix.T) / 2)
        engine, matrix = self.inertia_only, np.empty((self.nu, self.nu))
        arrays = q, engine.start_memory(), matrix, np.empty(2 * self.nu)
        engine.call("mass_matrix", (0.0, q, np.zeros(self.nu)), *arrays)
        return matrix

    def solve(self, q: Array, columns: Array, memory: Array | None = None) -> Array:
        """Product of M(q)^-1 and n columns of efforts (n, nu) at one state q (nq,).

        It is zero on prescribed speeds.  The mass matrix is factored once, and each column costs
        O(bodies); with sweeps "qr" and "refined" and with closed loops no factor is stored, and
        each column requires a sweep at rest with its efforts.  Without `memory` no hinge is
        released.
        """
        engine = self.inertia_only
        memory = engine.start_memory() if memory is None else memory
        if self.packed.qr or self.packed.refined or self.packed.system.has_loops:
            # Time-dependent couplings cause motion without efforts: subtract it by a zero column.
            columns = np.vstack([columns, np.zeros(self.nu)])
            n, zero_speeds = len(columns), np.zeros(columns.shape)
            state_rows = np.tile(q, (n, 1)), zero_speeds, np.tile(memory, (n, 1))
            accelerations_found = engine.accelerations(0.0, *state_rows, columns)[1]
            return np.asarray(accelerations_found[:-1] - accelerations_found[-1])
        solutions = np.empty(columns.shape)
        state = 0.0, q, np.zeros(self.nu)
        engine.call("solve", state, len(columns), q, memory, columns, solutions)
        if not np.isfinite(solutions).all():
            name = self.packed.layout.u_name(int(np.nonzero(~np.isfinite(solutions))[1][0]))
            raise engine.not_finite(f"the solution for {name}", *state)
        return solutions

    def rates(self, t: float, q: Array, u: Array, memory: Array) -> Array:
        """Rates qdot (nq,) of one state by kinematics, without requiring positive inertia."""
        self.inverse_dynamics(t, q, u, np.zeros(self.nu), memory)
        model = self.packed.model
        first = int(model.scratch) + self.nq + self.nu + int(model.n_values)
        first += 3 * int(model.n_drives) + int(model.tape_slots)
        return self.workspace_array()[first : first + self.nq].copy()


def symmetric_matrices(upper: Array) -> Array:
    """Symmetric matrices (..., 6, 6) from their upper triangles (..., 21), row by row."""
    full = np.zeros((*upper.shape[:-1], 6, 6))
    full[..., *np.triu_indices(6)] = upper
    return full + np.swapaxes(np.triu(full, 1), -1, -2)


def length_and_rate(apart: Array) -> tuple[Array, Array]:
    """Lengths (n,) and rates (n,) from relative positions and velocities (n, 6) of the ends.

    nan where the ends coincide.
    """
    length = np.linalg.norm(apart[:, :3], axis=1)
    product = np.einsum("ni,ni->n", apart[:, :3], apart[:, 3:6])
    return length, np.divide(product, length, out=np.full_like(length, np.nan), where=length > 0)


def _first_with_count(texts: list[str]) -> str:
    """First of several failures of one kind, with the number of further samples."""
    further_count = len(texts) - 1
    return texts[0] + (f" (and {further_count} more samples)" if further_count else "")
