"""Conversion of formulas to SymPy expressions, without terms that are only rounding."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import sympy as sp
from sympy.simplify.fu import TR10i

from ..ir.operations import OPERATIONS
from ..numerics.symbolic_number import Atom, Formula, Monomial, to_exact

#: Largest term that is rounding, relative to the largest entries of its row and column.
_MAX_ROUNDING = 1e-14
#: Largest number of operations of an entry in which sines and cosines of sums are combined.
_MAX_COMBINED_OPERATIONS = 100
#: Functions of SymPy whose names differ from those of the IR.
_SYMPY_FUNCTIONS = {
    "inverse": lambda x: 1 / x, "sqrt": sp.sqrt, "pow": sp.Pow, "min": sp.Min, "max": sp.Max,
    "lt": sp.Lt, "le": sp.Le, "eq": sp.Eq,
}  # fmt: skip
_LOGIC = {"and": sp.And, "or": sp.Or, "not": sp.Not}
_TRUTH_OPERATIONS = {"lt", "le", "eq", *_LOGIC}


class SympyWriter:
    """Converter of the formulas of one book; every atom is converted once."""

    def __init__(self) -> None:
        self._written: dict[Atom, sp.Expr] = {}

    def symbol(self, formula: Formula) -> Any:
        """Convert a formula that is a single symbol."""
        return self._expression(formula)

    def matrix(self, rows: Sequence[Sequence[Formula]]) -> sp.ImmutableMatrix:
        """Convert a matrix, simplified as far as that is cheap."""
        sizes = [[_formula_size(entry) for entry in row] for row in rows]
        row_sizes = [max(row, default=0.0) for row in sizes]
        column_sizes = [max(column, default=0.0) for column in zip(*sizes, strict=True)]
        entries = [
            [
                self._simple(entry, _MAX_ROUNDING * math.sqrt(row_sizes[i] * column_sizes[j]))
                for j, entry in enumerate(row)
            ]
            for i, row in enumerate(rows)
        ]
        return sp.ImmutableMatrix(len(rows), len(column_sizes), [x for row in entries for x in row])

    def _simple(self, formula: Formula, least: float) -> sp.Expr:
        terms = {m: c for m, c in formula.terms.items() if math.fabs(c) * _product_size(m) > least}
        expression = self._expression(Formula(formula.value, terms))
        if expression.has(sp.sin) and expression.count_ops() <= _MAX_COMBINED_OPERATIONS:
            return TR10i(expression)
        return expression

    def _expression(self, formula: Formula) -> sp.Expr:
        return sp.Add(*(self._term(m, c) for m, c in formula.terms.items()))

    def _term(self, monomial: Monomial, c: Any) -> sp.Expr:
        coefficient = to_exact(float(c)) if isinstance(c, float) else c
        number = (
            sp.Float(coefficient) if isinstance(coefficient, float) else sp.Rational(coefficient)
        )
        return sp.Mul(number, *(self._atom(atom) ** power for atom, power in monomial))

    def _atom(self, atom: Atom) -> sp.Expr:
        if atom not in self._written:
            self._written[atom] = self._convert_atom(atom)
        return self._written[atom]

    def _convert_atom(self, atom: Atom) -> sp.Expr:
        if atom.op == "symbol":
            return sp.Symbol(atom.name, real=True)
        if atom.op == "select":
            condition, *values = atom.args
            value_if_true, value_if_false = map(self._expression, values)
            return sp.Piecewise((value_if_true, self._condition(condition)), (value_if_false, True))
        if atom.op in _LOGIC:
            return _LOGIC[atom.op](*map(self._condition, atom.args))
        args = [self._expression(arg) for arg in atom.args]
        function = _SYMPY_FUNCTIONS.get(atom.op) or getattr(sp, OPERATIONS[atom.op].sympy)
        return function(*args)

    def _condition(self, formula: Formula) -> sp.Basic:
        """Convert a formula that is used as a condition (true if not zero)."""
        if formula.is_constant:
            return sp.true if formula.value else sp.false
        ((monomial, c), *other_terms) = formula.terms.items()
        ((atom, power), *other_atoms) = monomial
        is_truth_value = (
            atom.op in _TRUTH_OPERATIONS
            and (c, power) == (1, 1)
            and not other_terms
            and not other_atoms
        )
        return self._atom(atom) if is_truth_value else sp.Ne(self._expression(formula), 0)


def _product_size(monomial: Monomial) -> float:
    """Magnitude of a product at the numbers of the scene; factors that are zero count as 1."""
    size = 1.0
    for atom, power in monomial:
        size *= abs(atom.value or 1.0) ** power
    return size


def _formula_size(formula: Formula) -> float:
    return sum(math.fabs(c) * _product_size(m) for m, c in formula.terms.items())
