"""What single runs cost and how far they err: every adaptive method over its tolerances."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np

import mstmm
from mstmm.runtime.integrate.steppers import AUTO, get, names
from mstmm.runtime.result.error_measure import Coordinates

#: Relative tolerances, each with a hundredth of it as the absolute one.
TOLERANCES = tuple(10.0**-k for k in range(2, 13))
ATOL_PART = 0.01

#: Steps after which a run is given up: one that may be the cheapest, and one for the reference.
_MOST_STEPS, _MOST_FOR_REFERENCE = 40_000, 300_000

#: Runs whose distance to each other is the reference's error: method and relative tolerance.
_REFERENCES = (
    ("dop853", 1e-13), ("pirk13", 1e-13), ("dop853", 3e-12), ("rodas5p", 1e-10),
    ("kvaerno5", 1e-10), ("rodas5p", 1e-11),
)  # fmt: skip

#: A method is followed no further where it costs so many times the cheapest run that errs by less.
_HOPELESS = 20.0

#: Samples at which errors are looked at.
SAMPLES = 101


@dataclass(frozen=True)
class Reference:
    """The truth and how far it may be off."""

    numbers: np.ndarray
    error: float
    made_by: str
    measure: Coordinates


@dataclass(frozen=True)
class Single:
    """A single run: its error and the processor time of the call, the least of its repeats."""

    method: str
    rtol: float
    error: float
    cpu_s: float


def adaptive_methods() -> tuple[str, ...]:
    """All of the package that choose their steps."""
    return (*(name for name in names() if get(name).adaptive), AUTO)


def times(t_end: float) -> np.ndarray:
    """The samples of a run."""
    return np.linspace(0.0, t_end, SAMPLES)


def timed(model: mstmm.Model, t_end: float, **options: Any) -> tuple[mstmm.Result, float]:
    """A run and the processor time of its call, s."""
    grid = times(t_end)
    begin = time.process_time()
    result = model.simulate(t_end, output_times=grid, **options)
    return result, time.process_time() - begin


def single(
    model: mstmm.Model, t_end: float, method: str, rtol: float, most: int = _MOST_STEPS
) -> tuple[mstmm.Result, float] | None:
    """One run of a method at a tolerance; None where it does not reach the end in `most` steps."""
    try:
        limited = mstmm.methods.Method(method, max_steps=most)
        result, spent = timed(model, t_end, method=limited, rtol=rtol, atol=ATOL_PART * rtol)
    except mstmm.MstmmError:
        return None
    return (result, spent) if result.success else None


def reference(model: mstmm.Model, t_end: float) -> Reference | None:
    """The run that agrees best with one of another method; None where no two reach the end."""
    runs = {}
    for method, rtol in _REFERENCES:
        found = single(model, t_end, method, rtol, _MOST_FOR_REFERENCE)
        if found is not None:
            runs[method, rtol] = found[0].q
    measure = Coordinates(model)
    pairs = []
    for a, q in runs.items():
        measure.set_scales(q)
        pairs += [
            (float(measure.distance(q, other).max()), a, b)
            for b, other in runs.items()
            if a[0] != b[0]
        ]
    if not pairs:
        return None
    error, a, b = min(pairs)
    measure.set_scales(runs[a])
    return Reference(runs[a], error, f"{a[0]} {a[1]:.0e} and {b[0]} {b[1]:.0e}", measure)


def singles(
    model: mstmm.Model, t_end: float, truth: Reference, least: float, repeats: int
) -> list[Single]:
    """Every method from loose to tight, until it errs by less than `least` or is hopeless."""
    found: list[Single] = []
    for method in adaptive_methods():
        for rtol in TOLERANCES:
            made = single(model, t_end, method, rtol)
            if made is None:
                break
            error = float(truth.measure.distance(truth.numbers, made[0].q).max())
            found.append(Single(method, rtol, error, made[1]))
            better = [one.cpu_s for one in found if one.error <= max(error, least)]
            if error < least or made[1] > _HOPELESS * min(better):
                break
    return _again(model, t_end, found, repeats)


def _again(model: mstmm.Model, t_end: float, found: list[Single], repeats: int) -> list[Single]:
    """The least of several times for every run that may be the cheapest for some error."""
    better = []
    for one in found:
        rivals = [other.cpu_s for other in found if other.error <= one.error]
        spent = one.cpu_s
        if spent <= 2.0 * min(rivals) + 1e-3:
            for _ in range(repeats - 1):
                made = single(model, t_end, one.method, one.rtol)
                spent = spent if made is None else min(spent, made[1])
        better.append(Single(one.method, one.rtol, one.error, spent))
    return better
