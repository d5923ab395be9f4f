"""Checks of runs, in the order of their risks: findings before a run, and its certificate."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from mstmm.risk import RUN, DeferredRisks, Risk, order_risks

from ...packing.event_functions import MAX_SWITCHES
from ...run.error_estimate import ErrorEstimate
from ...run.step_stability import StepCheck, check_later
from ..certificate import Certificate
from ..certificate_data import MAX_CHECKED_BODIES
from ..element_checks import stiffest_spring_deflection
from .check import Check, MeasuringCheck, RunStart, risks_of
from .conditioning import PIVOT_LOSS, SINGULARITY
from .conservation import BALANCE, step_control
from .exact_beams import EXACT_BEAM_CHECKS, EXACT_RANGE, StretchCheck
from .flexible import FLEXIBILITY_CHECKS, MODEL_RANGE, ShapeCheck, StiffeningCheck
from .loops import CLOSURE, PullingContactCheck, SingularStartCheck
from .narrow_features import NarrowFeatureCheck
from .stiffness import STIFFNESS

if TYPE_CHECKING:
    from ...run.trajectory import Trajectory
    from ..result_record import Record

#: Deviation of a quaternion's length from 1 that is a risk.
MAX_LENGTH_ERROR = 1e-3


class TimeMapCheck(Check):
    """Expressions that could not be mapped over time, or that a fixed step may miss."""

    def before(self, start: RunStart) -> Iterator[Risk]:
        """Risks of narrow loads, poles and switches, and of too many switches of the motion."""
        packed, settings = start.model.packed_scene, start.settings
        time_map = packed.time_map(settings.t_start, settings.t_end)
        yield from time_map.notes
        missed = None if settings.step is None else time_map.missed_feature_risk(settings.step)
        if missed is not None:
            yield missed
        count = len(packed.event_functions.switches)
        if count > MAX_SWITCHES:
            yield Risk(
                "switches", RUN,
                f"more than {MAX_SWITCHES} conditions depend on the motion; only the first "
                f"{MAX_SWITCHES} end a step where they switch",
                "give max_step so that none is missed", count, MAX_SWITCHES, seen_before_run=True,
            )  # fmt: skip


class FinitenessCheck(MeasuringCheck[bool]):
    """States that are not finite."""

    def measure(self, result: Record) -> bool:
        """Whether all values of q and u are finite."""
        return bool(np.isfinite(result.q).all() and np.isfinite(result.u).all())

    def after(self, result: Record) -> Iterator[Risk]:
        """Risk that numbers overflowed."""
        if not self.measured(result):
            yield Risk(
                "not-finite", RUN, "some states are not finite",
                "use smaller steps or tolerances, or find the quantity that grows without bound",
            )  # fmt: skip


class TargetErrorCheck(Check):
    """A target error that was not achieved."""

    def after(self, result: Record) -> Iterator[Risk]:
        """Risk of an estimate above the target."""
        yield from risks_of(result.achieved_error)


class TrajectoryCheck(Check):
    """Findings before a run and during its steps, which the trajectory keeps."""

    def after(self, result: Record) -> Iterable[Risk]:
        """Risks of the trajectory."""
        return result.trajectory.risks


class OutputCheck(Check):
    """Outputs that are not finite at finite states."""

    def after(self, result: Record) -> Iterator[Risk]:
        """Risk of each such output."""
        count = len(result.t)
        finite = np.isfinite(np.hstack([result.q, result.u])).all(axis=1)
        for name, values in result.outputs().items() if count else ():
            is_invalid = finite & ~np.isfinite(values.reshape(count, -1)).all(axis=1)
            if is_invalid.any():
                first_time = float(result.t[int(np.argmax(is_invalid))])
                yield Risk(
                    "not-finite", f'output "{name}"',
                    f'output "{name}" is not finite at {int(is_invalid.sum())} of {count} '
                    f"samples, first at t = {first_time:.6g} s",
                    "keep divisors and the arguments of roots and logarithms within their range",
                )  # fmt: skip


class QuaternionCheck(Check):
    """Quaternions far from unit length before normalisation."""

    def after(self, result: Record) -> Iterator[Risk]:
        """Risk of the largest deviation between steps."""
        residual = result.trajectory.norm_residual
        if residual > MAX_LENGTH_ERROR:
            yield Risk(
                "quaternion-length", RUN,
                f"the length of quaternions differed from 1 by up to {residual:.1e} between steps: "
                "the error of attitudes is of the same size",
                "use smaller tolerances, or a method of the package", residual, MAX_LENGTH_ERROR,
            )  # fmt: skip


class StepStabilityCheck(MeasuringCheck[StepCheck | None]):
    """Fixed steps that are too long for the fastest motion, at the start or later."""

    def measure(self, result: Record) -> StepCheck | None:
        """The first sample after the start for which the step is too long."""
        return check_later(result.model.looped, result.trajectory)

    def after(self, result: Record) -> Iterator[Risk]:
        """Risk at the start, else at a later sample."""
        at_start = [*risks_of(result._step)]
        yield from at_start or risks_of(self.measured(result))


class ModelCheck(Check):
    """Models of the scene that are outside their range in any run."""

    def after(self, result: Record) -> Iterable[Risk]:
        """Risks of short beams, and of one-way bodies."""
        return result._model_risks()


FINITENESS, STEP_STABILITY = FinitenessCheck(), StepStabilityCheck()

#: Checks before a run.
START_CHECKS: tuple[Check, ...] = (
    TimeMapCheck(), PIVOT_LOSS, SINGULARITY, StiffeningCheck(), ShapeCheck(), StretchCheck(),
    STIFFNESS, SingularStartCheck(), CLOSURE,
)  # fmt: skip

#: Checks after a run.
RESULT_CHECKS: tuple[Check, ...] = (
    FINITENESS, TargetErrorCheck(), TrajectoryCheck(), NarrowFeatureCheck(), PullingContactCheck(),
    OutputCheck(), CLOSURE, BALANCE, QuaternionCheck(), PIVOT_LOSS, SINGULARITY, STEP_STABILITY,
    *FLEXIBILITY_CHECKS, *EXACT_BEAM_CHECKS, ModelCheck(),
)  # fmt: skip


@dataclass(frozen=True)
class PreRunFindings:
    """Findings before a run, which may be made with other tolerances.

    Attributes:
        start: of the run.
        risks: found there; only determined if they are read.
        risks_reported: whether the user is warned of them.
    """

    start: RunStart
    risks: Iterable[Risk]
    risks_reported: bool = True

    def attach_to(self, run: Trajectory) -> Trajectory:
        """Attach these findings, and those of its steps, to a run from the start."""
        risks = DeferredRisks(
            lambda: (*self.risks, *run.risks, *STIFFNESS.after_steps(self.start.model, run))
        )
        return replace(
            run, start=(self.start.q, self.start.u), risks=risks, reported_risks=self.risks_reported
        )


def check_before_run(start: RunStart) -> PreRunFindings:
    """Check a run before it starts.  Raises SceneError for a drive that jumps during the run."""
    start.model.packed_scene.time_map(start.settings.t_start, start.settings.t_end)
    risks = DeferredRisks(lambda: (risk for check in START_CHECKS for risk in check.before(start)))
    return PreRunFindings(start, risks)


def build_certificate(result: Record, error: ErrorEstimate | None) -> Certificate:
    """Build the certificate of a result; `error` is the estimate of a second run."""
    run, statistics = result.trajectory, result.statistics
    local_errors = None if statistics is None else statistics.sum_of_local_errors
    energy, *momentum = BALANCE.measured(result)
    return Certificate(
        energy=energy,
        momentum=tuple(momentum),
        quaternion_drift=run.norm_residual,
        pivot_loss=PIVOT_LOSS.measured(result),
        singularity_distance=SINGULARITY.measured(result),
        step_stability=result._step,
        later_step_stability=STEP_STABILITY.measured(result),
        stability_limited=(
            statistics is not None and statistics.stability_limited and not run.methods
        ),
        sum_of_local_errors=(
            local_errors if local_errors is not None and np.isfinite(local_errors) else None
        ),
        error=error,
        is_finite=FINITENESS.measured(result),
        message=result.message,
        step_control=step_control(run.settings, run.achieved_error),
        pivots_not_checked=len(result.model.scene.bodies) > MAX_CHECKED_BODIES,
        sample_count=len(result.t),
        flexible_bodies=MODEL_RANGE.measured(result),
        exact_beams=EXACT_RANGE.measured(result),
        spring_deflection=stiffest_spring_deflection(result),
        failures=() if result.success else (result.message,),
        achieved_error=run.achieved_error,
        loop_closure=CLOSURE.measured(result),
        risks=order_risks(risk for check in RESULT_CHECKS for risk in check.after(result)),
    )
