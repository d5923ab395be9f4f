"""Trial: a run of one setting with its measured values, and the distance of two trials."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.array_validation import Array

from ..integrate.c_loop import Status

if TYPE_CHECKING:
    from ..run.trajectory import Trajectory
    from .error_measure import Measure

#: Largest relative difference of the end times of runs that an event ends.
_END_TOLERANCE = 0.01

#: Absolute tolerance as a fraction of the relative one.
ATOL_FRACTION = 0.01


@dataclass(frozen=True)
class Setting:
    """Method, model level and accuracy setting of a run.

    `value` is the fixed step in s if `fixed`, else the relative tolerance.
    """

    method: str
    model: str
    value: float
    fixed: bool = False

    @property
    def options(self) -> dict[str, Any]:
        """Keyword arguments of `simulate`."""
        if self.fixed:
            return {"method": self.method, "step": self.value}
        return {"method": self.method, "rtol": self.value, "atol": ATOL_FRACTION * self.value}

    @property
    def numbers(self) -> dict[str, float]:
        """Numerical options: {"step": s}, or {"rtol": ..., "atol": ...}."""
        return {name: value for name, value in self.options.items() if name != "method"}

    def __str__(self) -> str:
        return f"step {self.value:.3g} s" if self.fixed else f"rtol {self.value:.0e}"


@dataclass(frozen=True)
class Trial:
    """Result of a run of one setting.

    Attributes:
        setting: method, model level and tolerance or step.
        cpu_s: CPU time of the run, s.
        run: states at the samples that were reached; None if there are none.
        numbers: (n, k) values of the error measure at these samples; None if the run failed.
        failure: reason why there are no numbers.
        warnings: warnings of the run, without those of the scene.
        too_coarse: the fixed step is too long for the motion; see `run.step_stability`.
        refused: the scene or the machine does not support the method.
        late: the run exceeded its time limit.
    """

    setting: Setting
    cpu_s: float
    run: Trajectory | None = None
    numbers: Array | None = None
    failure: str = ""
    warnings: tuple[str, ...] = ()
    too_coarse: bool = False
    refused: bool = False
    late: bool = False

    @property
    def trajectory(self) -> Trajectory:
        """States of a trial that has some."""
        assert self.run is not None
        return self.run

    @property
    def values(self) -> Array:
        """Measured values (n, k) of a trial that did not fail."""
        assert self.numbers is not None
        return self.numbers

    @property
    def ended(self) -> str:
        """Event that ended the run, and when; "" if none did."""
        run = self.trajectory
        return "" if run.status is Status.FINISHED else run.message


def sample_distances(
    trial: Trial, reference: Trial, measure: Measure, end_tolerance: float = 0.0
) -> Array:
    """Distances (n,) of two trials at their common samples; empty if they end at other times.

    Runs that an event ends may differ by one sample, or by `end_tolerance` of their time.
    """
    n, other = len(trial.values), len(reference.values)
    count = min(n, other)
    if not count:
        return np.zeros(0)
    if abs(n - other) > 1:
        end, other_end = trial.trajectory.t[-1], reference.trajectory.t[-1]
        if not end_tolerance or abs(end - other_end) > end_tolerance * other_end:
            return np.zeros(0)
    return measure.distance(trial.values[:count], reference.values[:count])


def max_error(trial: Trial, reference: Trial, measure: Measure) -> tuple[float, str]:
    """Largest error at the common samples and ""; or infinity and why there is none."""
    distances = sample_distances(trial, reference, measure, _END_TOLERANCE)
    if len(distances):
        return float(distances.max()), ""
    times = [x.trajectory.t for x in (trial, reference)]
    ends = [f"{t[-1]:.6g} s" if len(t) else "the start" for t in times]
    return np.inf, f"the run ended at {ends[0]}, the reference at {ends[1]}"
