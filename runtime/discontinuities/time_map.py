"""Map of a run's expressions of time: the times at which steps end, and the longest steps.

A method evaluates a load only at its stages.  All that can be computed of loads in advance is
therefore determined for the whole run: every time at which an expression switches (a comparison,
`sign`, `abs`, `min`, `max`, a pole), and every feature so narrow that a step could miss it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.expression.derivatives import Inputs, jump_message
from mstmm.numerics.piecewise_polynomial import discontinuities
from mstmm.risk import Risk

from .active_expressions import ActiveExpression
from .expression_functions import ExpressionFunctions
from .poles import find_poles
from .step_limits import StepLimits, step_limits
from .switching_times import find_roots

#: Fraction of the run within which two times are equal at its ends.
_TIME_ROUNDING = 1e-15
#: Maximum number of samples of a controller in a run.
_MAX_SAMPLES = 1_000_000


@dataclass(frozen=True)
class TimeMap:
    """Times at which steps end, and longest steps.

    Attributes:
        breaks: (n,) s, ascending, from the start to before the end: steps end there.
        starts, longest: (m,) s: from `starts[i]` up to the next one no step exceeds `longest[i]`.
        narrowest: name of the expression that requires the shortest steps.
        pole: the first time (s, a break) at which an effort or a load grows beyond all bounds, so
            that no motion passes, and a sentence that names it.
        notes: findings about expressions that could not be mapped completely.
    """

    breaks: Array
    starts: Array
    longest: Array
    narrowest: str = ""
    pole: tuple[float, str] | None = None
    notes: tuple[Risk, ...] = field(default=())

    def missed_feature_risk(self, step: float) -> Risk | None:
        """Finding if a fixed step (s) could miss a feature of a load, else None."""
        shortest = float(self.longest.min(initial=np.inf))
        if step <= shortest:
            return None
        time = float(self.starts[np.argmin(self.longest)])
        return Risk(
            "narrow-load", self.narrowest,
            f"the fixed step of {step:g} s is too long for {self.narrowest}, which near "
            f"t = {time:.6g} s requires steps of {shortest:.2g} s: features may be missed",
            f"use a step below {shortest:.2g} s, or omit step", step, shortest, "s",
            seen_before_run=True,
        )  # fmt: skip


def time_map(
    expressions: Iterable[ActiveExpression],
    start: float,
    end: float,
    inputs: Inputs | None = None,
    samples: Iterable[float] = (),
) -> TimeMap:
    """Build the map of all expressions for a run from `start` to `end` (s).

    `inputs` are the inputs that expressions may name; their knots are breaks, as are the multiples
    of the sample times `samples` (s).  Raises SceneError for a drive that jumps during the run.
    """
    if not end > start:
        return TimeMap(np.zeros(0), np.zeros(0), np.zeros(0))
    unique_entries = {
        (entry.expression, entry.constants, entry.drive): entry
        for entry in reversed(list(expressions))
    }
    with np.errstate(all="ignore"):
        mapped = _map_expressions(list(reversed(unique_entries.values())), start, end, inputs or {})
    multiples = [_multiples(sample_time, start, end) for sample_time in samples]
    if not multiples:
        return mapped
    breaks = _times_within_run(
        {*mapped.breaks.tolist(), *np.concatenate(multiples).tolist()}, start, end
    )
    return replace(mapped, breaks=breaks)


def _multiples(step: float, start: float, end: float) -> Array:
    """All integer multiples of a step (s) from `start` to `end` (s)."""
    count = (end - start) / step
    if count > _MAX_SAMPLES:
        raise SceneError(
            f"a controller with sample_time = {step:g} s acts {count:.0f} times from t = {start:g} "
            f"to {end:g} s; a run allows at most {_MAX_SAMPLES} samples: split the run"
        )
    first, last = math.floor(start / step), math.ceil(end / step)
    return np.asarray(np.arange(first, last + 1) * step)


def _map_expressions(
    expressions: list[ActiveExpression], start: float, end: float, inputs: Inputs
) -> TimeMap:
    breaks, limits, findings = set[float](), list[tuple[StepLimits, str]](), list[Risk]()
    poles_of_run = list[tuple[float, str]]()
    for entry in expressions:
        functions = ExpressionFunctions(entry.expression, dict(entry.constants), entry.drive)
        breaks.update(entry.expression.time_breaks())
        breaks.update(knot for name in entry.inputs for knot in inputs[name].knots)
        if entry.drive:
            knots = sorted(
                {knot for name in entry.inputs for knot in discontinuities(inputs[name])}
            )
            jump_text = jump_message(
                entry.expression, _neighbours_of_knots(knots, start, end), inputs
            )
            if jump_text:
                raise SceneError(f"{entry.description}: {_quote_expression(entry)} {jump_text}")
        is_force = not (entry.drive or entry.condition)
        for margin in functions.margins():
            roots_found = find_roots(margin, start, end, functions.max_cells)
            breaks.update(roots_found.gaps.ravel().tolist())
            jump_text = (
                jump_message(entry.expression, roots_found.gaps.tolist(), inputs)
                if entry.drive
                else ""
            )
            if jump_text:
                raise SceneError(f"{entry.description}: {_quote_expression(entry)} {jump_text}")
            is_pole, is_whole = (
                find_poles(functions, roots_found.gaps)
                if is_force
                else (roots_found.gaps[:0, 0] > 0, False)
            )
            if is_pole.any():
                pole_time = float(roots_found.gaps[np.argmax(is_pole), 0])
                if is_whole:
                    poles_of_run.append((max(pole_time, start), _pole_message(entry)))
                else:
                    findings.append(_pole_risk(entry, pole_time))
            if not roots_found.complete:
                findings.append(_switches_risk(entry, roots_found.open_from))
        watched_functions = functions.narrow_candidates()
        if watched_functions:
            limits.append(
                (
                    step_limits(
                        functions.terms, watched_functions, start, end, functions.max_cells
                    ),
                    entry.description,
                )
            )
            if not limits[-1][0].complete:
                findings.append(_narrow_load_risk(entry, float(limits[-1][0].longest.min())))
    starts, longest, narrowest = _combine_limits(limits)
    return TimeMap(
        _times_within_run(breaks, start, end),
        starts,
        longest,
        narrowest,
        min(poles_of_run, default=None),
        tuple(dict.fromkeys(findings)),
    )


def _pole_message(one: ActiveExpression) -> str:
    return (
        f"{one.description} ({_quote_expression(one)}) is unbounded there; end the run before that "
        "time, or limit it, for example by min or max"
    )


def _pole_risk(one: ActiveExpression, t: float) -> Risk:
    return Risk(
        "pole",
        one.description,
        f"a part of {one.description} ({_quote_expression(one)}) is unbounded at t = {t:.6g} s: "
        "the run stops there unless a factor of this part vanishes",
        "end the run before that time, or limit the part, for example by min or max",
        seen_before_run=True,
    )


def _neighbours_of_knots(knots: list[float], start: float, end: float) -> list[tuple[float, float]]:
    """Floating-point numbers before and after each knot within the run."""
    inner_knots = [knot for knot in knots if start < knot < end]
    return [(math.nextafter(t, -math.inf), math.nextafter(t, math.inf)) for t in inner_knots]


def _times_within_run(times: set[float], start: float, end: float) -> Array:
    """Times within the run, ascending; times that equal the start up to rounding become it."""
    at_start, at_end = start + _TIME_ROUNDING * (end - start), end - _TIME_ROUNDING * (end - start)
    earliest = start - _TIME_ROUNDING * (end - start)
    breaks_found = {start if t <= at_start else t for t in times if earliest <= t < at_end}
    return np.array(sorted(breaks_found))


def _switches_risk(one: ActiveExpression, since: float) -> Risk:
    return Risk(
        "switches",
        one.description,
        f"{one.description} ({_quote_expression(one)}) switches too often for steps to end at "
        f"every switch: some are missed from t = {since:.6g} s on",
        "give max_step, or a shorter run",
        seen_before_run=True,
    )


def _narrow_load_risk(one: ActiveExpression, longest: float) -> Risk:
    return Risk(
        "narrow-load",
        one.description,
        f"{one.description} ({_quote_expression(one)}) changes too often to be examined completely "
        f"before the run; steps are limited to {longest:.2g} s where it was not examined",
        "give max_step",
        seen_before_run=True,
    )


def _quote_expression(one: ActiveExpression) -> str:
    text = one.expression.text
    return repr(text if len(text) <= 60 else text[:57] + "...")


def _combine_limits(paces: list[tuple[StepLimits, str]]) -> tuple[Array, Array, str]:
    """Combine all step limits; also the name of the expression with the shortest limit."""
    finite_limits = [(limit, owner) for limit, owner in paces if np.isfinite(limit.longest).any()]
    if not finite_limits:
        return np.zeros(0), np.zeros(0), ""
    starts = np.unique(np.concatenate([limit.starts for limit, _ in finite_limits]))
    limits_by_start = [
        limit.longest[np.searchsorted(limit.starts, starts, side="right") - 1]
        for limit, _ in finite_limits
    ]
    narrowest = min(finite_limits, key=lambda pair: float(pair[0].longest.min()))[1]
    return starts, np.minimum.reduce(limits_by_start), narrowest


__all__ = ["TimeMap", "time_map"]
