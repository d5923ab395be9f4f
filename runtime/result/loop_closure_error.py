"""Loop closure error of a run: position gap and velocity error at its samples."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure
from mstmm.plain_data import stored_as

from ..engine.loops.loop_analysis import NEGLIGIBLE_MISFIT
from ..engine.loops.loop_calls import LoopCalls
from ..integrate.steppers import INDEX3_SUFFIX
from ..packing.system_variants import LOCKING_GAP_FRACTION, characteristic_length

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from ..run.trajectory import Trajectory

#: Name and remedy of the risk of redundant rows that are violated.
MISFIT_RISK = "nearly-redundant"
MISFIT_REMEDY = (
    "give the axes and lengths of the loop with more digits, or model its compliance by a bushing "
    "or a flexible body"
)
#: Maximum numbers of checked samples and of named rows.
_MAX_SAMPLES, _MAX_NAMED_ROWS = 12, 8
#: Ratio of gaps of redundant rows to those of independent rows that indicates a violation by the
#: geometry.
_MISFIT_RATIO = 10.0


@dataclass(frozen=True)
class Closure:
    """Largest position gap (m, rad) and velocity error (m/s, rad/s) of the loops of a run.

    Over the checked samples. Also describes the number of independent rows, the redundant rows, and
    the components of indeterminate reactions. Steps `position_level` leave velocity errors of the
    size of their errors. `misfit` is the largest gap (m, rad) of a redundant row if it exceeds
    rounding, else 0, and `misfit_loop` is the name of its loop.
    """

    gap: float
    slip: float
    summary: str = field(default="", metadata=stored_as("counted"))
    redundant_text: str = field(default="", metadata=stored_as("repeated"))
    open_loads: str = ""
    position_level: bool = field(default=False, metadata=stored_as("on_positions"))
    misfit: float = 0.0
    misfit_loop: str = ""

    def __str__(self) -> str:
        text = f"position gap {self.gap:.1e} (m, rad), velocity error {self.slip:.1e} (m/s, rad/s)"
        text += ", not removed by position-level steps" if self.position_level else ""
        notes = (
            ("", self.summary), ("redundant rows: ", self.redundant_text),
            ("indeterminate loads: ", self.open_loads),
        )  # fmt: skip
        return "; ".join((text, *(title + words for title, words in notes if words)))


def loop_closure(model: CompiledScene, run: Trajectory) -> Closure | None:
    """Loop closure of a run; None for trees and runs without samples.

    Loops that a release has opened have no gap.
    """
    if model.loop_start is None or not len(run.t):
        return None
    calls, gap, slip = LoopCalls(model.looped, np.array(run.q[0])), 0.0, 0.0
    misfit, misfit_loop = (
        NEGLIGIBLE_MISFIT * LOCKING_GAP_FRACTION * characteristic_length(model.packed_scene.system),
        "",
    )
    for k in np.unique(np.linspace(0, len(run.t) - 1, _MAX_SAMPLES).astype(int)):
        q, u, t = np.array(run.q[k]), np.array(run.u[k]), float(run.t[k])
        if model.packed_scene.releases:
            calls.memory = np.array(run.memory[k])
        gaps = _residuals(calls, calls.position_level, q, u, t)
        redundant_gaps = np.where(calls.inverses() > 0, 0.0, gaps)
        row = int(np.argmax(redundant_gaps))
        if redundant_gaps[row] > max(misfit, _MISFIT_RATIO * np.max(gaps - redundant_gaps)):
            misfit, misfit_loop = float(redundant_gaps[row]), calls.closing_label(row)
        gap = max(gap, float(np.max(gaps)))
        slip = max(slip, float(np.max(_residuals(calls, calls.velocity_level, q, u, t))))
    on_positions = run.settings.method.endswith(INDEX3_SUFFIX)
    loops = model.loop_start.loops
    return Closure(
        gap, slip, loops.summary, loops.redundant_text(_MAX_NAMED_ROWS), loops.indeterminate_text,
        on_positions, misfit if misfit_loop else 0.0, misfit_loop,
    )  # fmt: skip


def _residuals(calls: LoopCalls, level: int, q: Array, u: Array, t: float) -> Array:
    """Constraint residuals (rows,) at one state; nan where it cannot be evaluated."""
    try:
        residuals = np.abs(calls.correction(level, q, u, t=t)[1])
    except NumericalFailure:
        return np.full(calls.count, np.nan)
    residuals[calls.released_rows()] = 0.0
    return residuals
