"""Accelerations and linearisation of a scene at given states, by fused code."""

from __future__ import annotations

import threading
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array

from ..kernels.fused_library import FusedLibrary
from ..kernels.prepared_calls import PreparedCall as Prepared
from ..kernels.prepared_calls import prepare_call
from .fused_code import FusedCode
from .live_inputs import LiveInputs
from .looped_engine import LoopedEngine

#: Measured compilation time (s) per squared number of speeds, and time saved per state (s):
#: constant, and per squared number of speeds.  Only the ratio matters; fixed values make the choice
#: reproducible.
_SECONDS_PER_PAIR = 0.035
_SECONDS_SAVED, _SECONDS_SAVED_PER_PAIR = 2e-5, 4e-7


class CompiledState:
    """Accelerations and linear model at one state; n of the nu speeds are free.

    Accelerations `a` (nu,); M, C, K (n, n) as in `linear.matrices`; G (n, n) of x' = G x + du; r_t
    (n,), partial derivative of efforts with respect to time; all are views of `numbers`.
    """

    __slots__ = ("_n", "_nu", "numbers")

    def __init__(self, numbers: Array, nu: int, n: int) -> None:
        self.numbers, self._nu, self._n = numbers, nu, n

    @property
    def a(self) -> Array:
        return self.numbers[: self._nu]

    @property
    def M(self) -> Array:
        return self._matrix(0)

    @property
    def C(self) -> Array:
        return self._matrix(1)

    @property
    def K(self) -> Array:
        return self._matrix(2)

    @property
    def G(self) -> Array:
        return self._matrix(3)

    def _matrix(self, k: int) -> Array:
        n = self._n
        first = self._nu + k * n * n
        return self.numbers[first : first + n * n].reshape(n, n)


class LinearisationCode:
    """Linearisation of one scene by compiled code; thread-safe.

    The first call searches the cache for the code; it is compiled once enough states justify it.
    """

    def __init__(self, engine: LoopedEngine, fusion: FusedCode, free: Sequence[int]) -> None:
        self._engine, self._fusion, self._n = engine, fusion, len(free)
        self._local, self._lock = threading.local(), threading.Lock()
        self._library: FusedLibrary | None = None
        self._has_searched, self._saved_seconds = False, 0.0

    def evaluate(self, t: float, q: Array, u: Array) -> CompiledState | None:
        """Evaluate one state; q (nq,) and u (nu,) must be contiguous.

        Returns None if there is no code or a guard fails; the looped engine then names the cause.
        """
        call = self.thread_call()
        return None if call is None else call.evaluate(t, q, u)

    def state_matrix(self, about: CompiledState, turning: bool) -> Array | None:
        """State matrix A (2 n, 2 n) of d/dt (x, x') = A (x, x').

        x' = du or, with `turning`, G x + du.  Returns None without code, or if M is not positive
        definite.
        """
        call = self.thread_call(0.0)
        return None if call is None else call.state_matrix(about, turning)

    def thread_call(self, saved: float = 1.0) -> LinearisationCall | None:
        """Call of this thread, or None without code; `saved` is the number of states saved."""
        if self._library is None and not self._expect(saved):
            return None
        try:
            call_of_thread: LinearisationCall = self._local.call
        except AttributeError:
            call_of_thread = self._local.call = self._make_call()
        return call_of_thread

    def _expect(self, saved: float) -> bool:
        """Add to the saved work, and load or compile the code; True if there is code."""
        if not self._n:
            return False
        with self._lock:
            pair_count = self._engine.nu**2
            self._saved_seconds += saved * (_SECONDS_SAVED + _SECONDS_SAVED_PER_PAIR * pair_count)
            is_worthwhile = self._saved_seconds > _SECONDS_PER_PAIR * pair_count
            if self._library is None and (is_worthwhile or not self._has_searched):
                self._has_searched = True
                self._library = self._fusion.ready_linear(is_worthwhile)
                if is_worthwhile:  # compile only once: a second attempt would give the same result
                    self._saved_seconds = -np.inf
            return self._library is not None

    def _make_call(self) -> LinearisationCall:
        assert self._library is not None
        live = LiveInputs(self._engine.packed.system, self._fusion.inputs)
        return LinearisationCall(self._engine, self._library, self._fusion.numbers, live, self._n)


