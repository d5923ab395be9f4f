"""Map of a run's expressions of time: the times at which steps end, and the longest steps.

A method evaluates a load only at its stages.  All that can be computed of loads in advance is
therefore determined for the whole run: every time at which an expression switches (a comparison,
`sign`, `abs`, `min`, `max`, a pole), and every feature so narrow that a step could miss it.

Between the two times that enclose a pole a run makes one step without an error estimate.  That is
right where a force jumps, or grows as slowly as 1/sqrt(t), whose integral is finite.  A force that
grows like 1/t or faster causes an unbounded motion.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.expression.derivatives import Inputs, jump_message
from mstmm.numerics.piecewise_polynomial import discontinuities
from mstmm.risk import Risk

from .active_expressions import ActiveExpression, ExpressionFunctions
from .cell_subdivision import StepLimits, find_roots, step_limits

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
    breaks, limits, risks = set[float](), list[tuple[StepLimits, str]](), list[Risk]()
    poles_of_run = list[tuple[float, str]]()
    for entry in expressions:
        functions = ExpressionFunctions(entry.expression, dict(entry.constants), entry.drive)
        breaks.update(entry.expression.time_breaks())
        breaks.update(knot for name in entry.inputs for knot in inputs[name].knots)
        if entry.drive:
            knots = {knot for name in entry.inputs for knot in discontinuities(inputs[name])}
            _reject_jumps(entry, _neighbours_of_knots(sorted(knots), start, end), inputs)
        for margin in functions.margins():
            roots = find_roots(margin, start, end, functions.max_cells)
            breaks.update(roots.gaps.ravel().tolist())
            if entry.drive:
                _reject_jumps(entry, roots.gaps.tolist(), inputs)
            elif not entry.condition:
                is_pole, is_whole = find_poles(functions, roots.gaps)
                t = float(roots.gaps[np.argmax(is_pole), 0]) if is_pole.any() else None
                if t is not None and is_whole:
                    poles_of_run.append((max(t, start), _pole_message(entry)))
                elif t is not None:
                    risks.append(_pole_risk(entry, t))
            if not roots.complete:
                risks.append(_switches_risk(entry, roots.open_from))
        watched = functions.narrow_candidates()
        if watched:
            limit = step_limits(functions.terms, watched, start, end, functions.max_cells)
            limits.append((limit, entry.description))
            if not limit.complete:
                risks.append(_narrow_load_risk(entry, float(limit.longest.min())))
    starts, longest, narrowest = _combine_limits(limits)
    return TimeMap(
        _times_within_run(breaks, start, end), starts, longest, narrowest,
        min(poles_of_run, default=None), tuple(dict.fromkeys(risks)),
    )  # fmt: skip


def _reject_jumps(entry: ActiveExpression, gaps: list[tuple[float, float]], inputs: Inputs) -> None:
    """Raise SceneError if a drive jumps within one of the gaps (s, s)."""
    text = jump_message(entry.expression, gaps, inputs)
    if text:
        raise SceneError(f"{entry.description}: {_quote_expression(entry)} {text}")


def _pole_message(one: ActiveExpression) -> str:
    return (
        f"{one.description} ({_quote_expression(one)}) is unbounded there; end the run before that "
        "time, or limit it, for example by min or max"
    )


def _pole_risk(one: ActiveExpression, t: float) -> Risk:
    return Risk(
        "pole", one.description,
        f"a part of {one.description} ({_quote_expression(one)}) is unbounded at t = {t:.6g} s: "
        "the run stops there unless a factor of this part vanishes",
        "end the run before that time, or limit the part, for example by min or max",
        seen_before_run=True,
    )  # fmt: skip


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
        "switches", one.description,
        f"{one.description} ({_quote_expression(one)}) switches too often for steps to end at "
        f"every switch: some are missed from t = {since:.6g} s on",
        "give max_step, or a shorter run", seen_before_run=True,
    )  # fmt: skip


def _narrow_load_risk(one: ActiveExpression, longest: float) -> Risk:
    return Risk(
        "narrow-load", one.description,
        f"{one.description} ({_quote_expression(one)}) changes too often to be examined completely "
        f"before the run; steps are limited to {longest:.2g} s where it was not examined",
        "give max_step", seen_before_run=True,
    )  # fmt: skip


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


#: Operations that have poles.
_POLE_OPERATIONS = frozenset({"div", "pow", "tan"})

#: Distances from a pole at which the function is compared, in widths of its gap; the width is at
#: least so many spacings of floating-point numbers.
_DISTANCES, _MIN_WIDTH_SPACINGS = (1.0, 100.0, 10_000.0), 64.0

#: A function that grows by this factor from distance to distance grows like 1/t^0.9 or faster.
_MIN_POLE_GROWTH = 50**0.9


def find_poles(view: ExpressionFunctions, gaps: Array) -> tuple[NDArray[np.bool_], bool]:
    """Find the gaps (n, 2), s, that contain a pole of the expression or of a part of it.

    Returns a mask (n,), and whether the whole expression has the poles.  Only parts that depend on
    time alone are examined.
    """
    is_pole = np.zeros(len(gaps), bool)
    has_pole_operation = any(view.expression.terms[i].op in _POLE_OPERATIONS for i in view.varying)
    if not has_pole_operation or not len(gaps):
        return is_pole, False
    largest_terms = view.widest()
    for term_index in largest_terms:
        is_pole |= _has_pole(view, term_index, gaps)
    return is_pole, largest_terms == [view.expression.root]


def _has_pole(view: ExpressionFunctions, number: int, gaps: Array) -> NDArray[np.bool_]:
    is_pole = np.zeros(len(gaps), bool)
    width = np.diff(gaps, axis=1)[:, 0]
    width = np.maximum(width, _MIN_WIDTH_SPACINGS * np.spacing(np.abs(gaps).max(axis=1)))
    for edge, direction in ((gaps[:, 0], -1.0), (gaps[:, 1], 1.0)):
        near_value, middle_value, far_value = (
            np.abs(view.values(number, edge + direction * distance * width))
            for distance in _DISTANCES
        )
        is_pole |= (
            (near_value > _MIN_POLE_GROWTH * middle_value)
            & (middle_value > _MIN_POLE_GROWTH * far_value)
            & (far_value > 0)
        )
    return is_pole
