"""Non-smooth functions (Abs, sign, floor, Min, Max, Piecewise): derivatives and kinks.

SymPy differentiates them with distributions (DiracDelta, Heaviside), which have no value.  Here the
derivative is that of the active branch; continuity is checked numerically on both sides of every
switching point.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import combinations

import mpmath
import sympy as sp

SWITCHING = (sp.Abs, sp.sign, sp.floor, sp.Min, sp.Max)


def slope(expression: sp.Basic, symbol: sp.Symbol) -> sp.Basic:
    """Derivative of an expression or a matrix, branch by branch."""
    if not expression.has(*SWITCHING):
        return expression.diff(symbol)
    constants: dict[sp.Basic, sp.Dummy] = {}
    branches = _as_branches(expression, constants)
    return _restore_constants(branches.diff(symbol), constants)


def _as_branches(expression: sp.Basic, constants: dict[sp.Basic, sp.Dummy]) -> sp.Basic:
    """Expression with constants for step functions, and Piecewise for Min and Max.

    For nested extremes SymPy writes the condition as ITE, which no later stage supports.
    """

    def constant(kind: type, a: sp.Expr) -> sp.Dummy:
        return constants.setdefault(kind(a), sp.Dummy(real=True))

    def extreme(kind: type, *arguments: sp.Expr) -> sp.Expr:
        first, *others = arguments
        for other in others:
            condition = first >= other if kind is sp.Max else first <= other
            first = sp.Piecewise((first, condition), (other, True))
        return first

    result = expression.replace(sp.Abs, lambda a: constant(sp.sign, a) * a)
    result = result.replace(sp.sign, lambda a: constant(sp.sign, a))
    result = result.replace(sp.floor, lambda a: constant(sp.floor, a))
    for kind in (sp.Min, sp.Max):
        result = result.replace(kind, lambda *a, kind=kind: extreme(kind, *a))
    return result.replace(sp.ITE, lambda when, a, b: (when & a) | (~when & b))


def _restore_constants(expression: sp.Basic, constants: dict[sp.Basic, sp.Dummy]) -> sp.Basic:
    """Expression with held constants replaced by their values, which may be nested."""
    values = {dummy: value for value, dummy in constants.items()}
    while expression.free_symbols & values.keys():
        expression = expression.xreplace(values)
    return expression


def switches(expressions: Iterable[sp.Basic]) -> Iterator[tuple[sp.Basic, sp.Expr]]:
    """(non-smooth function, expression that vanishes where it switches), without repetition."""
    visited: set[sp.Basic] = set()
    for expression in expressions:
        for node in expression.atoms(sp.Piecewise, *SWITCHING) - visited:
            visited.add(node)
            yield from ((node, vanishing) for vanishing in _switching_expressions(node))


def _switching_expressions(node: sp.Basic) -> Iterator[sp.Expr]:
    if isinstance(node, sp.Piecewise):
        for relation in sp.Tuple(*(when for _, when in node.args)).atoms(sp.core.relational.Rel):
            yield relation.lhs - relation.rhs
    elif isinstance(node, sp.floor):
        yield sp.sin(sp.pi * node.args[0])
    elif isinstance(node, (sp.Min, sp.Max)):
        yield from (a - b for a, b in combinations(node.args, 2))
    else:
        yield node.args[0]


def crossings(values: Iterable[mpmath.mpf], function: object, digits: int) -> Iterator[mpmath.mpf]:
    """Points where a scalar function changes sign between neighbours of `values`."""
    assert callable(function)
    with mpmath.workdps(digits):
        previous = None
        for x in values:
            current = (x, mpmath.sign(function(x)))
            if previous is not None and previous[1] != 0 and previous[1] * current[1] <= 0:
                low, high = previous[0], x
                while high - low > mpmath.mpf(10) ** (5 - digits):
                    middle = (low + high) / 2
                    if mpmath.sign(function(middle)) == previous[1]:
                        low = middle
                    else:
                        high = middle
                yield (low + high) / 2
            previous = current
