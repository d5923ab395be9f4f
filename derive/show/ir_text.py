"""Listing of a KernelIR, one statement per line; indices from zero as in the arrays."""

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

from .entry_names import DeclaredNames


def kernel_listing(kernel: KernelIR, names: DeclaredNames | None = None) -> list[str]:
    """All statements in order; entries of arrays by their declared names."""
    writer = _ListingWriter(kernel, names or DeclaredNames())
    return [line for statement in kernel.statements for line in writer.lines(statement)]


class _ListingWriter:
    """Statements of a kernel, with the declared names of array entries."""

    def __init__(self, kernel: KernelIR, names: DeclaredNames) -> None:
        ports = (*kernel.inputs, *kernel.outputs)
        self.names = {p.name: names.code_entries(p.name, p.length()) for p in ports}

    def lines(self, statement: Statement, indent: str = "") -> list[str]:
        if isinstance(statement, Assign):
            operands = [self.operand(a) for a in statement.args]
            value = OPERATIONS[statement.op].text.format(*operands)
            return [f"{indent}t{statement.number} = {value}"]
        if isinstance(statement, Sum):
            loop_index, value = statement.over, self.operand(statement.value)
            head = f"{indent}t{statement.number} = sum over {loop_index} < n of {value}"
            body = self.body(statement, indent)
            return [f"{head} with", *body] if body else [head]
        if isinstance(statement, Store):
            target = self.entry(statement.port, statement.index)
            loop_text = f"  for {', '.join(statement.loops)} < n" if statement.loops else ""
            value = self.operand(statement.value)
            return [*self.body(statement, indent), f"{target} = {value}{loop_text}"]
        if isinstance(statement, Guard):
            condition = self.operand(statement.condition)
            return [f"return code {statement.code} unless {condition}: {statement.message}"]
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
        names = self.names.get(port)
        if names and len(index) == 1 and isinstance(index[0], int):
            return names[index[0]]
        return port + "".join(f"[{i}]" for i in index)
