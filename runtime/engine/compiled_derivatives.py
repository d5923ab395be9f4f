"""Derivatives and solutions of one scene by code that is compiled once it saves time."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array
from mstmm.errors import EnvironmentFailure
from mstmm.ir import Constant, KernelIR, Store
from mstmm.ir.differentiation import DERIVATIVE_PREFIX, differentiate
from mstmm.ir.scene_structure import Structure

from ..kernels.prepared_calls import PreparedCall as Prepared
from ..kernels.prepared_calls import prepare_call
from ..kernels.scene_libraries import DerivativeLibrary, FusedLibrary
from ..kernels.tape_kernel import TapeKernel
from .fused_code import FusedCode
from .inputs import LiveInputs
from .looped_engine import LoopedEngine

#: Measured compilation time (s) per squared number of speeds, and time saved per state (s):
#: constant, and per squared number of speeds.  Only the ratio matters; fixed values make the choice
#: reproducible.
_SECONDS_PER_PAIR = 0.035
_SECONDS_SAVED, _SECONDS_SAVED_PER_PAIR = 2e-5, 4e-7

Library = TypeVar("Library")


class CompiledOnDemand(Generic[Library]):
    """Code of one scene: sought at first use, compiled once that saves time; thread-safe.

    `find(build)` returns the code or None; with `build` it may run the compiler.
    """

    def __init__(self, find: Callable[[bool], Library | None]) -> None:
        self.library: Library | None = None
        self._find, self._lock = find, threading.Lock()
        self._saved, self._has_searched = 0.0, False

    def expect(self, saved: float, cost: float) -> Library | None:
        """Add to the saved work; return the code if it exists or that work exceeds its `cost`."""
        with self._lock:
            self._saved += saved
            pays = self._saved > cost
            if self.library is None and (pays or not self._has_searched):
                self._has_searched = True
                try:
                    self.library = self._find(pays)
                except EnvironmentFailure:
                    pays = True
                if pays:  # compile only once: a second attempt would give the same result
                    self._saved = -np.inf
            return self.library

    def build(self) -> None:
        """Compile the code; raises EnvironmentFailure if that fails."""
        with self._lock:
            self.library = self._find(True)


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
        self._local, self._code = threading.local(), CompiledOnDemand(fusion.ready_linear)

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
        if self._code.library is None and not self._expect(saved):
            return None
        try:
            call_of_thread: LinearisationCall = self._local.call
        except AttributeError:
            call_of_thread = self._local.call = self._make_call()
        return call_of_thread

    def _expect(self, saved: float) -> bool:
        """Add to the saved work, and load or compile the code; True if there is code."""
        pairs = self._engine.nu**2
        saved *= _SECONDS_SAVED + _SECONDS_SAVED_PER_PAIR * pairs
        return self._n > 0 and self._code.expect(saved, _SECONDS_PER_PAIR * pairs) is not None

    def _make_call(self) -> LinearisationCall:
        library = self._code.library
        assert library is not None
        live = LiveInputs(self._engine.packed.system, self._fusion.inputs)
        return LinearisationCall(self._engine, library, self._fusion.numbers, live, self._n)


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
        square, kept = (n, n), (self._references, result_pointer)
        shapes = (engine.nu,), square, square, square, (n,), square, square
        widths = engine.nq, engine.nu
        return prepare_call(
            "mstmm_linear_derivatives", record, widths, *shapes, numbered=True, kept=kept
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
        state = t, buffer(real, q), buffer(real, u), efforts_pointer
        results = buffer(real, numbers), buffer(real, derivatives)
        is_failed = self._lib.mstmm_accelerations_about(self._record, *state, *results)
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


#: Inputs of the kernel "accelerations", in order.
INPUTS = ("p", "t", "q", "u", "memory", "efforts")

#: Pairs (input, output): the output is differentiated with respect to the input.
PAIRS = (
    ("u", "qdot"), ("q", "qdot"), ("q", "udot"), ("u", "udot"), ("efforts", "udot"),
    ("t", "udot"), ("p", "udot"),
)  # fmt: skip

#: Number of directions that justifies a compilation.  The compilation time and the saving per
#: direction both grow with kernel size; measured break-even from 130 000 (7 balls) to 490 000
#: (24 pins).
WORTH_COMPILING = 300_000


class TangentKernels:
    """Derivatives of the accelerations of one structure along given directions.

    Thread-safe.  Compiled code and the interpreted tape agree to rounding.
    """

    def __init__(self, fusion: FusedCode, structure: Structure, parameters: bool) -> None:
        self._fusion, self.structure = fusion, structure
        self._pairs = PAIRS if parameters else PAIRS[:-1]
        self._tapes: dict[tuple[str, str], TapeKernel | None] = {}
        self._lock, self._code = threading.Lock(), CompiledOnDemand(self._find)
        self._code.expect(0, WORTH_COMPILING)

    def expect(self, directions: int) -> None:
        """Announce a number of directions; the kernels are compiled once the total justifies it."""
        self._code.expect(directions, WORTH_COMPILING)

    @property
    def uses_compiled_code(self) -> bool:
        """True if compiled code is in use."""
        return self._code.library is not None

    def columns(
        self, port: str, output: str, states: Mapping[str, Array], directions: Array
    ) -> Array:
        """Derivatives (states, n, length) of `output` along directions of the input `port`.

        `states[name]` is (states or 1, width) for every input, `directions` (states or 1, n,
        width).
        """
        if self._code.library is not None:
            inputs = [states[name] for name in INPUTS]
            return self._code.library.run(self._pairs.index((port, output)), inputs, directions)
        with self._lock:
            return self._evaluate_interpreted(port, output, states, directions)

    def _evaluate_interpreted(
        self, port: str, output: str, states: Mapping[str, Array], directions: Array
    ) -> Array:
        length = self.structure.nq if output == "qdot" else self.structure.nu
        sizes = [len(directions), *map(len, states.values())]
        count = max(sizes) if min(sizes) else 0
        derivative_rows = np.zeros((count, directions.shape[1], length))
        if (port, output) not in self._tapes:
            kernel = self._kernel(port, output)
            self._tapes[port, output] = None if _is_zero(kernel) else TapeKernel(kernel)
        tape = self._tapes[port, output]
        if tape is None:
            return derivative_rows
        for i in range(count):
            kernel_inputs = {name: rows[min(i, len(rows) - 1)] for name, rows in states.items()}
            for k, direction in enumerate(directions[min(i, len(directions) - 1)]):
                _, outputs = tape.run({**kernel_inputs, DERIVATIVE_PREFIX + port: direction})
                kernel_inputs = {}  # the kernel keeps the inputs of the state
                derivative_rows[i, k] = outputs[DERIVATIVE_PREFIX + output][:length]
        return derivative_rows

    @cached_property
    def _accelerations(self) -> KernelIR:
        kernel: KernelIR = self._fusion.structure_ir(self.structure).kernels["accelerations"]
        return kernel

    def _kernel(self, port: str, output: str) -> KernelIR:
        """Kernel of the derivative of `output` along a direction of `port`, without values."""
        return differentiate(self._accelerations, [port], [output], values=False, guards=False)

    def _find(self, build: bool) -> DerivativeLibrary | None:
        pairs_text = " ".join(f"{output}/{port}" for port, output in self._pairs)
        return self._fusion.columns(self.structure, self._kernels, pairs_text, build)

    def _kernels(self) -> Sequence[KernelIR]:
        return [self._kernel(port, output) for port, output in self._pairs]


def _is_zero(kernel: KernelIR) -> bool:
    """True if all results of the kernel are the constant zero."""
    stores = [statement for statement in kernel.statements if isinstance(statement, Store)]
    return all(statement.value == Constant("0") for statement in stores)


#: Measured compilation time (s), constant and per squared number of speeds, and time saved (s) per
#: state and per number in the right-hand sides.  Only ratios matter; fixed values make the choice
#: reproducible.
_COMPILE_SECONDS, _COMPILE_SECONDS_PER_PAIR = 0.2, 0.005
_SAVED_PER_STATE, _SAVED_PER_NUMBER = 1e-5, 3e-8


class MassMatrixSolver:
    """Solver for the mass matrix of one scene; thread-safe."""

    def __init__(self, engine: LoopedEngine, fusion: FusedCode) -> None:
        self._engine, self._fusion = engine, fusion
        self._code = CompiledOnDemand(fusion.solution)

    def solve(self, q: Array, columns: Array) -> Array:
        """Solve for columns (n, k, nu) at n states q (n, nq); returns (n, k, nu).

        Raises NumericalFailure, which names a motion without inertia.
        """
        if not columns.size:
            return columns.copy()
        cost = _COMPILE_SECONDS + _COMPILE_SECONDS_PER_PAIR * self._engine.nu**2
        library = self._code.expect(
            len(q) * _SAVED_PER_STATE + columns.size * _SAVED_PER_NUMBER, cost
        )
        if library is not None:
            solutions = self._solve_compiled(library, q, columns)
            if solutions is not None:
                return solutions
        rows = [
            self._engine.solve(q_row, column_rows)
            for q_row, column_rows in zip(q, columns, strict=True)
        ]
        return np.array(rows).reshape(columns.shape)

    def build(self) -> None:
        """Compile the code of the scene; raises EnvironmentFailure if that fails."""
        self._code.build()

    @property
    def uses_compiled_code(self) -> bool:
        """True if compiled code of the scene is in use."""
        return self._code.library is not None

    def _solve_compiled(self, library: DerivativeLibrary, q: Array, columns: Array) -> Array | None:
        """Solutions by compiled code; None if a guard fails (the looped engine names the cause)."""
        numbers, nu = self._fusion.numbers, self._engine.nu
        zero_speeds = np.zeros((1, nu))
        memory = self._engine.start_memory()[None]
        inputs = [numbers[None], np.zeros((1, 1)), q, zero_speeds, memory, zero_speeds]
        solution_rows = library.run(0, inputs, columns)
        if not solution_rows[..., nu].all() or not np.isfinite(solution_rows).all():
            return None
        return np.ascontiguousarray(solution_rows[..., :nu])
