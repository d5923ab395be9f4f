"""KernelIR: inputs, outputs and statements of one kernel, and its stored form."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from .statements import (
    LOOP_INDEX,
    Assign,
    Check,
    Constant,
    Element,
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
    operands = [operand for statement in assignments(kernel) for operand in statement.args]
    operands += [s.value for s in kernel.statements if isinstance(s, (Store, Sum))]
    operands += [s.condition for s in kernel.statements if isinstance(s, Guard)]
    return [x for x in operands if isinstance(x, Element)]


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
    data = {
        "solve": [statement.port, statement.matrix, statement.right],
        "code": statement.code,
        "message": statement.message,
        "relative_pivot": statement.relative_pivot,
    }
    return data if statement.symmetric else data | {"symmetric": False}


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
    return Solve(
        port, matrix, right, data["code"], data["message"], data["relative_pivot"],
        data.get("symmetric", True),
    )  # fmt: skip


def to_json(kernel: KernelIR) -> str:
    """Convert a kernel to JSON: one statement per line, the same bytes on every machine."""

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
        statements=tuple(_statement_from_data(s) for s in data["statements"]),
        size_symbol=data["size_symbol"],
        purpose=data["purpose"],
        sources=tuple(data["sources"]),
    )
