"""Closing a loop of light rods through a heavy one."""

from __future__ import annotations

from mstmm.errors import NumericalFailure, SceneError

from ...definition import Definition, Method
from ...measures import rounding
from ...scale import LOG
from ...scenes import held_row, model

RODS = 5


def _error(ratio: float, refined: bool) -> float:
    try:
        row = model(held_row([1.0, 1.0, 1.0, ratio, 1.0]))
    except SceneError as refused:  # no digits are left
        raise NumericalFailure(str(refused)) from None
    row.packed.model.refines = int(refined)
    return rounding(row, [row.initial_state()])


CASE = Definition(
    name="heavy-link",
    title="Closed loops: a heavy link behind light ones",
    why="What closes a loop is found in the sweep by the answers of its rods to a load at the cut. "
    "Light rods in front of a heavy one answer far more than it does, and what is left for it is a "
    "difference of large numbers. Inverse dynamics eliminates nothing: what it leaves over of the "
    "answer is small and known well, and is answered once more.",
    parameter="mass of the fourth rod over that of the others", unit="", low=1.0, high=1e13,
    scale=LOG,
    measured="error of the accelerations, relative", limit=1e-9,
    method=Method(f"one sweep, {RODS} rods between two points", lambda x: _error(x, False)),
    remedy=Method("refined by one more sweep", lambda x: _error(x, True)), reach=1e16,
    source="Higham, Accuracy and Stability of Numerical Algorithms, SIAM 2002, ch. 12 (iterative "
    "refinement)",
)  # fmt: skip
