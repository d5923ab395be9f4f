"""Natural frequencies by the signs of a determinant, and by the count of pivots."""

from __future__ import annotations

import numpy as np

from ....runtime.flexible.beam.shapes import root
from ...definition import Definition, Method
from ...scale import COUNT
from ...scenes import model
from ...variants import determinant

#: Number of elements of the beam in the product, and of shapes of each element in the sweep.
PARTS, SHAPES = 4, 6


def _by_signs(number: float) -> float:
    found = determinant.clamped_free(int(number), PARTS)
    exact = root("clamped-free", int(number))
    return abs(found / exact - 1) if np.isfinite(found) else 1.0


def _by_pivots(number: float) -> float:
    count = int(number)
    parts = max(PARTS, count // 2)
    beams = [
        {"name": f"part{k}", "length": 1 / parts, "mass_per_length": 1.0,
         "bending_stiffness": 1.0, "modes": {"y": SHAPES}}
        for k in range(parts)
    ]  # fmt: skip
    hinges = [
        {"name": f"weld{k}", "type": "fixed", "outboard": f"part{k}",
         "inboard": f"part{k - 1}.tip" if k else "ground"}
        for k in range(parts)
    ]  # fmt: skip
    found = model({"gravity": [0, 0, 0], "beam": beams, "hinge": hinges}).modes(count)
    if not found.complete:
        return 1.0
    return abs(float(np.sqrt(found.omega[-1])) / root("clamped-free", count) - 1)


CASE = Definition(
    name="determinant-search",
    title="Frequencies as zeros of a determinant: their number",
    why="The determinant of the conditions at a free end is a difference of products of entries "
    "that grow with exp(beta L). Above about the eleventh mode of a cantilever only rounding is "
    "left of it, with an arbitrary sign; more elements do not help. The pivots of the sweep stay "
    "of the size of the stiffness, and the number of negative ones is the number of modes below a "
    "frequency. Where the determinant does not change its sign exactly once around a mode, the "
    "error counts as 1.",
    parameter="number of the mode", unit="", low=1, high=60, scale=COUNT,
    measured="error of beta L, relative", limit=1e-3,
    method=Method(f"signs of the determinant, {PARTS} transfer matrices", _by_signs),
    remedy=Method("pivots of the sweep counted (model.modes)", _by_pivots), reach=200,
    source="Rui, Wang, Zhang, ch. 2 (transfer matrices of vibrating beams); Wittrick and Williams, "
    "Q. J. Mech. Appl. Math. 24, 1971 (the count)",
)  # fmt: skip
