"""Closed loops: their starts, their closure error over a run, and contacts that pull."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure
from mstmm.risk import Risk

from ...engine.loops.loop_analysis import NEGLIGIBLE_MISFIT
from ...engine.loops.loop_calls import LoopCalls
from ...integrate.steppers import INDEX3_SUFFIX
from ...packing.system_variants import LOCKING_GAP_FRACTION, characteristic_length
from ..certificate_data import Closure
from ..element_checks import find_pulling_contacts
from .check import Check, MeasuringCheck, RunStart

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene
    from ...run.trajectory import Trajectory
    from ..result_record import Record

#: Remedy for redundant rows that are violated.
MISFIT_REMEDY = (
    "give the axes and lengths of the loop with more digits, or model its compliance by a bushing "
    "or a flexible body"
)
#: Maximum numbers of checked samples and of named rows.
_MAX_SAMPLES, _MAX_NAMED_ROWS = 12, 8
#: Ratio of gaps of redundant rows to those of independent rows that indicates a violation by the
#: geometry.
_MISFIT_RATIO = 10.0


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


class SingularStartCheck(Check):
    """Mechanisms that start in a singular configuration, where their motion is not unique."""

    def before(self, start: RunStart) -> Iterator[Risk]:
        """Risk that the given initial speeds do not determine the motion."""
        loop_start = start.model.loop_start
        if loop_start is None or not loop_start.loops.singular:
            return
        has_open_speed = any(
            not hinge.is_weld and hinge.drive is None and hinge.name not in loop_start.fast_hinges
            for hinge in start.model.packed_scene.user_scene.hinge
        )
        if not has_open_speed or not np.array_equal(start.q, loop_start.start[0]):
            return
        hinge = loop_start.loops.redundant_rows[0][0]
        yield Risk(
            "branching-start", f'hinge "{hinge}"',
            "the loops start in a singular configuration, where the motion is not unique; if only "
            "some speeds are given, they may be compatible with no motion",
            "give the speeds of all hinges (initial.u) for the intended motion, or start in "
            "another configuration", seen_before_run=True,
        )  # fmt: skip


class RedundantRowCheck(MeasuringCheck[Closure | None]):
    """Redundant rows of loops that are violated: before a run by a position gap at the start."""

    def before(self, start: RunStart) -> Iterator[Risk]:
        """Risk of the omitted row with the largest gap, if that is above rounding."""
        loop_start = start.model.loop_start
        gap, name, direction = (
            (0.0, "", "") if loop_start is None else loop_start.loops.redundancy_gap
        )
        if gap > 0.0:
            yield Risk(
                "nearly-redundant", f'"{name}"',
                f"direction {direction} of the loop is redundant, violated by {gap:.1e} (m, rad); "
                "it is left out, for the mechanism would lock if it were satisfied exactly",
                MISFIT_REMEDY, gap, seen_before_run=True,
            )  # fmt: skip

    def measure(self, result: Record) -> Closure | None:
        """Closure error over the samples of the run."""
        return loop_closure(result.model, result.trajectory)

    def after(self, result: Record) -> Iterator[Risk]:
        """Risk of a row that is violated along the run, unless one was known before it."""
        closure = self.measured(result)
        if closure is None or not closure.misfit > 0:
            return
        if any(risk.name == "nearly-redundant" for risk in result.trajectory.risks):
            return
        yield Risk(
            "nearly-redundant", closure.misfit_loop,
            f"a redundant row of {closure.misfit_loop} is violated by up to {closure.misfit:.1e} "
            "(m, rad) along the motion: the geometry of the loop does not fit exactly",
            MISFIT_REMEDY, closure.misfit,
        )  # fmt: skip


class PullingContactCheck(Check):
    """Rolling constraints that pull, where a contact would separate."""

    def after(self, result: Record) -> Iterable[Risk]:
        """Risks of normal loads that pull in some sample."""
        return find_pulling_contacts(result)


CLOSURE = RedundantRowCheck()
