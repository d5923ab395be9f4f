"""Natural frequencies by the signs of a determinant, and by the count of pivots."""

from __future__ import annotations

import numpy as np

from ....runtime.flexible.beam.shape_functions import wave_number
from ...case_definition import CaseDefinition, MethodDefinition
from ...parameter_scale import COUNT_SCALE
from ...shared_scenes import compile_looped
from ...variants import determinant

#: Number of elements of the beam in the product, and of shapes of each element in the sweep.
ELEMENT_COUNT, SHAPE_COUNT = 4, 6


def _error_by_signs(number: float) -> float:
    wavenumber = determinant.clamped_free_wavenumber(int(number), ELEMENT_COUNT)
    exact = wave_number("clamped-free", int(number))
    return abs(wavenumber / exact - 1) if np.isfinite(wavenumber) else 1.0


def _error_by_pivots(number: float) -> float:
    count = int(number)
    parts = max(ELEMENT_COUNT, count // 2)
    beams = [
        {"name": f"part{k}", "length": 1 / parts, "mass_per_length": 1.0,
         "bending_stiffness": 1.0, "modes": {"y": SHAPE_COUNT}}
        for k in range(parts)
    ]  # fmt: skip
    hinges = [
        {"name": f"weld{k}", "type": "fixed", "outboard": f"part{k}",
         "inboard": f"part{k - 1}.tip" if k else "ground"}
        for k in range(parts)
    ]  # fmt: skip
    modes = compile_looped({"gravity": [0, 0, 0], "beam": beams, "hinge": hinges}).modes(count)
    if not modes.is_complete:
        return 1.0
    return abs(float(np.sqrt(modes.omega[-1])) / wave_number("clamped-free", count) - 1)


CASE = CaseDefinition(
    name="determinant-search",
    title="Frequencies as zeros of a determinant: their number",
    cause="The determinant of the conditions at a free end is a difference of products of entries "
    "that grow with exp(beta L). Above about the eleventh mode of a cantilever only rounding is "
    "left of it, with an arbitrary sign; more elements do not help. The pivots of the sweep stay "
    "of the size of the stiffness, and the number of negative ones is the number of modes below a "
    "frequency. Where the determinant does not change its sign exactly once around a mode, the "
    "error counts as 1.",
    parameter="number of the mode",
    unit="",
    low=1,
    high=60,
    scale=COUNT_SCALE,
    measured="error of beta L, relative",
    limit=1e-3,
    method=MethodDefinition(
        f"signs of the determinant, {ELEMENT_COUNT} transfer matrices", _error_by_signs
    ),
    remedy=MethodDefinition("pivots of the sweep counted (model.modes)", _error_by_pivots),
    reach=200,
    source="Rui, Wang, Zhang, ch. 2 (transfer matrices of vibrating beams); Wittrick and Williams, "
    "Q. J. Mech. Appl. Math. 24, 1971 (the count)",
)
