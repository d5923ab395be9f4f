"""Residual of a packed scene, its tangent and its harmonic response, in O(bodies).

R(t, q, u, a) are the efforts that the accelerations a require in addition to all acting loads.
The accelerations of the motion satisfy R = 0.  With closed loops the loads of the multipliers act
too, and for closing hinges R is the acceleration error.  Implicit steps, equilibria and linear
models use R and its tangent, which is eliminated from the tips to the root
(derive/equations/tangent_sweep.py).

The harmonic response solves Z(s) x = r with Z(s) = s^2 M + s C + K, the complex tangent of the
residual (derive/codegen/sweep_text.py).  The contributions of the bodies are computed once;
every s requires one elimination.  Hysteretic damping adds i (K' - K), where K' belongs to a scene
with its stiffness increased by the loss factors.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array, Integers
from mstmm.errors import SceneError

from .off_tree_coupling import off_tree_coupling

if TYPE_CHECKING:
    from .looped_engine import LoopedEngine


class TangentMatrix:
    """Residual and tangent of one scene; use one instance per thread.

    Prescribed and fixed speeds have no rows: their entries in residuals and solutions are zero.
    """

    def __init__(self, engine: LoopedEngine, memory: Array | None = None) -> None:
        self.engine = engine
        packed, ffi = engine.packed, engine.ffi
        self.nq, self.nu = engine.nq, engine.nu
        self.state = np.zeros(self.nq), np.zeros(self.nu)
        slopes = packed.slopes()
        model = packed.model
        self.memory = engine.start_memory() if memory is None else memory
        self.workspace = np.zeros(packed.workspace)
        self.numbers = np.zeros(max(1, _lay_out_tangent(engine)))
        self.work = np.zeros(engine.lib.mstmm_tangent_work(model, slopes.slots))
        across = off_tree_coupling(engine)
        self.couplings, self.off_tree_count = across.c_record(engine), across.count
        self.solutions = np.zeros(max(1, len(across.passes) * self.nu))
        self.closure = np.zeros(self.off_tree_count * (across.width + 4) + 1)
        self.record = record = ffi.new("mstmm_tangent *")
        record.model, record.slots = model, slopes.slots
        record.couplings, record.n_coupled = self.couplings[0], self.off_tree_count
        record.answers = engine.pointer(self.solutions)
        for name in ("workspace", "memory", "work", "numbers", "closure"):
            setattr(record, name, engine.pointer(getattr(self, name)))

    def residual(self, t: float, q: Array, u: Array, a: Array | None = None) -> Array:
        """Compute the residual R (nu,) at a state, to which subsequent calls refer.

        Without `a` the accelerations of the state are used; multipliers of closed loops are those
        of the state.
        """
        r, null = np.empty(self.nu), self.engine.ffi.NULL
        self.state = np.array(q, float), np.array(u, float)
        self._call("residual", float(t), q, u, null if a is None else a, r, null)
        return r

    def accelerations_rate(self) -> Array:
        """Partial derivative (nu,) of the accelerations with respect to time.

        Valid at the state of a residual without `a`; the tangent must be factored again afterwards.
        """
        rate = np.empty(self.nu)
        self._call("accelerations_rate", rate)
        return rate

    def slope(self, d_t: float, d_q: Array, d_u: Array, d_a: Array) -> Array:
        """Derivative (nu,) of R along a direction in time, coordinates, speeds, accelerations."""
        derivative = np.empty(self.nu)
        self._call("residual_slope", float(d_t), d_q, d_u, d_a, derivative)
        return derivative

    def matrices(self, t: float, q: Array, u: Array, a: Array, free: Sequence[int]) -> Array:
        """Compute M, C and K (3, n, n) about a state, to which subsequent calls refer.

        They are the derivatives of R with respect to the accelerations of the speeds `free`, to
        these speeds, and to the increments of coordinates along them.
        """
        n, engine = len(free), self.engine
        matrices_found, work = np.empty((3, n, n)), np.empty(2 * self.nq + 3 * self.nu)
        self.state = np.array(q, float), np.array(u, float)
        state_pointers = map(engine.pointer, (*self.state, np.ascontiguousarray(a, float)))
        result_pointers = map(engine.pointer, (matrices_found, work))
        speed_indices = engine.ffi.new("int[]", free)
        if engine.lib.mstmm_linear_swept(
            self.record, t, *state_pointers, n, speed_indices, *result_pointers
        ):
            raise engine.evaluation_error(self.record.failure, t, *self.state)
        return matrices_found

    def factor(self, s: float, sq: float, kappa: float = 1.0, rate: float = 1.0) -> None:
        """Factor the derivative of R along unknowns x.

        du = rate x, da = s x and dq = (sq - kappa g_q)^-1 N x, where N u are the rates of the
        coordinates and g_q their derivatives with respect to the coordinates.
        """
        self._call("tangent_factor", float(rate), float(s), float(sq), float(kappa))

    def factor_laws(self, s: float, sq: float, kappa: float = 1.0, rate: float = 1.0) -> None:
        """Factor an approximate tangent; arguments as in `factor`.

        It contains only inertia and the symmetric part of the derivatives of laws and modes.
        """
        self._call("laws_factor", float(rate), float(s), float(sq), float(kappa))

    def solve(self, r: Array, d_q: Array | None = None, d_a: Array | None = None) -> Array:
        """Solve for x (nu,) that changes R by r (nu,), in addition to known changes.

        Known changes are those of coordinates (nq,) and accelerations (nu,); they must be zero for
        prescribed speeds.
        """
        x, known_record, known_changes = np.empty(self.nu), self.engine.ffi.NULL, None
        if d_q is not None or d_a is not None:
            known_changes = (
                np.zeros(self.nq) if d_q is None else np.ascontiguousarray(d_q, float),
                np.zeros(self.nu) if d_a is None else np.ascontiguousarray(d_a, float),
            )
            known_record = self.engine.ffi.new(
                "mstmm_known *", tuple(map(self.engine.pointer, known_changes))
            )
        self._call("tangent_solve", np.ascontiguousarray(r, float), known_record, x)
        return x

    def solve_laws(self, r: Array, d_q: Array | None = None, d_u: Array | None = None) -> Array:
        """Solve for acceleration changes (nu,) that change R by r (nu,), after `factor_laws`.

        They are in addition to known changes of coordinates (nq,) and speeds (nu,).
        """
        changes = np.empty(self.nu)
        zeros = np.zeros(self.nu)
        known_changes = (zeros if d_q is None else d_q, zeros if d_u is None else d_u)
        self._call("laws_solve", r, *known_changes, changes)
        return changes

    def count_negative(self) -> int | None:
        """Number of negative eigenvalues of the last factored, symmetric tangent.

        By Sylvester's law of inertia it equals that of the pivots.  None if loads couple distant
        bodies, because pivots do not contain these loads.  Factorisations with negative pivots fail
        unless `allow_negative` was called before.
        """
        if self.off_tree_count:
            return None
        sizes, pivots = self.pivots()
        return int(count_negative(pivots[None], sizes)[0])

    def pivots(self) -> tuple[Integers, Array]:
        """Sizes n (2 bodies,) and entries (sum of n^2,) of the pivots of the last factorisation.

        Each body has a pivot for its shapes and one for its hinge; the entries for hinges are those
        of the inverse.
        """
        engine, read_pivots = self.engine, self.engine.lib.mstmm_tangent_pivots
        sizes = np.zeros(2 * engine.packed.system.count, dtype=np.int32)
        size_pointer = engine.ffi.from_buffer("int[]", sizes)
        pivots = np.zeros(read_pivots(self.record, size_pointer, engine.ffi.NULL))
        read_pivots(self.record, size_pointer, engine.pointer(pivots))
        return sizes.astype(np.int64), pivots

    def allow_negative(self) -> None:
        """Accept negative pivots in subsequent factorisations, for callers that count them."""
        self.record.counts = 1

    def rates(self, q: Array, u: Array) -> Array:
        """Rates N(q) u (nq,), zero for prescribed coordinates; invalidates the residual state."""
        dq = np.zeros(self.nq)
        self._call("tangent_rates", q, u, dq)
        return dq

    def coordinates(self, x: Array, rho: Array | None = None) -> Array:
        """Coordinate change dq (nq,) along x: sq dq = kappa g_q dq + N x + rho."""
        dq = np.zeros(self.nq)
        null = self.engine.ffi.NULL
        self._call("tangent_coordinates", x, null if rho is None else rho, dq)
        return dq

    def _call(self, name: str, *arguments: Any) -> None:
        pointer = self.engine.pointer
        missing_size = self.engine.packed.workspace - len(self.workspace)
        if missing_size > 0:  # tapes of events have been appended since
            self.workspace = np.append(self.workspace, np.zeros(missing_size))
            self.record.workspace = pointer(self.workspace)
        c_arguments = [
            pointer(np.ascontiguousarray(argument, float))
            if isinstance(argument, np.ndarray)
            else argument
            for argument in arguments
        ]
        if getattr(self.engine.lib, f"mstmm_{name}")(self.record, *c_arguments):
            t = float(self.record.t)
            raise self.engine.evaluation_error(self.record.failure, t, *self.state)


def thread_tangent(engine: LoopedEngine) -> TangentMatrix:
    """Tangent of an engine for this thread, without releases or counted turns."""
    thread_data, size = engine.local, engine.packed.workspace
    if getattr(thread_data, "tangent_of", None) != size:
        thread_data.tangent = TangentMatrix(engine)
        thread_data.tangent_of = engine.packed.workspace
    return cast(TangentMatrix, thread_data.tangent)


def count_negative(pivots: Array, sizes: Integers) -> Integers:
    """Count negative eigenvalues (k,) in rows of pivots (k, sum of n^2), which are non-zero."""
    squares = np.square(sizes)
    firsts = np.cumsum(squares) - squares
    counts = np.zeros(len(pivots), dtype=np.int64)
    for n in sorted(set(sizes.tolist()) - {0}):
        indices = firsts[sizes == n][:, None] + np.arange(n * n)
        blocks = pivots[:, indices].reshape(len(pivots), -1, n, n)
        values = np.linalg.eigvalsh(blocks) if n > 1 else blocks
        counts += (values < 0).reshape(len(pivots), -1).sum(axis=1)
    return counts


def _lay_out_tangent(engine: LoopedEngine) -> int:
    """Lay out the tangent and return the number of values that it stores.

    Raises SceneError for elements generated by an earlier version without derivatives.
    """
    packed = engine.packed
    count = int(engine.lib.mstmm_tangent_lay(packed.model))
    if count < 0:
        failed_index = -1 - count
        force = failed_index - packed.system.count
        if force < 0:
            culprit = f'"{engine.hinge_name(failed_index)}" or its body'
        else:
            culprit = f'"{packed.scene.forces[force].name}"'
        raise SceneError(
            f"scene: {culprit} uses an element that was generated by an earlier mstmm, without "
            "the derivatives that implicit methods need; regenerate it: mstmm generate FILE"
        )
    return count


Complex = NDArray[np.complex128]


class DynamicStiffnessBodies(NamedTuple):
    """Flexible bodies with dynamic stiffness, by their indices in the tree.

    `stiffness` returns at s (k,) one matrix (k, 6 + n, 6 + n) for each body: loads on the frame, in
    three rotations and three displacements, and on the n shapes.
    """

    body_indices: tuple[int, ...]
    stiffness: Callable[[Complex], list[Complex]]


class HarmonicResponse:
    """Dynamic stiffness Z(s) of one scene about one state; use one instance per thread.

    `lanes` is the number of s evaluated together, 2 or 4; 0 for the maximum of the processor.
    `stiffer` is the scene with elastic stiffness increased by the loss factors; `exact` are bodies
    with dynamic stiffness.
    """

    def __init__(
        self, engine: LoopedEngine, t: float, q: Array, u: Array, a: Array, lanes: int = 0,
        stiffer: LoopedEngine | None = None, exact: DynamicStiffnessBodies | None = None,
    ) -> None:  # fmt: skip
        self.engine, self.tangent = engine, TangentMatrix(engine)
        self.tangent.residual(t, q, u, a)
        nu, coupled_count, count = engine.nu, self.tangent.off_tree_count, len(self.tangent.numbers)
        lane_doubles = 2 * int(engine.lib.MSTMM_MOST_LANES)
        self._record = record = engine.ffi.new("mstmm_response *")
        record.at, record.lanes, record.n_numbers = self.tangent.record, lanes, count
        if stiffer is not None:
            self._stiffer = TangentMatrix(stiffer)
            self._stiffer.residual(t, q, u, a)
            record.stiffer = self._stiffer.record
        self._arrays = {
            "contributions": _aligned_zeros(3 * count),
            "numbers": _aligned_zeros(lane_doubles * count),
            "workspace": _aligned_zeros(lane_doubles * engine.packed.workspace),
            "vectors": _aligned_zeros(lane_doubles * 2 * nu),
            "scratch": _aligned_zeros(3 * nu + 2 * coupled_count),
            "answers": _aligned_zeros(lane_doubles * coupled_count * nu),
            "closure": _aligned_zeros(lane_doubles * coupled_count * (4 * coupled_count + 2)),
        }
        for name, array in self._arrays.items():
            setattr(record, name, engine.pointer(array))
        if engine.lib.mstmm_response_begin(record):
            raise engine.evaluation_error(self.tangent.record.failure, t, *self.tangent.state)
        self._exact = exact
        if exact is not None:
            self._order = np.argsort(exact.body_indices)[::-1]
            self._exact_body_indices = np.array(exact.body_indices, dtype=np.int32)[self._order]
            record.exact_bodies = engine.ffi.from_buffer("int[]", self._exact_body_indices)
            record.n_exact = len(self._order)

    def amplitudes(self, s: Complex, columns: Array) -> tuple[Complex, Array, NDArray[np.int32]]:
        """Amplitudes x (k, n, nu) at every s (k,), 1/s, for n right-hand sides (n, nu).

        Also returns the growth of inertia in the elimination (k,) and the body where it occurs
        (k,).  An elimination loses as many digits as inertia grows; if it is singular, the growth
        is infinite and x is zero.
        """
        points, rows = np.ascontiguousarray(s), np.ascontiguousarray(columns, float)
        x = np.zeros((len(points), len(rows), self.engine.nu), dtype=np.complex128)
        growth, growth_bodies = np.zeros(len(points)), np.zeros(len(points), dtype=np.int32)
        pointer = self.engine.pointer
        exact_stiffness = self._stiffness(points)  # keeps the memory alive during the call
        self.engine.lib.mstmm_response_many(
            self._record, len(points), pointer(points.view(np.float64)), len(rows), pointer(rows),
            pointer(x.view(np.float64)), pointer(growth),
            self.engine.ffi.from_buffer("int[]", growth_bodies),
        )  # fmt: skip
        del exact_stiffness
        return x, growth, growth_bodies

    def _stiffness(self, points: Complex) -> Complex | None:
        if self._exact is None:
            return None
        parts = self._exact.stiffness(points)
        flat = [parts[k].reshape(len(points), -1) for k in self._order]
        stiffness_rows = np.ascontiguousarray(np.concatenate(flat, axis=1))
        self._record.exact_numbers = stiffness_rows.shape[1]
        self._record.exact = self.engine.pointer(stiffness_rows.view(np.float64))
        return stiffness_rows

    def omit_damping(self) -> None:
        """Omit the terms linear in s in subsequent calls."""
        self._arrays["contributions"][: len(self.tangent.numbers)] = 0.0

    def count_negative(self, squares: Array) -> Integers:
        """Number of negative pivots of a symmetric Z at every s^2 (k,) < 0; -1 for a zero pivot.

        It equals the number of negative eigenvalues (see `TangentMatrix.count_negative`).
        """
        sizes = self._sizes
        pivots = np.zeros((len(squares), int(np.square(sizes).sum())))
        record, points = self._record, np.sqrt(squares.astype(np.complex128))
        record.pivots, record.n_pivots = self.engine.pointer(pivots), pivots.shape[1]
        _, growth, _ = self.amplitudes(points, np.zeros((0, self.engine.nu)))
        record.pivots = self.engine.ffi.NULL
        is_regular = np.isfinite(growth)
        counts = count_negative(np.where(is_regular[:, None], pivots, 0.0), sizes)
        return np.where(is_regular, counts, -1)

    @cached_property
    def _sizes(self) -> Integers:
        """Sizes of the successive pivots."""
        return self.tangent.pivots()[0]


def _aligned_zeros(count: int) -> Array:
    """Array of zeros whose address is a multiple of 64."""
    buffer = np.zeros(count + 8)
    first = -(buffer.ctypes.data // 8) % 8
    return buffer[first : first + count]
