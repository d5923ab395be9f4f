"""Checks: base class, and the start of a run that they examine."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar

import numpy as np

from mstmm.array_validation import Array
from mstmm.risk import Risk

from ...integrate.c_loop import Samples, Statistics, Status
from ...run.integration_run import split
from ...run.scene_system import SceneSystem

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene
    from ...integrate.settings import Settings
    from ...run.trajectory import Trajectory
    from ..result_record import Record

#: Number of times at which drives are evaluated.
_DRIVE_TIMES = 65

_NO_STATISTICS = Statistics(0, 0, 0, 0, None, None, None, None, 0.0, 0.0, False, 0)

Measure = TypeVar("Measure")


@dataclass(frozen=True)
class RunStart:
    """Start of a run of a model from q (nq,), u (nu,): all that is known before the first step."""

    model: CompiledScene
    settings: Settings
    q: Array
    u: Array

    @cached_property
    def state(self) -> Trajectory:
        """Start of the run as a trajectory of one sample."""
        return self._driven_states([self.settings.t_start])

    @cached_property
    def drive_path(self) -> Trajectory:
        """States over the run in which only driven coordinates move; the start without drives."""
        start, end = self.settings.t_start, self.settings.t_end
        moves = self.model.packed_scene.system.driven and end > start
        return self._driven_states(np.linspace(start, end, _DRIVE_TIMES)) if moves else self.state

    def _driven_states(self, at: Sequence[float] | Array) -> Trajectory:
        system, n, settings = SceneSystem(self.model.looped), len(at), self.settings
        start = system.start(settings.t_start, self.q, self.u)
        samples = Samples(
            np.array(at, dtype=float), np.tile(start, (n, 1)), np.tile(system.memory, (n, 1)),
            np.zeros(n, dtype=np.int64),
        )  # fmt: skip
        return split(
            system, samples, replace(settings, output_times=None), Status.FINISHED, "",
            _NO_STATISTICS, (settings.t_start, start),
        )  # fmt: skip


class Check:
    """Check for one kind of risk: before a run, from its start, or after it, from its result.

    A subclass overrides what applies; docs/howto/warnings.md lists the names of the risks.
    """

    def before(self, start: RunStart) -> Iterable[Risk]:
        """Risks that are known before the run."""
        return ()

    def after(self, result: Record) -> Iterable[Risk]:
        """Risks of the result of a run."""
        return ()


class MeasuringCheck(Check, Generic[Measure]):
    """Check with a measure of results, which `after` judges and the certificate shows."""

    @abstractmethod
    def measure(self, result: Record) -> Measure:
        """Compute the measure of a result."""

    def measured(self, result: Record) -> Measure:
        """Measure of a result, computed on first use."""
        if self not in result._measures:
            result._measures[self] = self.measure(result)
        measure: Measure = result._measures[self]
        return measure


class JudgedMeasure(Protocol):
    """Measure with the risk that it shows, if any."""

    @property
    def risk(self) -> Risk | None: ...


def risks_of(measure: JudgedMeasure | None, *, before: bool = False) -> Iterator[Risk]:
    """Risk that a measure shows, as seen before the run if `before`."""
    if measure is not None and measure.risk is not None:
        yield replace(measure.risk, seen_before_run=True) if before else measure.risk
