"""Cost and error of single runs: every adaptive method over its tolerances."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np

import mstmm
from mstmm.runtime.experiments.error_measure import Coordinates
from mstmm.runtime.integrate.steppers import AUTO, get, names

#: Relative tolerances, each with a hundredth of it as the absolute one.
TOLERANCES = tuple(10.0**-k for k in range(2, 13))
ATOL_PART = 0.01

#: Step limits of candidate runs and of reference runs.
_MAX_STEPS, _MAX_REFERENCE_STEPS = 40_000, 300_000

#: Runs whose distance to each other is the reference's error: method and relative tolerance.
_REFERENCES = (
    ("dop853", 1e-13), ("pirk13", 1e-13), ("dop853", 3e-12), ("rodas5p", 1e-10),
    ("kvaerno5", 1e-10), ("rodas5p", 1e-11),
)  # fmt: skip

#: Cost ratio to the cheapest more accurate run at which a method is stopped.
_MAX_COST_RATIO = 20.0

#: Number of times at which errors are compared.
SAMPLES = 101


@dataclass(frozen=True)
class Reference:
    """Reference solution and its error."""

    numbers: np.ndarray
    error: float
    made_by: str
    measure: Coordinates


@dataclass(frozen=True)
class Run:
    """A single run: its error and minimum CPU time."""

    method: str
    rtol: float
    error: float
    cpu_s: float


def adaptive_methods() -> tuple[str, ...]:
    """Names of all adaptive methods of the package."""
    return (*(name for name in names() if get(name).adaptive), AUTO)


def sample_times(t_end: float) -> np.ndarray:
    """Output times of a run."""
    return np.linspace(0.0, t_end, SAMPLES)


def run_timed(model: mstmm.Model, t_end: float, **options: Any) -> tuple[mstmm.Result, float]:
    """A run and its CPU time, s."""
    output_times = sample_times(t_end)
    start_time = time.process_time()
    result = model.simulate(t_end, output_times=output_times, **options)
    return result, time.process_time() - start_time


def run_once(
    model: mstmm.Model, t_end: float, method: str, rtol: float, max_steps: int = _MAX_STEPS
) -> tuple[mstmm.Result, float] | None:
    """One run of a method at a tolerance; None where it does not reach the end in `max_steps`."""
    try:
        method_settings = mstmm.methods.Method(method, max_steps=max_steps)
        result, cpu_s = run_timed(
            model, t_end, method=method_settings, rtol=rtol, atol=ATOL_PART * rtol
        )
    except mstmm.MstmmError:
        return None
    return (result, cpu_s) if result.success else None


def compute_reference(model: mstmm.Model, t_end: float) -> Reference | None:
    """The run that agrees best with one of another method; None where no two reach the end."""
    runs = {}
    for method, rtol in _REFERENCES:
        run = run_once(model, t_end, method, rtol, _MAX_REFERENCE_STEPS)
        if run is not None:
            runs[method, rtol] = run[0].q
    measure = Coordinates(model)
    pairs = []
    for a, q in runs.items():
        measure.set_scales(q)
        pairs += [
            (float(measure.distance(q, other_q).max()), a, b)
            for b, other_q in runs.items()
            if a[0] != b[0]
        ]
    if not pairs:
        return None
    error, a, b = min(pairs)
    measure.set_scales(runs[a])
    return Reference(runs[a], error, f"{a[0]} {a[1]:.0e} and {b[0]} {b[1]:.0e}", measure)


def single_runs(
    model: mstmm.Model, t_end: float, reference: Reference, min_error: float, repeats: int
) -> list[Run]:
    """Runs of every method from loose to tight, up to `min_error` or to excessive cost."""
    runs: list[Run] = []
    for method in adaptive_methods():
        for rtol in TOLERANCES:
            run = run_once(model, t_end, method, rtol)
            if run is None:
                break
            error = float(reference.measure.distance(reference.numbers, run[0].q).max())
            runs.append(Run(method, rtol, error, run[1]))
            competing = [
                candidate.cpu_s for candidate in runs if candidate.error <= max(error, min_error)
            ]
            if error < min_error or run[1] > _MAX_COST_RATIO * min(competing):
                break
    return _repeat_competitive(model, t_end, runs, repeats)


def _repeat_competitive(
    model: mstmm.Model, t_end: float, runs: list[Run], repeats: int
) -> list[Run]:
    """Minimum of several times for each run that may be the cheapest for some error."""
    repeated = []
    for candidate in runs:
        cheaper = [rival.cpu_s for rival in runs if rival.error <= candidate.error]
        cpu_s = candidate.cpu_s
        if cpu_s <= 2.0 * min(cheaper) + 1e-3:
            for _ in range(repeats - 1):
                run = run_once(model, t_end, candidate.method, candidate.rtol)
                cpu_s = cpu_s if run is None else min(cpu_s, run[1])
        repeated.append(Run(candidate.method, candidate.rtol, candidate.error, cpu_s))
    return repeated
