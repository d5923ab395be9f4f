"""A KernelIR as readable lines, one statement each; indices count from zero as the arrays do."""

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


def listing(kernel: KernelIR) -> list[str]:
    """Every statement, in order."""
    lines: list[str] = []
    for statement in kernel.statements:
        lines += _lines(statement)
    return lines


def _lines(statement: Statement, indent: str = "") -> list[str]:
    if isinstance(statement, Assign):
        return [indent + _assign(statement)]
    if isinstance(statement, Sum):
        over = statement.over
        head = f"{indent}t{statement.number} = sum over {over} < n of {_operand(statement.value)}"
        body = _body(statement, indent)
        return [f"{head} with", *body] if body else [head]
    if isinstance(statement, Store):
        place = statement.port + "".join(f"[{i}]" for i in statement.index)
        looped = f"  for {', '.join(statement.loops)} < n" if statement.loops else ""
        return [*_body(statement, indent), f"{place} = {_operand(statement.value)}{looped}"]
    if isinstance(statement, Guard):
        condition = _operand(statement.condition)
        return [f"leave with code {statement.code} unless {condition}: {statement.message}"]
    return [
        f"{statement.port} = solve({statement.matrix}, {statement.right})  "
        f"else code {statement.code}: {statement.message}"
    ]


def _body(statement: Sum | Store, indent: str) -> list[str]:
    return [line for inner in statement.body for line in _lines(inner, indent + "    ")]


def _assign(assign: Assign) -> str:
    operands = [_operand(a) for a in assign.args]
    value = OPERATIONS[assign.op].text.format(*operands)
    return f"t{assign.number} = {value}"


def _operand(operand: Operand) -> str:
    if isinstance(operand, Constant):
        return operand.text
    if isinstance(operand, Element):
        return operand.port + "".join(f"[{i}]" for i in operand.index)
    return f"t{operand.number}"
