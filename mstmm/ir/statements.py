"""Parts of a KernelIR: arrays (ports), operands and statements, and their validation."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction

from .operations import OPERATIONS

#: Loop variable of an indexed sum or store, used as an index.
LOOP_INDEX = "k"
#: Loop variable of a second loop, inside the first.
INNER_INDEX = "l"
LOOPS = (LOOP_INDEX, INNER_INDEX)


@dataclass(frozen=True)
class Port:
    """Array that a kernel reads or writes.  Arrays are dense and row-major.

    `shape` holds integers or the kernel's size symbol; () is a scalar (one number).
    An output with `accumulate` is added to the contents of the array (contributions to a parent
    body).
    """

    name: str
    shape: tuple[int | str, ...] = ()
    unit: str = ""
    meaning: str = ""
    accumulate: bool = False

    def length(self, n: int = 0) -> int:
        """Count of numbers in the array for the value `n` of the size symbol."""
        total = 1
        for extent in self.shape:
            total *= n if isinstance(extent, str) else extent
        return total

    def offset(self, index: tuple[int | str, ...], n: int = 0, k: int = 0, inner: int = 0) -> int:
        """Row-major index of an entry, for `LOOP_INDEX` = `k` and `INNER_INDEX` = `inner`."""
        if len(index) == len(self.shape) == 1 and isinstance(index[0], int):  # fast path
            return index[0]
        offset = 0
        for entry, extent in zip(index, self.shape, strict=True):
            width = n if isinstance(extent, str) else extent
            if isinstance(entry, str):
                entry = k if entry == LOOP_INDEX else inner
            offset = offset * width + entry
        return offset


@dataclass(frozen=True)
class Constant:
    """Exact rational number, written "3", "-1/3"; or "pi"."""

    text: str

    @property
    def number(self) -> float:
        """Nearest double.  ValueError if the text is no number, or is not finite as a double."""
        if self.text == "pi":
            return math.pi
        try:
            return float(Fraction(self.text))
        except (ValueError, ZeroDivisionError, OverflowError):
            raise ValueError(f"{self.text!r} is no number within the range of a double") from None


@dataclass(frozen=True)
class Element:
    """Entry of an input or of a complete output; one entry per axis, `k` or `l` in a loop."""

    port: str
    index: tuple[int | str, ...] = ()


@dataclass(frozen=True)
class Temporary:
    """Operand: value of the statement with this number."""

    number: int


Operand = Constant | Element | Temporary


@dataclass(frozen=True)
class Assign:
    """Assignment t[number] = op(args)."""

    number: int
    op: str
    args: tuple[Operand, ...]


@dataclass(frozen=True)
class Sum:
    """Sum t[number] of `value` over k < n (or the letter `over`); `body` is run in each pass."""

    number: int
    body: tuple[Assign | Sum, ...]
    value: Operand
    over: str = LOOP_INDEX


#: Statements that are allowed inside a loop.
Inner = Assign | Sum


@dataclass(frozen=True)
class Store:
    """Write output[index] = value; with `k` or `l` in the index, run `body` for all k, l < n."""

    port: str
    index: tuple[int | str, ...]
    value: Operand
    body: tuple[Inner, ...] = ()

    @property
    def loops(self) -> tuple[str, ...]:
        """Letters of the loops, outermost first."""
        return tuple(letter for letter in LOOPS if letter in self.index)


@dataclass(frozen=True)
class Guard:
    """Leave the kernel with `code` unless `condition` is non-zero; `message` states the failure."""

    condition: Operand
    code: int
    message: str


#: Code that C returns after a complete kernel if an unsymmetric matrix, not known to be positive
#: definite, has a negative determinant; all results are valid.
NEGATIVE_DETERMINANT = 2


@dataclass(frozen=True)
class Solve:
    """Linear solve, output = A^-1 B, for a run-time sized A (n x n), B (n,) or (n, m).

    A symmetric positive definite A is factored as LDL^T without pivoting, from its lower half; a
    pivot below `relative_pivot` times its diagonal entry of A leaves the kernel with `code`.
    Otherwise A is factored as LU with row exchange; the limit of a pivot is then `relative_pivot`
    times the sum of magnitudes in its column of A.  Solves of fixed size are unrolled when the
    kernel is lowered and never become this statement.
    """

    port: str
    matrix: str
    right: str
    code: int
    message: str
    relative_pivot: float = 1e-13
    symmetric: bool = True


Statement = Assign | Sum | Store | Guard | Solve


def operands(statement: object) -> tuple[Operand, ...]:
    """Operands that a statement reads, those of its body first."""
    if isinstance(statement, Assign):
        return statement.args
    if isinstance(statement, (Store, Sum)):
        inner = (operand for line in statement.body for operand in operands(line))
        return (*inner, statement.value) if statement.body else (statement.value,)
    return (statement.condition,) if isinstance(statement, Guard) else ()


# --- nested expressions ---------------------------------------------------------------------------


@dataclass(frozen=True)
class Expression:
    """Assignment that only the statement around it reads, with its operands."""

    assign: Assign
    args: tuple[Operand | Expression, ...]
    depth: int


Nested = Operand | Expression
#: Statement with its operands.
Line = tuple[Statement, tuple[Nested, ...]]

_MAX_DEPTH = 30  # of nested expressions; compilers permit 256 brackets


class Nesting:
    """Statements with their operands, assignments that are read once inside their readers.

    With `is_ordered` only where the evaluation of operands from left to right keeps the order of
    the statements.  No assignment moves across a store, a loop or a guard.
    `is_allowed(value, reader, place)` says whether a value may be operand number `place` of an
    assignment, or of another statement if `reader` is None.
    """

    def __init__(
        self,
        statements: Iterable[Statement],
        is_allowed: Callable[[Assign, Assign | None, int], bool],
        *,
        is_ordered: bool,
    ) -> None:
        self._is_allowed, self._is_ordered = is_allowed, is_ordered
        self._counts = Counter(
            operand.number
            for statement in statements
            for operand in operands(statement)
            if isinstance(operand, Temporary)
        )

    def lines(self, statements: Iterable[Statement]) -> list[Line]:
        """Statements of one level; loops are without operands, see `body`."""
        lines, pending = self._nest(statements)
        return lines + [(value.assign, value.args) for value in pending.values()]

    def body(self, loop: Sum | Store) -> tuple[list[Line], Nested]:
        """Statements inside a loop, and its value."""
        lines, pending = self._nest(loop.body)
        (value,) = self._operands([loop.value], pending)
        return lines + [(value.assign, value.args) for value in pending.values()], value

    def _nest(self, statements: Iterable[Statement]) -> tuple[list[Line], dict[int, Expression]]:
        lines: list[Line] = []
        pending: dict[int, Expression] = {}
        for statement in statements:
            if isinstance(statement, Assign):
                args = self._operands(statement.args, pending, statement)
                depth = 1 + max((a.depth for a in args if isinstance(a, Expression)), default=0)
                pending[statement.number] = Expression(statement, args, depth)
                continue
            is_loop = isinstance(statement, Sum) or (
                isinstance(statement, Store) and bool(statement.loops or statement.body)
            )
            args = () if is_loop else self._operands(operands(statement), pending)
            lines += [(value.assign, value.args) for value in pending.values()]
            lines.append((statement, args))
            pending.clear()
        return lines, pending

    def _operands(
        self, args: Sequence[Operand], pending: dict[int, Expression], reader: Assign | None = None
    ) -> tuple[Nested, ...]:
        """Operands, where possible the pending values themselves."""
        nested: list[Nested] = list(args)
        for place in reversed(range(len(args))):
            operand = args[place]
            value = pending.get(operand.number) if isinstance(operand, Temporary) else None
            if (
                value is not None
                and self._counts[value.assign.number] == 1
                and not (self._is_ordered and value is not next(reversed(pending.values())))
                and value.depth < _MAX_DEPTH
                and self._is_allowed(value.assign, reader, place)
            ):
                nested[place] = pending.pop(value.assign.number)
        return tuple(nested)


# --- validation: rejects what no backend could run ------------------------------------------------


class Check:
    """Validation pass over the statements of a kernel, with the values defined so far."""

    def __init__(
        self,
        name: str,
        inputs: tuple[Port, ...],
        outputs: tuple[Port, ...],
        size_symbol: str | None,
    ) -> None:
        self.name, self.ports, self.size_symbol = name, (*inputs, *outputs), size_symbol
        self.readable = {port.name: port for port in inputs}
        self.writable = {port.name: port for port in outputs}
        self.stored: dict[str, set[tuple[int | str, ...]]] = {}
        self.defined: set[int] = set()
        self.ever_defined: set[int] = set()
        self.constants: set[str] = set()

    def fail(self, text: str) -> None:
        raise ValueError(f"{self.name}: {text}")

    def run(self, statements: tuple[Statement, ...]) -> None:
        if len({port.name for port in self.ports}) != len(self.ports):
            self.fail("two ports have the same name")
        for port in self.ports:
            sizes = {extent for extent in port.shape if isinstance(extent, str)}
            if sizes - {self.size_symbol}:
                self.fail(f"{port.name} has the shape {port.shape}")
        for statement in statements:
            self.statement(statement)

    def statement(self, statement: Statement) -> None:
        if isinstance(statement, (Assign, Sum)):
            self.inner(statement, ())
        elif isinstance(statement, Store):
            self.store(statement)
        else:
            if statement.code == 0:
                self.fail(f"code 0 means success, not {statement.message!r}")
            if isinstance(statement, Guard):
                self.use(statement.condition, ())
            else:
                self.solve(statement)

    def inner(self, statement: Inner, loops: tuple[str, ...]) -> None:
        if isinstance(statement, Assign):
            self.assign(statement, loops)
            return
        if statement.over not in LOOPS or statement.over in loops:
            self.fail(f"a sum over {statement.over!r} inside loops over {list(loops)}")
        self.body(statement.body, statement.value, (*loops, statement.over))
        self.define(statement.number)

    def store(self, store: Store) -> None:
        letters = [entry for entry in store.index if isinstance(entry, str)]
        if len(set(letters)) != len(letters):
            self.fail(f"{store.port}{list(store.index)} stores only a diagonal")
        self.body(store.body, store.value, store.loops)
        self.index(store.port, store.index, self.writable, store.loops)
        if self.size_symbol is None:
            return
        if store.port in self.readable:
            self.fail(f"{store.port} is stored again although it is complete")
        indices = self.stored.setdefault(store.port, set())
        indices.add(tuple("" if isinstance(entry, str) else entry for entry in store.index))
        port = self.writable[store.port]
        extents = [extent for extent in port.shape if isinstance(extent, int)]
        if len(indices) == math.prod(extents) and not port.accumulate:
            self.readable[port.name] = port

    def body(self, body: tuple[Inner, ...], value: Operand, loops: tuple[str, ...]) -> None:
        if loops and self.size_symbol is None:
            self.fail("a loop without a size symbol")
        for statement in body:
            self.inner(statement, loops)
        self.use(value, loops)
        self.defined.difference_update(statement.number for statement in body)

    def assign(self, assign: Assign, loops: tuple[str, ...]) -> None:
        row = OPERATIONS.get(assign.op)
        if row is None or row.arity != len(assign.args):
            self.fail(f"{assign.op} with {len(assign.args)} operands")
        for operand in assign.args:
            self.use(operand, loops)
        self.define(assign.number)

    def define(self, number: int) -> None:
        if number in self.ever_defined:
            self.fail(f"t{number} is defined twice")
        self.ever_defined.add(number)
        self.defined.add(number)

    def use(self, operand: Operand, loops: tuple[str, ...]) -> None:
        if isinstance(operand, Temporary):
            if operand.number not in self.defined:
                self.fail(f"t{operand.number} is used before it is defined")
        elif isinstance(operand, Element):
            self.index(operand.port, operand.index, self.readable, loops)
        elif operand.text not in self.constants:
            try:
                _ = operand.number
            except ValueError as error:
                self.fail(str(error))
            self.constants.add(operand.text)

    def index(
        self,
        name: str,
        index: tuple[int | str, ...],
        ports: dict[str, Port],
        loops: tuple[str, ...],
    ) -> None:
        if name not in ports:
            self.fail(f"no port named {name!r}")
        shape = ports[name].shape
        if len(index) != len(shape):
            self.fail(f"{name}{list(index)} does not fit {shape}")
        for entry, extent in zip(index, shape, strict=True):
            if isinstance(entry, str) and entry not in loops:
                self.fail(f"{name}{list(index)} outside a loop")
            # Loop indices belong to axes of the run-time size, and only to these.
            if isinstance(entry, str) != isinstance(extent, str):
                self.fail(f"{name}{list(index)} does not fit {shape}")
            if isinstance(entry, int) and isinstance(extent, int) and not 0 <= entry < extent:
                self.fail(f"{name}{list(index)} is out of range")

    def solve(self, solve: Solve) -> None:
        size = self.size_symbol
        for name, ports in (
            (solve.matrix, self.readable), (solve.right, self.readable), (solve.port, self.writable)
        ):  # fmt: skip
            if name not in ports:
                self.fail(f"no port named {name!r}")
        right, output = self.readable[solve.right], self.writable[solve.port]
        fits = size is not None and self.readable[solve.matrix].shape == (size, size)
        fits = fits and right.shape[:1] == (size,) and len(right.shape) <= 2
        if not fits or output.shape != right.shape or output.accumulate:
            self.fail(f"solve: {solve.port}, {solve.matrix}, {solve.right} do not fit")
        if solve.port in self.readable:
            self.fail(f"{solve.port} is solved for twice")
        # Later statements may read an output that has been solved for.
        self.readable[solve.port] = output
