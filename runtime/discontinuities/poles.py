"""Poles of expressions of time: times at which a force grows too fast for a bounded motion.

Between the two times that enclose a pole a run makes one step without an error estimate.
That is right where a force jumps, or grows as slowly as 1/sqrt(t), whose integral is finite.  A
force that grows like 1/t or faster causes an unbounded motion.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array

from .expression_functions import ExpressionFunctions

#: Operations that have poles.
_POLE_OPERATIONS = frozenset({"div", "pow", "tan"})

#: Distances from a pole at which the function is compared, in widths of its gap; the width is at
#: least so many spacings of floating-point numbers.
_DISTANCES, _MIN_WIDTH_SPACINGS = (1.0, 100.0, 10_000.0), 64.0

#: A function that grows by this factor from distance to distance grows like 1/t^0.9 or faster.
_MIN_POLE_GROWTH = 50**0.9


def find_poles(view: ExpressionFunctions, gaps: Array) -> tuple[NDArray[np.bool_], bool]:
    """Find the gaps (n, 2), s, that contain a pole of the expression or of a part of it.

    Returns a mask (n,), and whether the whole expression has the poles.  Only parts that depend on
    time alone are examined.
    """
    is_pole = np.zeros(len(gaps), bool)
    has_pole_operation = any(view.expression.terms[i].op in _POLE_OPERATIONS for i in view.varying)
    if not has_pole_operation or not len(gaps):
        return is_pole, False
    largest_terms = view.widest()
    for term_index in largest_terms:
        is_pole |= _has_pole(view, term_index, gaps)
    return is_pole, largest_terms == [view.expression.root]


def _has_pole(view: ExpressionFunctions, number: int, gaps: Array) -> NDArray[np.bool_]:
    is_pole = np.zeros(len(gaps), bool)
    width = np.diff(gaps, axis=1)[:, 0]
    width = np.maximum(width, _MIN_WIDTH_SPACINGS * np.spacing(np.abs(gaps).max(axis=1)))
    for edge, direction in ((gaps[:, 0], -1.0), (gaps[:, 1], 1.0)):
        near_value, middle_value, far_value = (
            np.abs(view.values(number, edge + direction * distance * width))
            for distance in _DISTANCES
        )
        is_pole |= (
            (near_value > _MIN_POLE_GROWTH * middle_value)
            & (middle_value > _MIN_POLE_GROWTH * far_value)
            & (far_value > 0)
        )
    return is_pole
