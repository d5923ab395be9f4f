"""Reject definitions whose branches are discontinuous where mechanics requires continuity.

A hinge's position, rotation and motion subspace must be continuous: where the slope of a position
jumped, the velocities of the bodies would, which is an impulse that no hinge carries.  A potential
must be continuous, or a jump would create energy.  Second derivatives and forces may jump.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence

import mpmath
import sympy as sp

from mstmm.errors import ElementError

from ..definition.nonsmooth_functions import crossings, switches
from .equation_evaluation import Undefined, evaluate_matrix

_DIGITS = 40
#: Distance from the switching point at which both branches are evaluated.
_BRANCH_DISTANCE = mpmath.mpf(10) ** -15
#: Largest relative difference between both sides of a continuous quantity.
_MAX_RELATIVE_JUMP = 1e-9
#: Number of samples of a variable in the search for sign changes.
_SAMPLE_COUNT = 41

Range = tuple[float, float]


def refuse_jumps(
    where: str,
    expressions: Mapping[str, sp.Matrix],
    along: Mapping[sp.Symbol, Range],
    points: Iterable[Mapping[sp.Symbol, float]],
    why: str,
) -> None:
    """Raise ElementError if one of the named matrices jumps where the branch changes.

    Args:
        expressions: name -> matrix in the symbols of the points.
        along: the variables and the range in which each varies, the others fixed at a point.
        why: consequence of a jump and its remedy, for the message.
    """
    branch_switches = list(switches(expressions.values()))
    if not branch_switches:
        return
    for point in points:
        for node, switch_function in branch_switches:
            for symbol in sorted(switch_function.free_symbols & along.keys(), key=str):
                for location in _branch_points(switch_function, symbol, along[symbol], point):
                    _reject_jump(where, expressions, node, {**point, symbol: location}, symbol, why)


def _branch_points(
    vanishing: sp.Expr, symbol: sp.Symbol, bounds: Range, point: Mapping[sp.Symbol, float]
) -> list[mpmath.mpf]:
    def value(x: mpmath.mpf) -> mpmath.mpf:
        try:
            return evaluate_matrix(sp.Matrix([vanishing]), {**point, symbol: x}, _DIGITS)[0][0]
        except Undefined:
            return mpmath.mpf(0)

    return list(crossings(mpmath.linspace(*bounds, _SAMPLE_COUNT), value, _DIGITS))


def _reject_jump(
    where: str,
    expressions: Mapping[str, sp.Matrix],
    node: sp.Basic,
    point_of_jump: Mapping[sp.Symbol, mpmath.mpf],
    symbol: sp.Symbol,
    why: str,
) -> None:
    for label, matrix in expressions.items():
        with mpmath.workdps(_DIGITS):
            sides = [
                {**point_of_jump, symbol: point_of_jump[symbol] + d}
                for d in (-_BRANCH_DISTANCE, _BRANCH_DISTANCE)
            ]
            try:
                values_before, values_after = (_matrix_entries(matrix, side) for side in sides)
            except Undefined:
                continue
            size = 1 + max(map(abs, values_before), default=0)
            if all(
                abs(a - b) <= _MAX_RELATIVE_JUMP * size
                for a, b in zip(values_before, values_after, strict=True)
            ):
                continue
        raise ElementError(
            f"{where}: {label} jumps at {_expression_text(symbol)} = "
            f"{_number_text(point_of_jump[symbol])}, where "
            f"{_expression_text(node):.80} switches branches: {why}"
        )


def _number_text(x: mpmath.mpf) -> str:
    return str(mpmath.nstr(mpmath.chop(x, 1e-20), 6))


def _expression_text(expression: sp.Basic) -> str:
    """Expression on one line in the author's notation: q.angle, not q_angle."""
    return re.sub(r"\b([qup])_", r"\1.", " ".join(str(expression).split()))


def _matrix_entries(
    matrix: sp.Matrix, point: Mapping[sp.Symbol, mpmath.mpf]
) -> Sequence[mpmath.mpf]:
    return [x for row in evaluate_matrix(matrix, point, _DIGITS) for x in row]