class LinearisationCall:
    """C record of the linearisation code for one thread, with the memory that it reads."""

    def __init__(
        self, engine: LoopedEngine, library: FusedLibrary, numbers: Array, live: LiveInputs, n: int
    ) -> None:
        self._ffi, self._lib, self._n, self._nu = engine.ffi, engine.lib, n, engine.nu
        work_size = n * (n + engine.lib.MSTMM_TILE_COLUMNS)
        p, memory, zero_efforts = np.array(numbers), engine.start_memory(), np.zeros(engine.nu)
        self._references = (
            library,
            live,
            *map(engine.pointer, (p, memory, zero_efforts, np.empty(work_size))),
        )
        self._real = engine.ffi.typeof("double[]")
        self._record = record = engine.ffi.new("mstmm_linear_code *")
        record.fused, record.n = library.descriptor, n
        record.p, record.memory, self._no_efforts, record.work = self._references[2:]
        if live.varies:
            self._input_indices: NDArray[np.int32] = live.indices
            record.live.n, record.live.inputs = len(live.indices), engine.packed.model.inputs
            record.live.places = engine.ffi.from_buffer("int[]", self._input_indices)
        self._numbers = int(engine.lib.mstmm_linear_numbers(record))
        self.derivatives = self._prepare(engine, self._numbers)

    def _prepare(self, engine: LoopedEngine, numbers: int) -> Prepared:
        """Prepared call on t, q (nq,) and u (nu,) of a scene without drives.

        It returns udot, its derivatives -M^-1 K, -M^-1 C, M^-1 and -M^-1 r_t, then G and the
        identity matrix.
        """
        n, record = self._n, engine.ffi.new("mstmm_linear_alone *")
        record.code, record.efforts = self._record[0], self._no_efforts
        record.found = result_pointer = engine.pointer(np.empty(numbers))
        return prepare_call(
            "mstmm_linear_derivatives",
            record,
            (engine.nq, engine.nu),
            (engine.nu,),
            (n, n),
            (n, n),
            (n, n),
            (n,),
            (n, n),
            (n, n),
            numbered=True,
            kept=(self._references, result_pointer),
        )

    def evaluate(self, t: float, q: Array, u: Array) -> CompiledState | None:
        """Evaluate one state; see `LinearisationCode.at`."""
        buffer, real = self._ffi.from_buffer, self._real
        numbers = np.empty(self._numbers)
        is_failed = self._lib.mstmm_linear_at(
            self._record, t, buffer(real, q), buffer(real, u), self._no_efforts,
            buffer(real, numbers),
        )  # fmt: skip
        return None if is_failed else CompiledState(numbers, self._nu, self._n)

    def evaluate_with_derivatives(
        self, t: float, q: Array, u: Array, efforts: Array | None = None
    ) -> tuple[CompiledState, Array] | None:
        """Evaluate one state, with the derivatives (n, 3 n + 1) of the accelerations.

        The columns of the derivatives are those of -M^-1 K, -M^-1 C, M^-1 and -M^-1 r_t.
        """
        buffer, real, n = self._ffi.from_buffer, self._real, self._n
        numbers, derivatives = np.empty(self._numbers), np.empty((n, 3 * n + 1))
        efforts_pointer = self._no_efforts if efforts is None else buffer(real, efforts)
        is_failed = self._lib.mstmm_accelerations_about(
            self._record,
            t,
            buffer(real, q),
            buffer(real, u),
            efforts_pointer,
            buffer(real, numbers),
            buffer(real, derivatives),
        )
        return None if is_failed else (CompiledState(numbers, self._nu, n), derivatives)

    def state_matrix(self, about: CompiledState, turning: bool) -> Array | None:
        """State matrix; see `LinearisationCode.state_matrix`."""
        n, buffer, real = self._n, self._ffi.from_buffer, self._real
        matrix = np.empty((2 * n, 2 * n))
        numbers = buffer(real, about.numbers)
        is_failed = self._lib.mstmm_state_matrix(
            self._record, numbers, turning, buffer(real, matrix)
        )
        return None if is_failed else matrix
