"""Statements of a straight line: what each reads, and which of them are one instruction."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from mstmm.ir import Assign, Guard, Operand, Store, Temporary

Line = Assign | Store | Guard


def operands(statement: object) -> tuple[Operand, ...]:
    """What a statement of a straight-line kernel reads."""
    if isinstance(statement, Assign):
        return statement.args
    if isinstance(statement, Store):
        return (statement.value,)
    return (statement.condition,) if isinstance(statement, Guard) else ()


def units_of(statements: Sequence[Line]) -> list[list[Line]]:
    """Statements one by one, but a product beside the sum that alone reads it: one instruction."""
    readers: dict[int, int] = {}
    for statement in statements:
        for number in _reads(statement):
            readers[number] = readers.get(number, 0) + 1
    products = {
        s.number: s
        for s in statements
        if isinstance(s, Assign) and s.op == "mul" and readers.get(s.number) == 1
    }
    fused: dict[int, Assign] = {}
    for place, statement in enumerate(statements):
        if isinstance(statement, Assign) and statement.op in ("add", "sub"):
            found = [number for number in _reads(statement) if number in products]
            if found:
                fused[place] = products.pop(found[0])
    moved = {product.number for product in fused.values()}
    return [
        [fused[place], s] if place in fused else [s]
        for place, s in enumerate(statements)
        if not (isinstance(s, Assign) and s.number in moved)
    ]


def _reads(statement: Line) -> list[int]:
    return [a.number for a in operands(statement) if isinstance(a, Temporary)]


def reads_of(units: Sequence[Sequence[Line]]) -> list[set[int]]:
    """The units that each unit waits for; guards keep their order."""
    makers = {s.number: k for k, unit in enumerate(units) for s in unit if isinstance(s, Assign)}
    before = [
        {makers[n] for s in unit for n in _reads(s) if n in makers and makers[n] != k}
        for k, unit in enumerate(units)
    ]
    guards = [k for k, unit in enumerate(units) if isinstance(unit[-1], Guard)]
    for earlier, later in pairwise(guards):
        before[later].add(earlier)
    return before
