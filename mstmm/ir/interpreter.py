"""Interpreter of KernelIR, independent of the type of number.

`replay_kernel` accepts any arithmetic of plain numbers.  Nodes of a graph (`inline`, `tangent`)
and numpy arrays (`runtime.kernels.vectorized`) have separate subclasses: they differ in the
entries of an array, and in the treatment of guards and solves.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from itertools import product
from typing import Any, ClassVar, Protocol

from ..errors import NumericalFailure
from .kernel import KernelIR
from .operations import OPERATIONS, is_true
from .statements import (
    INNER_INDEX,
    LOOP_INDEX,
    LOOPS,
    Assign,
    Constant,
    Element,
    Guard,
    Inner,
    Operand,
    Port,
    Solve,
    Store,
    Sum,
    Temporary,
)

#: Type of an input: a number, or nested or flat sequences of numbers, row-major.
Values = Any
#: Operation name -> function.
Operations = Mapping[str, Callable[..., Any]]


class GuardFailure(NumericalFailure):
    """A guard is violated, or a pivot of a solve vanishes; `code` is the return code of C."""

    def __init__(self, kernel: str, code: int, message: str) -> None:
        super().__init__(f"{kernel}: {message} (code {code})")
        self.code = code
        self.message = message


# --- interpretation ----------------------------------------------------------------------------


class Interpreter(ABC):
    """Interpretation of one kernel, once; subclasses define numbers, arrays and loops."""

    def __init__(self, kernel: KernelIR, operations: Operations, n: int) -> None:
        self.kernel, self.operations, self.n = kernel, operations, n
        self.ports = {port.name: port for port in (*kernel.inputs, *kernel.outputs)}
        self.temporaries: dict[int, Any] = {}
        self.results: Any = {}

    def run(self) -> Any:
        """Execute every statement in order and return the results."""
        for statement in self.kernel.statements:
            if isinstance(statement, (Assign, Sum)):
                self.inner(statement)
            elif isinstance(statement, Store):
                self.store(statement)
            elif isinstance(statement, Guard):
                self.guard(statement)
            else:
                self.solve(statement)
        return self.results

    def inner(self, statement: Inner) -> None:
        """Execute a statement that is allowed inside a loop."""
        if isinstance(statement, Assign):
            operation, value, known = self.operations[statement.op], self.value, self.temporaries
            known[statement.number] = operation(
                *[
                    known[argument.number] if isinstance(argument, Temporary) else value(argument)
                    for argument in statement.args
                ]
            )
        else:
            self.temporaries[statement.number] = self.total(statement)

    def inside(self, loop: Sum | Store) -> Any:
        """Value of a loop for the current indices, after a pass through its body."""
        for statement in loop.body:
            self.inner(statement)
        return self.value(loop.value)

    def value(self, operand: Operand) -> Any:
        """Value of an operand."""
        if isinstance(operand, Temporary):
            return self.temporaries[operand.number]
        return self.constant(operand) if isinstance(operand, Constant) else self.entry(operand)

    @abstractmethod
    def constant(self, constant: Constant) -> Any:
        """Value of a constant of the kernel."""

    @abstractmethod
    def entry(self, element: Element) -> Any:
        """Value of an entry of an array."""

    @abstractmethod
    def total(self, statement: Sum) -> Any:
        """Value of a sum over a loop."""

    @abstractmethod
    def store(self, store: Store) -> None:
        """Write an entry of an output, or all entries of a loop."""

    @abstractmethod
    def guard(self, guard: Guard) -> None:
        """Leave the kernel if the condition is false, or record that it has to be left."""

    @abstractmethod
    def solve(self, solve: Solve) -> None:
        """Fill an output with A^-1 B."""


class LoopingInterpreter(Interpreter):
    """Interpreter that runs through loops; arrays are flat row-major lists, outputs start at 0."""

    def __init__(
        self, kernel: KernelIR, operations: Operations, n: int, inputs: Mapping[str, Any], zero: Any
    ) -> None:
        super().__init__(kernel, operations, n)
        self.zero = zero
        self.results = {port.name: [zero] * port.length(n) for port in kernel.outputs}
        self.arrays: dict[str, Any] = {
            **{port.name: self._input_values(port, inputs) for port in kernel.inputs},
            **self.results,
        }
        self._loop_indices = dict.fromkeys(LOOPS, 0)

    def _input_values(self, port: Port, inputs: Mapping[str, Any]) -> Any:
        if port.name not in inputs:
            raise ValueError(f"{self.kernel.name}: no value for the input {port.name!r}")
        row = inputs[port.name]
        if len(row) != port.length(self.n):
            raise ValueError(
                f"{self.kernel.name}: {port.name}: expected {port.length(self.n)} numbers "
                f"{list(port.shape)}, found {len(row)}"
            )
        return row

    def entry(self, element: Element) -> Any:
        return self.arrays[element.port][self._entry_offset(element.port, element.index)]

    def _entry_offset(self, name: str, index: tuple[int | str, ...]) -> int:
        indices = self._loop_indices
        return self.ports[name].offset(index, self.n, indices[LOOP_INDEX], indices[INNER_INDEX])

    def total(self, statement: Sum) -> Any:
        total = self.zero
        for index in range(self.n):
            self._loop_indices[statement.over] = index
            total = total + self.inside(statement)
        return total

    def store(self, store: Store) -> None:
        accumulate, row = self.ports[store.port].accumulate, self.results[store.port]
        for indices in product(range(self.n), repeat=len(store.loops)):
            self._loop_indices.update(zip(store.loops, indices, strict=True))
            value = self.inside(store)
            offset = self._entry_offset(store.port, store.index)
            row[offset] = row[offset] + value if accumulate else value

    def guard(self, guard: Guard) -> None:
        self.handle_condition(self.value(guard.condition), guard)

    @abstractmethod
    def handle_condition(self, condition: Any, judged: Guard | Solve) -> None:
        """Handle the condition of a guard, or of a pivot of a solve."""


# --- plain numbers -----------------------------------------------------------------------------


class Arithmetic(Protocol):
    """Type of number of `replay_kernel`: conversion of inputs and constants, and the operations."""

    @property
    def operations(self) -> Operations:
        """Operation name -> function."""

    def number(self, value: Any) -> Any:
        """Convert an input to a number of this arithmetic."""

    def constant(self, constant: Constant) -> Any:
        """Convert a constant of the kernel to a number of this arithmetic."""

    def true(self, value: Any) -> bool:
        """Whether the value is neither zero nor NaN."""


class DoubleArithmetic:
    """Arithmetic of doubles, with the values that C gives."""

    operations: ClassVar[Operations] = {name: row.value for name, row in OPERATIONS.items()}

    def number(self, value: Any) -> float:
        return float(value)

    def constant(self, constant: Constant) -> float:
        return constant.number

    def true(self, value: Any) -> bool:
        return is_true(value)


def evaluate_floats(
    kernel: KernelIR, inputs: Mapping[str, Values], n: int | None = None
) -> dict[str, list[float]]:
    """Evaluate a kernel in doubles, with the operations and the order of the generated C.

    Inputs, result and errors are those of `replay_kernel`.
    """
    return replay_kernel(kernel, inputs, DoubleArithmetic(), n)


def replay_kernel(
    kernel: KernelIR, inputs: Mapping[str, Values], arithmetic: Arithmetic, n: int | None
) -> dict[str, list[Any]]:
    """Evaluate a kernel in any arithmetic; each output is a flat list, row-major.

    `inputs[port]` is a number or a nested or flat sequence of them; `n` is the run-time size of a
    kernel that has one.  An output flagged `accumulate` holds the increment; an entry that is never
    stored is 0.  Values without a port are ignored.  Raises GuardFailure, and ValueError for a
    missing input, a wrong length or a missing `n`.
    """
    if kernel.size_symbol is not None and n is None:
        raise ValueError(f"{kernel.name}: give n, the run-time size {kernel.size_symbol!r}")
    input_names = {port.name for port in kernel.inputs}
    input_values = {
        name: [arithmetic.number(value) for value in _flatten(values)]
        for name, values in inputs.items()
        if name in input_names
    }
    return _NumberInterpreter(kernel, arithmetic, n or 0, input_values).run()


class _NumberInterpreter(LoopingInterpreter):
    """Interpreter of plain numbers; a violated guard raises GuardFailure."""

    def __init__(
        self, kernel: KernelIR, arithmetic: Arithmetic, n: int, inputs: Mapping[str, list[Any]]
    ) -> None:
        super().__init__(kernel, arithmetic.operations, n, inputs, arithmetic.number("0"))
        self.arithmetic = arithmetic
        self._constants: dict[str, Any] = {}

    def constant(self, constant: Constant) -> Any:
        value = self._constants.get(constant.text)
        if value is None:
            value = self._constants[constant.text] = self.arithmetic.constant(constant)
        return value

    def handle_condition(self, condition: Any, judged: Guard | Solve) -> None:
        if not self.arithmetic.true(condition):
            raise GuardFailure(self.kernel.name, judged.code, judged.message)

    def solve(self, solve: Solve) -> None:
        """Solve with the order of operations of the generated C."""
        solver = self._solve_by_ldl if solve.symmetric else self._solve_by_lu
        self.results[solve.port][:] = solver(solve)

    def _solve_by_lu(self, solve: Solve) -> list[Any]:
        """Solve by LU with row exchange; right-hand sides are eliminated in the same pass."""
        n, a, b = self.n, self.arrays[solve.matrix], self.arrays[solve.right]
        m = len(b) // n if n else 0
        limit, one = (self.arithmetic.number(x) for x in (solve.relative_pivot, 1.0))
        divide, less = self.operations["div"], self.operations["lt"]
        scales = list[Any]()
        rows = [[*a[n * i : n * i + n], *b[m * i : m * i + m]] for i in range(n)]
        sizes = [sum((abs(a[n * k + i]) for k in range(n)), self.zero) for i in range(n)]
        for i in range(n):
            pivot_row = i
            for k in range(i + 1, n):
                if self.arithmetic.true(less(abs(rows[pivot_row][i]), abs(rows[k][i]))):
                    pivot_row = k
            rows[i], rows[pivot_row] = rows[pivot_row], rows[i]
            self.handle_condition(less(limit * sizes[i], abs(rows[i][i])), solve)
            scales.append(divide(one, rows[i][i]))
            for k in range(i + 1, n):
                factor = rows[k][i] * scales[i]
                for j in range(i + 1, n + m):
                    rows[k][j] = rows[k][j] - factor * rows[i][j]
        for i in reversed(range(n)):
            for j in range(n, n + m):
                for k in range(i + 1, n):
                    rows[i][j] = rows[i][j] - rows[i][k] * rows[k][j]
                rows[i][j] = rows[i][j] * scales[i]
        return [x for row in rows for x in row[n:]]

    def _solve_by_ldl(self, solve: Solve) -> list[Any]:
        """Solve by LDL^T without pivoting."""
        n, a, b = self.n, self.arrays[solve.matrix], self.arrays[solve.right]
        limit = self.arithmetic.number(solve.relative_pivot)
        work = [self.zero] * (n * n)
        divide, less = self.operations["div"], self.operations["lt"]
        for i in range(n):
            for j in range(i + 1):
                remainder = a[i * n + j]
                for k in range(j):
                    remainder = remainder - work[i * n + k] * work[j * n + k] * work[k * n + k]
                work[i * n + j] = divide(remainder, work[j * n + j]) if j < i else remainder
            self.handle_condition(less(limit * abs(a[i * n + i]), work[i * n + i]), solve)
        m = len(b) // n if n else 0
        x = list(b)
        for column in range(m):
            for i in range(n):
                for k in range(i):
                    x[i * m + column] = x[i * m + column] - work[i * n + k] * x[k * m + column]
            for i in reversed(range(n)):
                x[i * m + column] = divide(x[i * m + column], work[i * n + i])
                for k in range(i + 1, n):
                    x[i * m + column] = x[i * m + column] - work[k * n + i] * x[k * m + column]
        return x


def _flatten(values: Values) -> list[Any]:
    """Flatten a nested sequence, row-major; a single number gives a list of one."""
    if isinstance(values, str) or not isinstance(values, Iterable):
        return [values]
    return [number for entry in values for number in _flatten(entry)]
