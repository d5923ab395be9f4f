"""Runs of models within a wall-clock time limit, which has shares for the parts of the work."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import EnvironmentFailure, MstmmError, SceneError
from mstmm.risk import sentences
from mstmm.scene import Scene
from mstmm.scene.checks.flexible_bodies import short_beam_warnings

from ..platform_support.interrupts import record_interrupts
from ..result.one_way.result import OneWayResult
from .error_measure import Measure
from .run_request import Execution
from .trial import Setting, Trial
from .tuning import CHART as TUNING

if TYPE_CHECKING:
    from ..result.result import Result
    from .simulation import SimulatedScene


#: Fractions of the budget after which the reference, the settings of promising methods, and those
#: of all methods must be done; the rest is for repeated timing.
REFERENCE, EARLY, SETTINGS, ALL = 0.35, 0.6, 0.8, 1.0


class OutOfTime(BaseException):
    """A run exceeded its time limit.

    Raised in the progress callback of `simulate`, which catches every Exception; hence a
    BaseException.
    """


@dataclass
class Budget:
    """Wall-clock time limit of `seconds`, from its creation on."""

    seconds: float
    clock: Callable[[], float] = time.monotonic

    def __post_init__(self) -> None:
        self._begin = self.clock()

    @property
    def elapsed_time(self) -> float:
        """Time since the creation, s."""
        return self.clock() - self._begin

    def remaining(self, part: float = ALL) -> float:
        """Time until this fraction of the budget is spent, s, 0 or more."""
        return max(0.0, part * self.seconds - self.elapsed_time)

    def run_limit(self, part: float, waiting: int = 1) -> float:
        """Time limit of the next run, s, while `waiting` curves are not finished."""
        return self.remaining(part) / max(TUNING.min_shares, waiting / TUNING.curves_per_share)

    def alarm(self, seconds: float) -> Callable[[float, float], None]:
        """Progress callback for `simulate` that raises OutOfTime after `seconds`."""
        end = self.clock() + seconds

        def check_time(t: float, t_end: float) -> None:
            if self.clock() > end:
                raise OutOfTime

        return check_time

    def plan(self, curves: int) -> str:
        """Description of how the time is divided."""
        reference, settings = REFERENCE * self.seconds, (SETTINGS - REFERENCE) * self.seconds
        return (
            f"budget {self.seconds:g} s: up to {reference:.3g} s for the reference, then "
            f"{settings:.3g} s for the settings of {curves} curve{'s' * (curves != 1)}, the rest "
            "for repeated timing"
        )


Compile = Callable[[Scene], "SimulatedScene"]
Report = Callable[[str], None]

#: Largest number of characters of a reason.
_MAX_LENGTH = 300

#: Exceptions of a run that fails, or exceeds its time limit.
_FAILURES = (OutOfTime, MstmmError, ArithmeticError, np.linalg.LinAlgError)


class Runs:
    """Runs of models to `t_end` (s), sampled at `times` (s), within a time budget."""

    def __init__(self, t_end: float, times: Array, budget: Budget) -> None:
        self.t_end, self.times, self.budget = t_end, times, budget

    def simulate(
        self, model: SimulatedScene, options: Mapping[str, Any], limit: float,
        own_steps: bool = False,
    ) -> tuple[Result, float]:  # fmt: skip
        """Simulate a model; return the result and the CPU time of the call, s.

        `options` are keyword arguments of `simulate`; with `own_steps` the samples are the
        integration steps.  Raises OutOfTime after `limit` s of wall-clock time, KeyboardInterrupt
        after an interrupt.
        """
        times = None if own_steps else self.times
        alarm = self.budget.alarm(limit)
        with record_interrupts() as interrupted:  # short runs do not check for it
            begin = time.process_time()
            execution = Execution(progress=alarm)
            result = model.simulate(self.t_end, output_times=times, execution=execution, **options)
            if isinstance(result, OneWayResult) and result.is_comparable:
                _ = result.cost  # computes the elastic response, which is part of the CPU time
            spent = time.process_time() - begin
        if interrupted or result.status is None:
            raise KeyboardInterrupt
        return result, spent

    def try_simulate(
        self, model: SimulatedScene, options: Mapping[str, Any], limit: float,
        own_steps: bool = False,
    ) -> tuple[Result | None, str]:  # fmt: skip
        """Result of `simulate` and ""; or None and the reason of a failure, "" for lack of time."""
        try:
            return self.simulate(model, options, limit, own_steps)[0], ""
        except _FAILURES as problem:
            return None, str(problem)

    def cpu_s(
        self, model: SimulatedScene, setting: Setting, limit: float, calls: int = 1
    ) -> float | None:
        """Smallest CPU time of some calls, s; None if one of them exceeds `limit` (s)."""
        try:
            return min(self.simulate(model, setting.options, limit)[1] for _ in range(calls))
        except OutOfTime:
            return None

    def trial(
        self, model: SimulatedScene, setting: Setting, measure: Measure, limit: float
    ) -> Trial:
        """Run one setting; a failure is part of the result."""
        begin = time.process_time()

        def failed_trial(reason: str, refused: bool = False, late: bool = False) -> Trial:
            spent = time.process_time() - begin
            return Trial(setting, spent, failure=_truncate(reason), refused=refused, late=late)

        try:
            result, spent = self.simulate(model, setting.options, limit)
            if not result.is_comparable:
                return failed_trial(result.message)
            numbers = measure.read(result)
        except OutOfTime:
            return failed_trial(f"stopped at its time limit of {limit:.2g} s", late=True)
        except _FAILURES as error:
            is_refused = isinstance(error, SceneError | EnvironmentFailure)
            return failed_trial(str(error), refused=is_refused)
        if not np.isfinite(numbers).all():
            return failed_trial("its results are not all finite")
        warnings, too_coarse = _run_warnings(result)
        run = result.trajectory
        return Trial(setting, spent, run, numbers, warnings=warnings, too_coarse=too_coarse)


def scene_warnings(scene: Scene) -> tuple[str, ...]:
    """Warnings of a scene, which every run of it gives."""
    return sentences((*scene.risks, *short_beam_warnings(scene)))


def _run_warnings(result: Result) -> tuple[tuple[str, ...], bool]:
    """Warnings of a run without those of its scene, and whether its fixed step is too long."""
    try:
        warnings, step = result.warnings, result.certificate.step_stability
    except MstmmError as error:  # a quantity that is not available at any sample
        return (_truncate(str(error)),), False
    of_scene = scene_warnings(result.model.scene)
    of_run = tuple(_truncate(text) for text in warnings if text not in of_scene)
    return of_run, step is not None and step.risk is not None


def _truncate(text: str) -> str:
    line = (text.strip().splitlines() or ["no reason given"])[0]
    return line if len(line) <= _MAX_LENGTH else line[: _MAX_LENGTH - 3] + "..."
