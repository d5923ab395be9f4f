"""Advice for one scene, compared with a reference and with the cheapest model."""

from __future__ import annotations

import time
from dataclasses import dataclass

import mstmm

from ..error_control.scenes import Sample
from .exhaustive_search import (
    Reference,
    Run,
    candidate_models,
    cheapest,
    compute_reference,
    reference_in_parts,
    run_once,
    run_timed,
    single_runs,
)

#: Target errors relative to the length of the scene.
TARGET_ERRORS = (1e-2, 1e-3, 1e-4)

#: Largest error of a reference relative to the smallest target.
_MAX_REFERENCE_ERROR_RATIO = 0.1


@dataclass(frozen=True)
class Outcome:
    """One scene, one target error.

    Attributes:
        error: true error of the advised model and setting against the richest model; where beams
            are split, against sixteen parts, without a cheapest model.
        estimated_error: error reported by the advice.
        cpu_s: minimum CPU time of that run.
        cheapest_sure, cheapest_sure_cpu_s: cheapest run whose tighter settings meet the target
            too, or None.
        cheapest_cpu_s: time of the cheapest run, including accidentally accurate ones.
        advised: choices and setting as text.
        covers_whole_run: whether models were compared over the whole run.
        advice_s: wall time of the advice.
        saving: time of the given scene over that of the advised one, by the advice.
    """

    scene: str
    target: float
    error: float
    estimated_error: float
    cpu_s: float
    cheapest_sure: str | None
    cheapest_sure_cpu_s: float | None
    cheapest_cpu_s: float | None
    advised: str
    covers_whole_run: bool
    advice_s: float
    saving: float | None

    @property
    def family(self) -> str:
        """The family of the scene."""
        return self.scene.rstrip("0123456789")

    @property
    def is_met(self) -> bool:
        """The true error is at most the target."""
        return self.error <= self.target

    @property
    def ratio(self) -> float | None:
        """Time in that of the cheapest sure run."""
        return None if self.cheapest_sure_cpu_s is None else self.cpu_s / self.cheapest_sure_cpu_s

    def is_within(self, factor: float, count_lucky: bool = False) -> bool | None:
        """Whether the time is at most so many times that of the cheapest; None without one."""
        cheapest_s = self.cheapest_cpu_s if count_lucky else self.cheapest_sure_cpu_s
        return None if cheapest_s is None else self.cpu_s <= factor * cheapest_s

    def text(self) -> str:
        """One line of text."""
        ratio = "" if self.ratio is None else f", {self.ratio:.2f} times {self.cheapest_sure}"
        return (
            f"{self.scene}: target {self.target:.0e}, estimate {self.estimated_error:.1e}, "
            f"true {self.error:.1e}; "
            f"{self.advised}, {1e3 * self.cpu_s:.2f} ms{ratio}; took {self.advice_s:.1f} s"
        )


def measure_advice(
    name: str, scene: mstmm.Scene, t_end: float, truth: Reference, runs: list[Run], target: float,
    rounds: int,
) -> Outcome:  # fmt: skip
    """Measure the advised run and the cheapest ones in alternating rounds."""
    start_time = time.monotonic()
    advice = mstmm.advise(scene, t_end, error=target, rounds=2)
    advice_s = time.monotonic() - start_time
    advised_model = mstmm.compile(advice.scene, engine="looped")
    advised_run = run_timed(advised_model, t_end, **advice.options)
    assert advised_run is not None
    measure, judging_reference = truth.measure, truth
    measure.register(advised_model, advice.renamed_references)
    if advice.beam_parts:
        judging_reference = (
            reference_in_parts(truth, set(advice.beam_parts.values()), t_end) or truth
        )
    error = float(measure.distance(measure.read(advised_run[0]), judging_reference.numbers).max())
    cheapest_runs = [
        None if advice.beam_parts else cheapest(runs, target, all_tighter)
        for all_tighter in (True, False)
    ]
    scenes = dict(candidate_models(truth.base))
    compiled = {
        run: mstmm.compile(scenes[run.model], engine="looped")
        for run in cheapest_runs
        if run is not None
    }
    advised_times, run_times = [advised_run[1]], {run: [run.cpu_s] for run in compiled}
    for _ in range(rounds):
        repeated = run_timed(advised_model, t_end, **advice.options)
        assert repeated is not None
        advised_times.append(repeated[1])
        for run, model in compiled.items():
            repetition = run_once(model, t_end, run.method, run.rtol)
            if repetition is not None:
                run_times[run].append(repetition[1])
    cheapest_times = [None if run is None else min(run_times[run]) for run in cheapest_runs]
    other_changes = [
        text.partition(";")[0].partition(" with a frame")[0] for text in advice.other_changes
    ]
    advised = "; ".join([*(f"{body.name}: {body.model}" for body in advice.bodies), *other_changes])
    return Outcome(
        name, target, error, advice.error, min(advised_times),
        None if cheapest_runs[0] is None else str(cheapest_runs[0]),
        cheapest_times[0], cheapest_times[1], f"{advised}; {advice.method}, {advice.setting}",
        advice.covers_whole_run, advice_s, advice.model_saving,
    )  # fmt: skip


def run_scene(task: tuple[str, Sample, int]) -> tuple[str, list[Outcome], float]:
    """A scene with its outcomes and the error of its reference; no outcomes if that is
    not sufficient."""
    name, (tables, t_end), rounds = task
    scene = mstmm.Scene(**tables)
    truth = compute_reference(scene, t_end)
    if truth is None or truth.error > _MAX_REFERENCE_ERROR_RATIO * min(TARGET_ERRORS):
        return name, [], float("inf") if truth is None else truth.error
    runs = single_runs(truth, t_end, max(TARGET_ERRORS), min(TARGET_ERRORS) / 3)
    outcomes = [
        measure_advice(name, scene, t_end, truth, runs, target, rounds) for target in TARGET_ERRORS
    ]
    return name, outcomes, truth.error
