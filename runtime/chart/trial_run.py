"""One run of a chart: what it gave, what it cost, or why it gave nothing."""

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

#: Runs that an event ends part by at most this part of their time.
_APART = 0.01

#: Longest sentence of a reason.
_LONGEST = 300


@dataclass(frozen=True)
class Trial:
    """A setting that was run.

    Attributes:
        setting: which.
        cpu_s: processor time of the call of `simulate`, s.
        t: (n,) samples that were reached, s.
        q: (n, nq) coordinates there.
        numbers: (n, k) of the measure there; None where there are none.
        statistics: counts.
        ended: which event ended the run, and when; "" where none did.
        warnings: what the run itself warns of, apart from what the scene does.
        too_coarse: its fixed step is longer than the motion needs; see `run.stability`.
        failure: why there are no numbers.
        refused: the scene or the machine does not allow the method.
        late: it was ended because it took too long.
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
    """Makes runs of models to `t_end` (s), sampled at `times` (s)."""

    def __init__(self, t_end: float, times: Array, budget: Budget) -> None:
        self.t_end, self.times, self.budget = t_end, times, budget

    def steps(self, model: Model, setting: Setting, limit: float) -> Array:
        """Times (n,) of the steps that a run takes, s, up to its end; none where it fails."""
        try:
            result, _ = self.simulate(model, setting, limit, own_steps=True)
        except (OutOfTime, MstmmError, ArithmeticError, np.linalg.LinAlgError):
            return np.zeros(0)
        return result.t if result.is_comparable else np.zeros(0)

    def simulate(
        self, model: Model, setting: Setting, limit: float, own_steps: bool = False
    ) -> tuple[Result, float]:
        """The result and the processor time of the call, s; sampled at every step if asked.

        OutOfTime after `limit` s of the clock, KeyboardInterrupt after an interrupt.
        """
        return self.called(model, setting.options, limit, own_steps)

    def called(
        self, model: Model, options: Mapping[str, Any], limit: float, own_steps: bool = False
    ) -> tuple[Result, float]:
        """The same with any arguments of `simulate`."""
        times = None if own_steps else self.times
        alarm = self.budget.alarm(limit)
        with record_interrupts() as interrupted:  # short runs end before they look at it
            begin = time.process_time()
            result = model.simulate(self.t_end, output_times=times, progress=alarm, **options)
            if isinstance(result, OneWayResult) and result.is_comparable:
                _ = result.cost  # makes the elastic response, which is part of what it is for
            spent = time.process_time() - begin
        if interrupted or result.status is None:
            raise KeyboardInterrupt
        return result, spent

    def trial(self, model: Model, setting: Setting, measure: Measure, limit: float) -> Trial:
        """One run, whatever becomes of it."""
        begin = time.process_time()

        def without(why: str, refused: bool = False, late: bool = False) -> Trial:
            spent = time.process_time() - begin
            why = _short(why)
            return Trial(setting, spent, failure=why, refused=refused, late=late)

        try:
            result, spent = self.simulate(model, setting, limit)
            if not result.is_comparable:
                return without(result.message)
            numbers = measure.read(result)
        except OutOfTime:
            return without(f"ended after {limit:.2g} s of the clock", late=True)
        except (SceneError, EnvironmentFailure) as error:
            return without(str(error), refused=True)
        except (MstmmError, ArithmeticError, np.linalg.LinAlgError) as error:
            return without(str(error))
        if not np.isfinite(numbers).all():
            return without("not all of its numbers are finite")
        warnings, too_coarse = _told(result)
        ended = "" if result.status is Status.FINISHED else result.message
        return Trial(
            setting, spent, result.t, result.q, numbers, result.statistics, ended, warnings,
            too_coarse,
        )  # fmt: skip


def warnings_of(scene: Scene) -> tuple[str, ...]:
    """What is warned of in every run of a scene, whatever the method."""
    return sentences((*scene.risks, *short_beam_warnings(scene)))


def _told(result: Result) -> tuple[tuple[str, ...], bool]:
    """What a run warns of beyond what its scene does, and whether its step is too long."""
    try:
        found, step = result.warnings, result.certificate.step
    except MstmmError as error:  # quantities that no sample gives
        return (_short(str(error)),), False
    scene = warnings_of(result.model.scene)
    own = tuple(_short(text) for text in found if text not in scene)
    return own, step is not None and step.risk is not None


def factorizations(setting: Setting, statistics: Statistics | None) -> int | None:
    """How many tangents a run factored; None where the integrator of others does not tell."""
    if statistics is None or setting.method in external_integrators.METHODS:
        return None
    return statistics.tangents


def error_of(trial: Trial, reference: Trial, measure: Measure) -> float | str:
    """Largest error over the samples that both reached, or why there is none.

    Runs that an event stops may part by a sample, or by a hundredth of their time.
    """
    assert trial.numbers is not None and reference.numbers is not None
    n = min(len(trial.t), len(reference.t))
    if not n or (
        abs(len(trial.t) - len(reference.t)) > 1
        and abs(trial.t[-1] - reference.t[-1]) > _APART * reference.t[-1]
    ):
        at = [f"{run.t[-1]:.6g} s" if len(run.t) else "the start" for run in (trial, reference)]
        return f"it ended at {at[0]}, the reference at {at[1]}"
    return float(measure.apart(trial.numbers[:n], reference.numbers[:n]).max())


def _short(text: str) -> str:
    line = (text.strip().splitlines() or ["no reason given"])[0]
    return line if len(line) <= _LONGEST else line[: _LONGEST - 3] + "..."
