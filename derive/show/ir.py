"""Listing of a KernelIR, one statement each; indices count from zero as the arrays do."""

from __future__ import annotations

from mstmm.ir import (
    OPERATIONS,
    Assign,
    Constant,
    Element,
    Guard,
    KernelIR,
    Operand,
    Statement,
    Store,
    Sum,
)

from .entries import Declared


def listing(kernel: KernelIR, names: Declared | None = None) -> list[str]:
    """Every statement, in order; entries of arrays by their names where there are any."""
    written = _Written(kernel, names or Declared())
    return [line for statement in kernel.statements for line in written.lines(statement)]


class _Written:
    """Statements of a kernel, entries of its arrays by the names of their author."""

    def __init__(self, kernel: KernelIR, names: Declared) -> None:
        ports = (*kernel.inputs, *kernel.outputs)
        self.names = {p.name: names.written(p.name, p.length()) for p in ports}

    def lines(self, statement: Statement, indent: str = "") -> list[str]:
        if isinstance(statement, Assign):
            operands = [self.operand(a) for a in statement.args]
            value = OPERATIONS[statement.op].text.format(*operands)
            return [f"{indent}t{statement.number} = {value}"]
        if isinstance(statement, Sum):
            over, value = statement.over, self.operand(statement.value)
            head = f"{indent}t{statement.number} = sum over {over} < n of {value}"
            body = self.body(statement, indent)
            return [f"{head} with", *body] if body else [head]
        if isinstance(statement, Store):
            place = self.entry(statement.port, statement.index)
            looped = f"  for {', '.join(statement.loops)} < n" if statement.loops else ""
            value = self.operand(statement.value)
            return [*self.body(statement, indent), f"{place} = {value}{looped}"]
        if isinstance(statement, Guard):
            condition = self.operand(statement.condition)
            return [f"leave with code {statement.code} unless {condition}: {statement.message}"]
        return [
            f"{statement.port} = solve({statement.matrix}, {statement.right})  "
            f"else code {statement.code}: {statement.message}"
        ]

    def body(self, statement: Sum | Store, indent: str) -> list[str]:
        return [line for inner in statement.body for line in self.lines(inner, indent + "    ")]

    def operand(self, operand: Operand) -> str:
        if isinstance(operand, Constant):
            return operand.text
        if isinstance(operand, Element):
            return self.entry(operand.port, operand.index)
        return f"t{operand.number}"

    def entry(self, port: str, index: tuple[int | str, ...]) -> str:
        known = self.names.get(port)
        if known and len(index) == 1 and isinstance(index[0], int):
            return known[index[0]]
        return port + "".join(f"[{i}]" for i in index)
