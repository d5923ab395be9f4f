"""KernelIR: the one intermediate form between derived equations and everything that computes.

A kernel is a list of scalar statements in single-assignment order over typed inputs and outputs.
It holds plain text and whole numbers only (no SymPy), is frozen, hashable, and stored as JSON.

Shapes are whole numbers, or one declared size symbol `n` (modal sizes).  With `n` present there
are three loops and no others: an indexed sum over k < n or l < n, a store over k, l or both, and
the primitive `solve`.  A sum may stand inside another loop over the other letter, so that loops are
at most two deep.  There are no branches except `select` and guards.

With `n` present an output that is complete (every entry stored, or solved for) and does not
accumulate may be read by the statements behind.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

#: Index that stands for the loop variable of an indexed sum or store.
LOOP_INDEX = "k"
#: That of a second loop, inside the first.
INNER_INDEX = "l"
LOOPS = (LOOP_INDEX, INNER_INDEX)

#: Operation name -> number of operands.  The C printer, the tape and the evaluator read this table.
OPERATIONS: dict[str, int] = {
    "neg": 1, "add": 2, "sub": 2, "mul": 2, "div": 2, "pow": 2,
    "sqrt": 1, "sin": 1, "cos": 1, "tan": 1, "asin": 1, "acos": 1, "atan": 1, "atan2": 2,
    "sinh": 1, "cosh": 1, "tanh": 1, "exp": 1, "log": 1, "abs": 1, "sign": 1, "floor": 1,
    "min": 2, "max": 2, "lt": 2, "le": 2, "eq": 2, "and": 2, "or": 2, "not": 1, "select": 3,
}  # fmt: skip


@dataclass(frozen=True)
class Port:
    """One array a kernel reads or writes.  Arrays are dense and row-major.

    `shape` holds whole numbers or the kernel's size symbol; () is a scalar (one number).
    An output with `accumulate` is added to what the array holds (contributions to a parent body).
    """

    name: str
    shape: tuple[int | str, ...] = ()
    unit: str = ""
    meaning: str = ""
    accumulate: bool = False

    def length(self, n: int = 0) -> int:
        """Numbers in the array when the size symbol equals `n`."""
        total = 1
        for extent in self.shape:
            total *= n if isinstance(extent, str) else extent
        return total

    def offset(self, index: tuple[int | str, ...], n: int = 0, k: int = 0, inner: int = 0) -> int:
        """Row-major place of an entry; in it `LOOP_INDEX` is `k`, `INNER_INDEX` is `inner`."""
        place = 0
        for entry, extent in zip(index, self.shape, strict=True):
            width = n if isinstance(extent, str) else extent
            if isinstance(entry, str):
                entry = k if entry == LOOP_INDEX else inner
            place = place * width + entry
        return place


@dataclass(frozen=True)
class Constant:
    """An exact rational number, written "3", "-1/3"; or "pi"."""

    text: str

    @property
    def number(self) -> float:
        """The nearest double.  ValueError if the text is no number or has no finite double."""
        if self.text == "pi":
            return math.pi
        try:
            return float(Fraction(self.text))
        except (ValueError, ZeroDivisionError, OverflowError):
            raise ValueError(f"{self.text!r} is no constant that a double can hold") from None


@dataclass(frozen=True)
class Element:
    """Entry of an input or of a complete output; one entry per axis, `k` or `l` in a loop."""

    port: str
    index: tuple[int | str, ...] = ()


@dataclass(frozen=True)
class Temporary:
    """Value of the statement with this number."""

    number: int


Operand = Constant | Element | Temporary


@dataclass(frozen=True)
class Assign:
    """t[number] = op(args)."""

    number: int
    op: str
    args: tuple[Operand, ...]


@dataclass(frozen=True)
class Sum:
    """t[number] = sum over k < n (or the letter `over`) of `value`, once `body` has been run."""

    number: int
    body: tuple[Assign | Sum, ...]
    value: Operand
    over: str = LOOP_INDEX


#: What stands inside a loop.
Inner = Assign | Sum


@dataclass(frozen=True)
class Store:
    """output[index] = value; with `k` or `l` in the index, `body` is run for every k, l < n."""

    port: str
    index: tuple[int | str, ...]
    value: Operand
    body: tuple[Inner, ...] = ()

    @property
    def loops(self) -> tuple[str, ...]:
        """Letters that are run through, the outermost first."""
        return tuple(letter for letter in LOOPS if letter in self.index)


@dataclass(frozen=True)
class Guard:
    """Leave the kernel with `code` unless `condition` is non-zero; `message` says what failed."""

    condition: Operand
    code: int
    message: str


@dataclass(frozen=True)
class Solve:
    """output = A^-1 B for a symmetric positive definite run-time sized A (n x n), B (n,) or (n, m).

    LDL^T without pivoting; a pivot below `relative_pivot` times its own diagonal entry leaves with
    `code`.  Fixed sizes are unrolled when the kernel is lowered and never reach this statement.
    """

    port: str
    matrix: str
    right: str
    code: int
    message: str
    relative_pivot: float = 1e-13


Statement = Assign | Sum | Store | Guard | Solve


@dataclass(frozen=True)
class KernelIR:
    """One kernel: what it reads, what it writes, and the statements in between."""

    name: str
    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    statements: tuple[Statement, ...]
    size_symbol: str | None = None
    purpose: str = ""
    sources: tuple[str, ...] = field(default=())

    def __post_init__(self) -> None:
        check(self)

    def operation_counts(self) -> dict[str, int]:
        """Operations by name (bodies of loops counted once)."""
        counts: dict[str, int] = {}
        for statement in assignments(self):
            counts[statement.op] = counts.get(statement.op, 0) + 1
        return dict(sorted(counts.items()))

    def flops(self) -> int:
        """Additions, subtractions, multiplications and divisions (loop bodies once)."""
        counts = self.operation_counts()
        return sum(counts.get(name, 0) for name in ("add", "sub", "mul", "div"))

    def hash(self) -> str:
        """SHA-256 of the stored form: equal text, equal kernel."""
        return hashlib.sha256(to_json(self).encode()).hexdigest()


def assignments(kernel: KernelIR) -> Iterator[Assign]:
    """Every assignment, those inside loops too, in order."""
    yield from _assignments(kernel.statements)


def _assignments(statements: Iterable[Statement]) -> Iterator[Assign]:
    for statement in statements:
        if isinstance(statement, Assign):
            yield statement
        elif isinstance(statement, (Sum, Store)):
            yield from _assignments(statement.body)


def check(kernel: KernelIR) -> None:
    """Refuse what no backend could run, with a ValueError that names kernel and place.

    Unknown names, operations or constants; a value used before it is defined or defined twice;
    an index outside its array or a loop index outside a loop; a size that is not the kernel's; a
    `solve` whose arrays do not fit; a guard whose code would read as success.
    """
    from .ir_check import Check

    Check(kernel).run()


# --- stored form -----------------------------------------------------------------------------


def _operand_to_list(operand: Operand) -> Any:
    if isinstance(operand, Constant):
        return operand.text
    if isinstance(operand, Temporary):
        return operand.number
    return [operand.port, *operand.index]


def _operand_from_list(data: Any) -> Operand:
    if isinstance(data, str):
        return Constant(data)
    if isinstance(data, int):
        return Temporary(data)
    return Element(data[0], tuple(data[1:]))


def _assign_to_list(assign: Assign) -> list[Any]:
    return [assign.number, assign.op, *(_operand_to_list(a) for a in assign.args)]


def _assign_from_list(data: list[Any]) -> Assign:
    return Assign(data[0], data[1], tuple(_operand_from_list(a) for a in data[2:]))


def _statement_to_data(statement: Statement) -> Any:
    if isinstance(statement, Assign):
        return _assign_to_list(statement)
    if isinstance(statement, Sum):
        body = [_statement_to_data(a) for a in statement.body]
        data: dict[str, Any] = {
            "sum": statement.number,
            "body": body,
            "value": _operand_to_list(statement.value),
        }
        return data | ({"over": statement.over} if statement.over != LOOP_INDEX else {})
    if isinstance(statement, Store):
        body = [_statement_to_data(a) for a in statement.body]
        data = {
            "store": [statement.port, *statement.index],
            "value": _operand_to_list(statement.value),
        }
        return data | ({"body": body} if body else {})
    if isinstance(statement, Guard):
        condition = _operand_to_list(statement.condition)
        return {"guard": condition, "code": statement.code, "message": statement.message}
    return {
        "solve": [statement.port, statement.matrix, statement.right],
        "code": statement.code,
        "message": statement.message,
        "relative_pivot": statement.relative_pivot,
    }


def _inner_from_data(data: Any) -> Inner:
    if isinstance(data, list):
        return _assign_from_list(data)
    body = tuple(_inner_from_data(a) for a in data["body"])
    return Sum(data["sum"], body, _operand_from_list(data["value"]), data.get("over", LOOP_INDEX))


def _statement_from_data(data: Any) -> Statement:
    if isinstance(data, list):
        return _assign_from_list(data)
    if "sum" in data:
        return _inner_from_data(data)
    if "store" in data:
        port, *index = data["store"]
        body = tuple(_inner_from_data(a) for a in data.get("body", ()))
        return Store(port, tuple(index), _operand_from_list(data["value"]), body)
    if "guard" in data:
        return Guard(_operand_from_list(data["guard"]), data["code"], data["message"])
    port, matrix, right = data["solve"]
    return Solve(port, matrix, right, data["code"], data["message"], data["relative_pivot"])


def to_json(kernel: KernelIR) -> str:
    """The stored form: one statement a line, the same bytes on every machine."""

    def port(p: Port) -> list[Any]:
        data = [p.name, list(p.shape), p.unit, p.meaning]
        return [*data, "accumulate"] if p.accumulate else data

    head = {
        "name": kernel.name,
        "purpose": kernel.purpose,
        "sources": list(kernel.sources),
        "size_symbol": kernel.size_symbol,
        "inputs": [port(p) for p in kernel.inputs],
        "outputs": [port(p) for p in kernel.outputs],
    }
    lines = [f"{json.dumps(key)}: {json.dumps(value)}" for key, value in head.items()]
    body = ",\n".join(
        json.dumps(_statement_to_data(s), separators=(",", ":")) for s in kernel.statements
    )
    return "{\n" + ",\n".join(lines) + ',\n"statements": [\n' + body + "\n]}\n"


def from_json(text: str) -> KernelIR:
    """Inverse of `to_json`."""
    data = json.loads(text)

    def port(p: list[Any]) -> Port:
        return Port(p[0], tuple(p[1]), p[2], p[3], accumulate="accumulate" in p[4:])

    return KernelIR(
        name=data["name"],
        inputs=tuple(port(p) for p in data["inputs"]),
        outputs=tuple(port(p) for p in data["outputs"]),
        statements=tuple(_statement_from_data(s) for s in data["statements"]),
        size_symbol=data["size_symbol"],
        purpose=data["purpose"],
        sources=tuple(data["sources"]),
    )
