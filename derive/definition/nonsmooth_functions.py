"""Functions that switch (Abs, sign, floor, Min, Max, Piecewise): their slopes, and where they kink.

SymPy differentiates them with distributions (DiracDelta, Heaviside), which have no value.  Here
the slope is that of the branch in force; whether branches meet as they must is looked at by
numbers on both sides of every place where one takes over.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import combinations

import mpmath
import sympy as sp

SWITCHING = (sp.Abs, sp.sign, sp.floor, sp.Min, sp.Max)


def slope(expression: sp.Basic, symbol: sp.Symbol) -> sp.Basic:
    """Derivative of an expression or a matrix, of each branch by itself."""
    if not expression.has(*SWITCHING):
        return expression.diff(symbol)
    held: dict[sp.Basic, sp.Dummy] = {}
    branches = _in_branches(expression, held)
    return _restored(branches.diff(symbol), held)


def _in_branches(expression: sp.Basic, held: dict[sp.Basic, sp.Dummy]) -> sp.Basic:
    """The expression with constants for what steps, and Piecewise for Min and Max.

    Where one extreme is compared with another, SymPy writes the condition as ITE, which no stage
    behind knows.
    """

    def constant(kind: type, a: sp.Expr) -> sp.Dummy:
        return held.setdefault(kind(a), sp.Dummy(real=True))

    def extreme(kind: type, *arguments: sp.Expr) -> sp.Expr:
        first, *rest = arguments
        for other in rest:
            leads = first >= other if kind is sp.Max else first <= other
            first = sp.Piecewise((first, leads), (other, True))
        return first

    found = expression.replace(sp.Abs, lambda a: constant(sp.sign, a) * a)
    found = found.replace(sp.sign, lambda a: constant(sp.sign, a))
    found = found.replace(sp.floor, lambda a: constant(sp.floor, a))
    for kind in (sp.Min, sp.Max):
        found = found.replace(kind, lambda *a, kind=kind: extreme(kind, *a))
    return found.replace(sp.ITE, lambda when, a, b: (when & a) | (~when & b))


def _restored(expression: sp.Basic, held: dict[sp.Basic, sp.Dummy]) -> sp.Basic:
    """The held constants as what they stand for; one may stand inside another."""
    back = {dummy: value for value, dummy in held.items()}
    while expression.free_symbols & back.keys():
        expression = expression.xreplace(back)
    return expression


def switches(expressions: Iterable[sp.Basic]) -> Iterator[tuple[sp.Basic, sp.Expr]]:
    """(function that switches, expression that vanishes where it does), each once."""
    seen: set[sp.Basic] = set()
    for expression in expressions:
        for node in expression.atoms(sp.Piecewise, *SWITCHING) - seen:
            seen.add(node)
            yield from ((node, vanishing) for vanishing in _vanishing(node))


def _vanishing(node: sp.Basic) -> Iterator[sp.Expr]:
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
    """Where a function of one number changes its sign between neighbours of `values`."""
    assert callable(function)
    with mpmath.workdps(digits):
        before = None
        for x in values:
            here = (x, mpmath.sign(function(x)))
            if before is not None and before[1] != 0 and before[1] * here[1] <= 0:
                low, high = before[0], x
                while high - low > mpmath.mpf(10) ** (5 - digits):
                    middle = (low + high) / 2
                    if mpmath.sign(function(middle)) == before[1]:
                        low = middle
                    else:
                        high = middle
                yield (low + high) / 2
            before = here
