"""Operands of straight-line statements, and statements that form one instruction."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from mstmm.ir import Assign, Guard, Operand, Store, Temporary

Line = Assign | Store | Guard


def operands(statement: object) -> tuple[Operand, ...]:
    """Operands that a statement of a straight-line kernel reads."""
    if isinstance(statement, Assign):
        return statement.args
    if isinstance(statement, Store):
        return (statement.value,)
    return (statement.condition,) if isinstance(statement, Guard) else ()


def units_of(statements: Sequence[Line]) -> list[list[Line]]:
    """Statements one by one, but a product together with the only sum that reads it (fused)."""
    readers: dict[int, int] = {}
    for statement in statements:
        for number in _temporaries_read(statement):
            readers[number] = readers.get(number, 0) + 1
    products = {
        s.number: s
        for s in statements
        if isinstance(s, Assign) and s.op == "mul" and readers.get(s.number) == 1
    }
    fused: dict[int, Assign] = {}
    for index, statement in enumerate(statements):
        if isinstance(statement, Assign) and statement.op in ("add", "sub"):
            numbers = [number for number in _temporaries_read(statement) if number in products]
            if numbers:
                fused[index] = products.pop(numbers[0])
    fused_numbers = {product.number for product in fused.values()}
    return [
        [fused[index], s] if index in fused else [s]
        for index, s in enumerate(statements)
        if not (isinstance(s, Assign) and s.number in fused_numbers)
    ]


def _temporaries_read(statement: Line) -> list[int]:
    return [a.number for a in operands(statement) if isinstance(a, Temporary)]


def reads_of(units: Sequence[Sequence[Line]]) -> list[set[int]]:
    """Units that each unit depends on; guards keep their order."""
    makers = {s.number: k for k, unit in enumerate(units) for s in unit if isinstance(s, Assign)}
    dependencies = [
        {makers[n] for s in unit for n in _temporaries_read(s) if n in makers and makers[n] != k}
        for k, unit in enumerate(units)
    ]
    guards = [k for k, unit in enumerate(units) if isinstance(unit[-1], Guard)]
    for earlier, later in pairwise(guards):
        dependencies[later].add(earlier)
    return dependencies
