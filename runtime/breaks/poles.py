"""Poles of expressions of time: times at which a force grows too fast for a bounded motion.

Between the two times that enclose a pole a run makes one step without an error estimate.
That is right where a force jumps, or grows as slowly as 1/sqrt(t), whose integral is finite.  A
force that grows like 1/t or faster causes an unbounded motion.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mstmm.arrays import Array

from .view import View

#: Operations that have poles.
_OPERATIONS = frozenset({"div", "pow", "tan"})

#: Distances from a pole at which the function is compared, in widths of its gap; the width is at
#: least so many spacings of floating-point numbers.
_DISTANCES, _SPACINGS = (1.0, 100.0, 10_000.0), 64.0

#: A function that grows by this factor from distance to distance grows like 1/t^0.9 or faster.
_GROWTH = 50**0.9


def poles(view: View, gaps: Array) -> tuple[NDArray[np.bool_], bool]:
    """Find the gaps (n, 2), s, that contain a pole of the expression or of a part of it.

    Returns a mask (n,), and whether the whole expression has the poles.  Only parts that depend on
    time alone are examined.
    """
    found = np.zeros(len(gaps), bool)
    has_some = any(view.expression.terms[i].op in _OPERATIONS for i in view.moving)
    if not has_some or not len(gaps):
        return found, False
    widest = view.widest()
    for number in widest:
        found |= _has_pole(view, number, gaps)
    return found, widest == [view.expression.root]


def _has_pole(view: View, number: int, gaps: Array) -> NDArray[np.bool_]:
    found = np.zeros(len(gaps), bool)
    width = np.diff(gaps, axis=1)[:, 0]
    width = np.maximum(width, _SPACINGS * np.spacing(np.abs(gaps).max(axis=1)))
    for edge, way in ((gaps[:, 0], -1.0), (gaps[:, 1], 1.0)):
        near, middle, far = (
            np.abs(view.values(number, edge + way * distance * width)) for distance in _DISTANCES
        )
        found |= (near > _GROWTH * middle) & (middle > _GROWTH * far) & (far > 0)
    return found
