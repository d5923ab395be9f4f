"""A KernelIR evaluated without C, in any arithmetic, statement by statement."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from itertools import product
from typing import Any

from ..errors import NumericalFailure
from .floats import Arithmetic, FloatArithmetic
from .kernel import KernelIR
from .statements import (
    INNER_INDEX,
    LOOP_INDEX,
    LOOPS,
    Assign,
    Constant,
    Guard,
    Inner,
    Operand,
    Port,
    Solve,
    Statement,
    Store,
    Sum,
    Temporary,
)

#: What an input may be: a number, or nested or flat sequences of numbers, row-major.
Values = Any


class GuardFailure(NumericalFailure):
    """A guard did not hold, or a pivot of `solve` vanished; `code` is what C returns."""

    def __init__(self, kernel: str, code: int, message: str) -> None:
        super().__init__(f"{kernel}: {message} (code {code})")
        self.code = code
        self.message = message


def evaluate_floats(
    kernel: KernelIR, inputs: Mapping[str, Values], n: int | None = None
) -> dict[str, list[float]]:
    """Outputs of the kernel in doubles, with the operations and the order of the generated C.

    What inputs may be and errors raised: as for `run`.
    """
    return run(kernel, inputs, FloatArithmetic(), n)


def run(
    kernel: KernelIR, inputs: Mapping[str, Values], arithmetic: Arithmetic, n: int | None
) -> dict[str, list[Any]]:
    """Outputs in any arithmetic, each a flat list, row-major.

    `inputs[port]` is a number or a nested or flat sequence of them; `n` is the run-time size of a
    kernel that has one.  An output flagged `accumulate` holds the increment; an entry that is never
    stored is 0.  Values that no port asks for are ignored.  Raises GuardFailure, and ValueError for
    a missing input, a wrong length or no `n`.
    """
    if kernel.size_symbol is not None and n is None:
        raise ValueError(f"{kernel.name}: give n, the run-time size {kernel.size_symbol!r}")
    state = _Run(kernel, arithmetic, n or 0)
    for port in kernel.inputs:
        if port.name not in inputs:
            raise ValueError(f"{kernel.name}: no value for the input {port.name!r}")
        state.arrays[port.name] = state.read(port, inputs[port.name])
    for statement in kernel.statements:
        state.execute(statement)
    return state.results


class _Run:
    """One evaluation: arrays read so far, temporaries, results."""

    def __init__(self, kernel: KernelIR, arithmetic: Arithmetic, n: int) -> None:
        self.kernel, self.arithmetic, self.n = kernel, arithmetic, n
        self.ports = {port.name: port for port in (*kernel.inputs, *kernel.outputs)}
        self.temporaries: dict[int, Any] = {}
        zero = arithmetic.number("0")
        self.results = {port.name: [zero] * port.length(n) for port in kernel.outputs}
        #: What can be read: inputs, and outputs that are complete.
        self.arrays: dict[str, list[Any]] = dict(self.results)
        #: Where the loops stand.
        self._loops = dict.fromkeys(LOOPS, 0)
        self._constants: dict[str, Any] = {}

    def read(self, port: Port, values: Values) -> list[Any]:
        row = [self.arithmetic.number(value) for value in _flat(values)]
        if len(row) != port.length(self.n):
            raise ValueError(
                f"{self.kernel.name}: {port.name} holds {port.length(self.n)} numbers "
                f"{list(port.shape)}, not {len(row)}"
            )
        return row

    def execute(self, statement: Statement) -> None:
        if isinstance(statement, (Assign, Sum)):
            self._inner(statement)
        elif isinstance(statement, Store):
            self._store(statement)
        elif isinstance(statement, Guard):
            if not self.arithmetic.true(self._value(statement.condition)):
                raise GuardFailure(self.kernel.name, statement.code, statement.message)
        else:
            self._solve(statement)

    def _inner(self, statement: Inner) -> None:
        if isinstance(statement, Assign):
            operation: Callable[..., Any] = self.arithmetic.operations[statement.op]
            self.temporaries[statement.number] = operation(*map(self._value, statement.args))
            return
        total = self.arithmetic.number("0")
        for place in range(self.n):
            self._loops[statement.over] = place
            for inner in statement.body:
                self._inner(inner)
            total = total + self._value(statement.value)
        self.temporaries[statement.number] = total

    def _value(self, operand: Operand) -> Any:
        if isinstance(operand, Temporary):
            return self.temporaries[operand.number]
        if isinstance(operand, Constant):
            if operand.text not in self._constants:
                self._constants[operand.text] = self.arithmetic.constant(operand)
            return self._constants[operand.text]
        return self.arrays[operand.port][self._place(operand.port, operand.index)]

    def _place(self, name: str, index: tuple[int | str, ...]) -> int:
        at = self._loops
        return self.ports[name].offset(index, self.n, at[LOOP_INDEX], at[INNER_INDEX])

    def _store(self, store: Store) -> None:
        accumulate, row = self.ports[store.port].accumulate, self.results[store.port]
        for places in product(range(self.n), repeat=len(store.loops)):
            self._loops.update(zip(store.loops, places, strict=True))
            for inner in store.body:
                self._inner(inner)
            place, value = self._place(store.port, store.index), self._value(store.value)
            row[place] = row[place] + value if accumulate else value

    def _solve(self, solve: Solve) -> None:
        """LDL^T without pivoting, in the order of the generated C."""
        n, a, b = self.n, self.arrays[solve.matrix], self.arrays[solve.right]
        limit = self.arithmetic.number(solve.relative_pivot)
        work = [self.arithmetic.number("0")] * (n * n)
        divide = self.arithmetic.operations["div"]
        for i in range(n):
            for j in range(i + 1):
                rest = a[i * n + j]
                for k in range(j):
                    rest = rest - work[i * n + k] * work[j * n + k] * work[k * n + k]
                work[i * n + j] = divide(rest, work[j * n + j]) if j < i else rest
            if not work[i * n + i] > limit * abs(a[i * n + i]):
                raise GuardFailure(self.kernel.name, solve.code, solve.message)
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
        self.arrays[solve.port] = self.results[solve.port] = x


def _flat(values: Values) -> list[Any]:
    """Numbers of a nested sequence, row-major; a number is a sequence of one."""
    if isinstance(values, str) or not isinstance(values, Iterable):
        return [values]
    return [number for entry in values for number in _flat(entry)]
