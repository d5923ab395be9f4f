"""Run of a chart: measured values and CPU time, or the reason why it failed."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import EnvironmentFailure, MstmmError, SceneError
from mstmm.risk import sentences
from mstmm.scene import Scene
from mstmm.scene.checks.flexible_bodies import short_beam_warnings

from ..integrate.c_loop import Status
from ..model.execution import Execution
from ..platform_support.interrupts import record_interrupts
from ..result.error_measure import Measure
from ..result.one_way.result import OneWayResult
from ..run import external_integrators
from .chart_points import Setting
from .time_budget import Budget, OutOfTime

if TYPE_CHECKING:
    from ..integrate.c_loop import Statistics
    from ..model.model import Model
    from ..result.result import Result

#: Largest relative difference of the end times of runs that an event ends.
_END_TOLERANCE = 0.01

#: Largest number of characters of a reason.
_MAX_LENGTH = 300


@dataclass(frozen=True)
class Trial:
    """Result of a run of one setting.

    Attributes:
        setting: method, model level and tolerance or step.
        cpu_s: CPU time of the call of `simulate`, s.
        t: (n,) times of the samples that were reached, s.
        q: (n, nq) coordinates at these times.
        numbers: (n, k) values of the error measure at these times; None if the run failed.
        statistics: counts of evaluations and steps.
        ended: event that ended the run, and when; "" if none did.
        warnings: warnings of the run, without those of the scene.
        too_coarse: the fixed step is too long for the motion; see `run.step_stability`.
        failure: reason why there are no numbers.
        refused: the scene or the machine does not support the method.
        late: the run exceeded its time limit.
    """

    setting: Setting
    cpu_s: float
    t: Array = field(default_factory=lambda: np.zeros(0))
    q: Array = field(default_factory=lambda: np.zeros((0, 0)))
    numbers: Array | None = None
    statistics: Statistics | None = None
    ended: str = ""
    warnings: tuple[str, ...] = ()
    too_coarse: bool = False
    failure: str = ""
    refused: bool = False
    late: bool = False


class Runs:
    """Runs of models to `t_end` (s), sampled at `times` (s), within a time budget."""

    def __init__(self, t_end: float, times: Array, budget: Budget) -> None:
        self.t_end, self.times, self.budget = t_end, times, budget

    def steps(self, model: Model, setting: Setting, limit: float) -> Array:
        """Times (n,) of the integration steps of a run, s; empty if it fails."""
        try:
            result, _ = self.simulate(model, setting, limit, own_steps=True)
        except (OutOfTime, MstmmError, ArithmeticError, np.linalg.LinAlgError):
            return np.zeros(0)
        return result.t if result.is_comparable else np.zeros(0)

    def simulate(
        self, model: Model, setting: Setting, limit: float, own_steps: bool = False
    ) -> tuple[Result, float]:
        """Simulate a model; return the result and the CPU time of the call, s.

        With `own_steps` the samples are the integration steps.  Raises OutOfTime after `limit` s of
        wall-clock time, KeyboardInterrupt after an interrupt.
        """
        return self.simulate_with(model, setting.options, limit, own_steps)

    def simulate_with(
        self, model: Model, options: Mapping[str, Any], limit: float, own_steps: bool = False
    ) -> tuple[Result, float]:
        """Simulate with any keyword arguments of `simulate`; otherwise as `simulate` above."""
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

    def trial(self, model: Model, setting: Setting, measure: Measure, limit: float) -> Trial:
        """Run one setting; a failure is part of the result."""
        begin = time.process_time()

        def failed_trial(reason: str, refused: bool = False, late: bool = False) -> Trial:
            spent = time.process_time() - begin
            return Trial(setting, spent, failure=_truncate(reason), refused=refused, late=late)

        try:
            result, spent = self.simulate(model, setting, limit)
            if not result.is_comparable:
                return failed_trial(result.message)
            numbers = measure.read(result)
        except OutOfTime:
            return failed_trial(f"stopped at its time limit of {limit:.2g} s", late=True)
        except (SceneError, EnvironmentFailure) as error:
            return failed_trial(str(error), refused=True)
        except (MstmmError, ArithmeticError, np.linalg.LinAlgError) as error:
            return failed_trial(str(error))
        if not np.isfinite(numbers).all():
            return failed_trial("its results are not all finite")
        warnings, too_coarse = _run_warnings(result)
        ended = "" if result.status is Status.FINISHED else result.message
        return Trial(
            setting, spent, result.t, result.q, numbers, result.statistics, ended, warnings,
            too_coarse,
        )  # fmt: skip


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


def factorization_count(setting: Setting, statistics: Statistics | None) -> int | None:
    """Number of factorised tangent matrices; None for external integrators."""
    if statistics is None or setting.method in external_integrators.METHODS:
        return None
    return statistics.tangents


def max_error(trial: Trial, reference: Trial, measure: Measure) -> float | str:
    """Largest error over the common samples, or the reason why there is none.

    Runs that an event ends may differ by one sample, or by `_END_TOLERANCE` of their time.
    """
    assert trial.numbers is not None and reference.numbers is not None
    n = min(len(trial.t), len(reference.t))
    if not n or (
        abs(len(trial.t) - len(reference.t)) > 1
        and abs(trial.t[-1] - reference.t[-1]) > _END_TOLERANCE * reference.t[-1]
    ):
        ends = [f"{run.t[-1]:.6g} s" if len(run.t) else "the start" for run in (trial, reference)]
        return f"the run ended at {ends[0]}, the reference at {ends[1]}"
    return float(measure.distance(trial.numbers[:n], reference.numbers[:n]).max())


def _truncate(text: str) -> str:
    line = (text.strip().splitlines() or ["no reason given"])[0]
    return line if len(line) <= _MAX_LENGTH else line[: _MAX_LENGTH - 3] + "..."
