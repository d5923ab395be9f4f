"""`simulate(error=...)` on one scene, compared with the cheapest single run."""

from __future__ import annotations

from dataclasses import dataclass

import mstmm

from .cheapest_setting import Reference, Run, compute_reference, run_once, run_timed, single_runs
from .scenes import Sample

#: Target errors.
TARGET_ERRORS = (1e-3, 1e-5, 1e-7)

#: Largest error of a reference relative to the smallest target.
_MAX_REFERENCE_ERROR_RATIO = 0.1


@dataclass(frozen=True)
class Outcome:
    """One scene, one target error.

    Attributes:
        reports_met: whether the result reports that the target is met.
        estimate: reported error; None if unknown.
        error: true error by the reference, whose own error is `reference_error`.
        cpu_s: minimum CPU time of the call.
        cheapest, cheapest_cpu_s: cheapest single run that meets the target, or None.
        cheapest_sure_cpu_s: the same among runs whose tighter settings meet the target too.
        runs: number of runs.
        setting: final method and tolerance.
    """

    scene: str
    target: float
    reports_met: bool
    estimate: float | None
    error: float
    reference_error: float
    cpu_s: float
    cheapest: str | None
    cheapest_cpu_s: float | None
    cheapest_sure_cpu_s: float | None
    runs: int
    setting: str

    @property
    def family(self) -> str:
        """The family of the scene."""
        return self.scene.rstrip("0123456789")

    @property
    def is_estimate_valid(self) -> bool:
        """The true error is at most ten times the estimate."""
        return self.estimate is not None and self.error <= 10 * self.estimate + self.reference_error

    @property
    def is_met(self) -> bool:
        """The true error is at most three times the target."""
        return self.error <= 3 * self.target

    @property
    def ratio(self) -> float | None:
        """Time in that of the cheapest single run."""
        return None if self.cheapest_cpu_s is None else self.cpu_s / self.cheapest_cpu_s

    def is_within(self, factor: float, only_sure: bool = False) -> bool | None:
        """Whether the time is at most so many times that of the cheapest; None without one."""
        cheapest_s = self.cheapest_sure_cpu_s if only_sure else self.cheapest_cpu_s
        return None if cheapest_s is None else self.cpu_s <= factor * cheapest_s

    def text(self) -> str:
        """One line of text."""
        estimate_text = "none" if self.estimate is None else f"{self.estimate:.1e}"
        ratio = "" if self.ratio is None else f", {self.ratio:.2f} times {self.cheapest}"
        return (
            f"{self.scene}: target {self.target:.0e}, estimate {estimate_text}, "
            f"true {self.error:.1e}; "
            f"{self.setting}, {self.runs} runs, {1e3 * self.cpu_s:.2f} ms{ratio}"
        )


def measure_target_error(
    name: str, model: mstmm.Model, t_end: float, reference: Reference, runs: list[Run],
    target: float, rounds: int,
) -> Outcome:  # fmt: skip
    """Measure both in alternating rounds."""
    accurate = [run for run in runs if run.error <= target]
    cheapest = min(accurate, key=lambda run: run.cpu_s) if accurate else None
    sure_runs = [run for run in accurate if _all_tighter(run, runs, target)]
    cheapest_sure = min(sure_runs, key=lambda run: run.cpu_s) if sure_runs else None
    own_times = []
    run_times: dict[Run, list[float]] = {
        run: [] for run in (cheapest, cheapest_sure) if run is not None
    }
    for _ in range(rounds):
        result, cpu_s = run_timed(model, t_end, error=target)
        own_times.append(cpu_s)
        for run, times in run_times.items():
            repeated = run_once(model, t_end, run.method, run.rtol)
            assert repeated is not None
            times.append(repeated[1])
    achieved = result.achieved_error
    assert achieved is not None
    error = float(reference.measure.distance(reference.numbers, result.q).max())
    return Outcome(
        name, target, achieved.is_met, achieved.estimate, error, reference.error, min(own_times),
        None if cheapest is None else f"{cheapest.method} {cheapest.rtol:.0e}",
        None if cheapest is None else min(run_times[cheapest]),
        None if cheapest_sure is None else min(run_times[cheapest_sure]),
        len(achieved.runs), f"{achieved.method} {achieved.rtol:.1e}",
    )  # fmt: skip


def _all_tighter(run: Run, runs: list[Run], target: float) -> bool:
    """Whether this run and all tighter ones of its method meet the target."""
    return all(
        other.error <= target
        for other in runs
        if other.method == run.method and other.rtol <= run.rtol
    )


def run_scene(task: tuple[str, Sample, int]) -> tuple[str, list[Outcome], float]:
    """A scene with its outcomes and the error of its reference; no outcomes if that is
    not sufficient."""
    name, (tables, t_end), rounds = task
    model = mstmm.compile(mstmm.Scene(**tables), engine="looped")
    reference = compute_reference(model, t_end)
    if reference is None or reference.error > _MAX_REFERENCE_ERROR_RATIO * min(TARGET_ERRORS):
        return name, [], float("inf") if reference is None else reference.error
    runs = single_runs(model, t_end, reference, min(TARGET_ERRORS) / 10, rounds)
    outcomes = [
        measure_target_error(name, model, t_end, reference, runs, target, rounds)
        for target in TARGET_ERRORS
    ]
    return name, outcomes, reference.error
