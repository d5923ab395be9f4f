"""KernelIR: inputs, outputs and statements of one kernel, and its stored form."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from .operations import OPERATIONS
from .statements import (
    LOOP_INDEX,
    LOOPS,
    Assign,
    Check,
    Constant,
    Element,
    Expression,
    Guard,
    Inner,
    Nested,
    Nesting,
    Operand,
    Port,
    Solve,
    Statement,
    Store,
    Sum,
    Temporary,
    operands,
)


@dataclass(frozen=True)
class KernelIR:
    """Kernel in intermediate representation: inputs, outputs and statements."""

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
        """Number of operations by name (bodies of loops counted once)."""
        counts: dict[str, int] = {}
        for statement in assignments(self):
            counts[statement.op] = counts.get(statement.op, 0) + 1
        return dict(sorted(counts.items()))

    def flops(self) -> int:
        """Number of additions, subtractions, multiplications, divisions (loop bodies once)."""
        counts = self.operation_counts()
        return sum(counts.get(name, 0) for name in ("add", "sub", "mul", "div"))

    def hash(self) -> str:
        """SHA-256 of the stored form, equal for equal kernels."""
        return hashlib.sha256(to_json(self).encode()).hexdigest()


def assignments(kernel: KernelIR) -> Iterator[Assign]:
    """Iterate over all assignments in order, including those inside loops."""
    yield from _assignments(kernel.statements)


def _assignments(statements: Iterable[Statement]) -> Iterator[Assign]:
    for statement in statements:
        if isinstance(statement, Assign):
            yield statement
        elif isinstance(statement, (Sum, Store)):
            yield from _assignments(statement.body)


def read_elements(kernel: KernelIR) -> list[Element]:
    """Entries of inputs and complete outputs that statements read."""
    read = (operand for statement in kernel.statements for operand in operands(statement))
    return [operand for operand in read if isinstance(operand, Element)]


def reads_port(kernel: KernelIR, port: str) -> bool:
    """Whether any statement reads the port."""
    return any(x.port == port for x in read_elements(kernel))


def check(kernel: KernelIR) -> None:
    """Check that every backend can run a kernel; a ValueError names the kernel and the place.

    It rejects unknown names, operations or constants; a value that is used before it is defined,
    or defined twice; an index outside its array, or a loop index outside a loop; a size that is
    not the kernel's; a `solve` whose arrays do not fit; a guard whose code means success.
    """
    Check(kernel.name, kernel.inputs, kernel.outputs, kernel.size_symbol).run(kernel.statements)


# --- stored form -----------------------------------------------------------------------------


def _operand_text(operand: Operand) -> str:
    if isinstance(operand, Constant):
        return operand.text
    if isinstance(operand, Temporary):
        return f"t{operand.number}"
    return f"{operand.port}[{','.join(map(str, operand.index))}]"


def _operand_from_text(text: str) -> Operand:
    if text.endswith("]"):
        port, _, entries = text[:-1].partition("[")
        index = (entry if entry in LOOPS else int(entry) for entry in entries.split(",") if entry)
        return Element(port, tuple(index))
    return Temporary(int(text[1:])) if text[0] == "t" else Constant(text)


#: Operation of every name in stored expressions: its sign in C if it has one.
_STORED_OPERATIONS = {row.sign or name: row for name, row in OPERATIONS.items()}
_STORED_NAMES = {row.name: name for name, row in _STORED_OPERATIONS.items()}


def _expression_text(nested: Nested) -> str:
    """Expression in postfix notation: operands, then their operation."""
    if not isinstance(nested, Expression):
        return _operand_text(nested)
    return _assign_text(nested.assign, nested.args)


def _assign_text(assign: Assign, args: Iterable[Nested]) -> str:
    return " ".join([*map(_expression_text, args), _STORED_NAMES[assign.op]])


class _StatementWriter:
    """Statements of one kernel as JSON data.

    Assignments and stores are texts such as "t7 = R[0,0] H[0] * t2 +".  The assignments inside an
    expression have the numbers that follow those before them.
    """

    def __init__(self, kernel: KernelIR) -> None:
        numbers = list(_defined_numbers(kernel.statements))
        is_consecutive = numbers == list(range(len(numbers)))
        self._nesting = Nesting(kernel.statements, lambda *_: is_consecutive, is_ordered=True)

    def data(self, statements: Iterable[Statement]) -> list[Any]:
        lines = self._nesting.lines(statements)
        return [self._line_data(statement, args) for statement, args in lines]

    def _line_data(self, statement: Statement, args: Sequence[Nested]) -> Any:
        if isinstance(statement, Assign):
            return f"t{statement.number} = {_assign_text(statement, args)}"
        if isinstance(statement, Guard):
            condition = _expression_text(args[0])
            return {"guard": condition, "code": statement.code, "message": statement.message}
        if isinstance(statement, Solve):
            data = asdict(statement)
            return {"solve": [data.pop(key) for key in ("port", "matrix", "right")], **data}
        if isinstance(statement, Store):
            target = _operand_text(Element(statement.port, statement.index))
            if args:
                return f"{target} = {_expression_text(args[0])}"
            head = {"store": target}
        else:
            over = {"over": statement.over} if statement.over != LOOP_INDEX else {}
            head = {"sum": f"t{statement.number}", **over}
        lines, value = self._nesting.body(statement)
        body = [self._line_data(*line) for line in lines]
        return head | ({"body": body} if body else {}) | {"value": _expression_text(value)}


class _StatementReader:
    """Inverse of `_StatementWriter`."""

    def __init__(self) -> None:
        self._next_number = 0
        self._operands: dict[str, Operand] = {}

    def statements(self, data: Iterable[Any]) -> tuple[Any, ...]:
        return tuple(statement for line in data for statement in self._line(line))

    def _line(self, line: Any) -> list[Statement]:
        if isinstance(line, str):
            target, _, expression = line.partition(" = ")
            entry = self._operand(target)
            if isinstance(entry, Temporary):
                return [*self._expression(expression, entry.number)[0]]
            assigns, value = self._expression(expression)
            return [*assigns, _store(entry, value)]
        if not isinstance(line, dict):
            raise ValueError(f"unknown statement {line}; generate the element again")
        if "guard" in line:
            assigns, value = self._expression(line["guard"])
            return [*assigns, Guard(value, line["code"], line["message"])]
        if "solve" in line:
            rest = {key: value for key, value in line.items() if key != "solve"}
            return [Solve(*line["solve"], **rest)]
        body = self.statements(line.get("body", ()))
        assigns, value = self._expression(line["value"])
        body += tuple(assigns)
        if "store" in line:
            return [_store(self._operand(line["store"]), value, body)]
        number = self._operand(line["sum"]).number
        self._next_number = number + 1
        return [Sum(number, body, value, line.get("over", LOOP_INDEX))]

    def _operand(self, text: str) -> Any:
        operand = self._operands.get(text)
        if operand is None:
            operand = self._operands[text] = _operand_from_text(text)
        return operand

    def _expression(self, text: str, number: int | None = None) -> tuple[list[Assign], Operand]:
        """Assignments of an expression, the last one with `number` if it is given; its value."""
        tokens = text.split()
        if number is not None:
            self._next_number = number + 1 - sum(token in _STORED_OPERATIONS for token in tokens)
        assigns: list[Assign] = []
        stack: list[Operand] = []
        for token in tokens:
            row = _STORED_OPERATIONS.get(token)
            if row is None:
                stack.append(self._operand(token))
                continue
            assigns.append(Assign(self._next_number, row.name, tuple(stack[-row.arity :])))
            stack[-row.arity :] = [Temporary(self._next_number)]
            self._next_number += 1
        if len(stack) != 1:
            raise ValueError(f"expected one value, found {len(stack)} in {text!r}")
        return assigns, stack[0]


def _store(entry: Element, value: Operand, body: tuple[Inner, ...] = ()) -> Store:
    return Store(entry.port, entry.index, value, body)


def _defined_numbers(statements: Iterable[Statement]) -> Iterator[int]:
    for statement in statements:
        if isinstance(statement, (Sum, Store)):
            yield from _defined_numbers(statement.body)
        if isinstance(statement, (Assign, Sum)):
            yield statement.number


def kernel_to_data(kernel: KernelIR) -> dict[str, Any]:
    """Convert a kernel to lists, numbers and texts; `kernel_from_data` is the inverse."""

    def port(p: Port) -> list[Any]:
        data = [p.name, list(p.shape), p.unit, p.meaning]
        return [*data, "accumulate"] if p.accumulate else data

    return {
        "name": kernel.name,
        "purpose": kernel.purpose,
        "sources": list(kernel.sources),
        **({"size_symbol": kernel.size_symbol} if kernel.size_symbol else {}),
        "inputs": [port(p) for p in kernel.inputs],
        "outputs": [port(p) for p in kernel.outputs],
        "statements": _StatementWriter(kernel).data(kernel.statements),
    }


def json_lines(data: Mapping[str, Any]) -> str:
    """JSON of kernel data, or of part of it: one key or statement a line."""
    lines = []
    for key, value in data.items():
        text = _compact(value)
        if key == "statements":
            text = "[\n" + ",\n".join(map(_compact, value)) + "\n]"
        lines.append(f"{json.dumps(key)}: {text}")
    return "{\n" + ",\n".join(lines) + "}\n"


def _compact(data: Any) -> str:
    return json.dumps(data, separators=(",", ":"))


def to_json(kernel: KernelIR) -> str:
    """Convert a kernel to JSON: one statement per line, the same bytes on every machine."""
    return json_lines(kernel_to_data(kernel))


def from_json(text: str) -> KernelIR:
    """Restore a kernel from the result of `to_json`.  ValueError if it is invalid."""
    return kernel_from_data(json.loads(text))


def kernel_from_data(data: Mapping[str, Any]) -> KernelIR:
    """Restore a kernel from its parsed JSON.  ValueError if it is invalid."""

    def port(p: list[Any]) -> Port:
        return Port(p[0], tuple(p[1]), p[2], p[3], accumulate="accumulate" in p[4:])

    return KernelIR(
        name=data["name"],
        inputs=tuple(port(p) for p in data["inputs"]),
        outputs=tuple(port(p) for p in data["outputs"]),
        statements=_StatementReader().statements(data["statements"]),
        size_symbol=data.get("size_symbol"),
        purpose=data["purpose"],
        sources=tuple(data["sources"]),
    )
