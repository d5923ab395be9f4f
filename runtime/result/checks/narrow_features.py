"""Detection of narrow features that the steps of a run missed.

A force that is narrow in a coordinate is evaluated at the stages of steps only: long steps pass
over it, and every estimated error is zero. After a run its path is known, and so is the width of a
function of a coordinate along it (`step_limits`, with the coordinate in place of time): a step
longer than this width, across a peak of the function that neither of its ends shows, has missed it.
Functions of speeds, several coordinates, or the length of a spring are examined along the run's
time instead. If samples are output times, the steps are not known; if one may have passed over a
feature, the run is repeated once to record them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import chain, islice
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.expression.expression import Expression, Name
from mstmm.risk import Risk

from ...discontinuities.active_expressions import (
    ActiveExpression,
    ExpressionFunctions,
    active_expressions,
    examined_hinges,
)
from ...discontinuities.cell_subdivision import (
    CELLS_PER_STEP,
    StepLimits,
    WatchedFunction,
    step_limits,
)
from ...discontinuities.interval_enclosures import TIME, Enclosure, Interval
from ...run.run_execution import RunMonitor, first_run
from ..expression_variables import RunStates, SampledVariable, make_enclosures, sampled_variables
from .check import Check

if TYPE_CHECKING:
    from mstmm.scene import Hinge

    from ...engine.compiled_scene import CompiledScene
    from ...run.trajectory import Trajectory
    from ..result_record import Record

#: Least height of a peak, relative to the range of the function.
_MIN_PEAK_RATIO = 0.1

#: Largest numbers of points in a narrow part of a function, and of its peaks.
_MAX_POINTS, _MAX_PEAKS = 512, 200

#: Largest number of steps for which a run is repeated to record all of them.
_MAX_RERUN_STEPS = 20_000

#: Largest number of pairs of expression and coordinate that are examined.
_MAX_EXPRESSIONS = 100

#: Adaptive steps that missed a feature along time are longer than it by at least this factor: the
#: bounds on the joint effect of speeds and several coordinates are narrower than the feature.
_TIME_STEP_FACTOR = 3.0

#: A peak along time counts from this part of the function's range around the motion.
_MIN_RANGE_RATIO = 1e-9

#: Largest numbers of steps examined together over time, and of their cells.
_STEPS_PER_PIECE, _MAX_CELLS_PER_PIECE = 2**12, 2**15


@dataclass(frozen=True)
class _SampledPath:
    """Coordinate, or time, along a run.

    Its values (n,) at the start, the samples and the end; between two of them the smallest and the
    largest, and the largest distance of a step, (n - 1,); its unit. `ranges` are the ranges of
    functions of time over the whole run, by term: such functions are known between neighbours of
    `positions` only.
    """

    positions: Array
    minima: Array
    maxima: Array
    step_distances: Array
    unit: str
    ranges: Mapping[int, float] = field(default_factory=dict)


class NarrowFeatureCheck(Check):
    """Narrow features of forces that the steps of a run missed."""

    def after(self, result: Record) -> Iterable[Risk]:
        """Risks of expressions with such features."""
        return missed_feature_risks(result.model, result.trajectory)


def missed_feature_risks(model: CompiledScene, run: Trajectory) -> tuple[Risk, ...]:
    """Findings about expressions with narrow features that steps missed."""
    risks = _risks_of_steps(model, run)
    if run.settings.output_times is None or run.settings.step is not None:
        return risks
    if not risks and not _may_hide_features(model, run):
        return ()
    rerun = _rerun_with_all_steps(model, run)
    return () if rerun is None else _risks_of_steps(model, rerun)


def _risks_of_steps(model: CompiledScene, run: Trajectory) -> tuple[Risk, ...]:
    """Findings for known steps; between output times, for the longest step of the run."""
    risks = dict[str, Risk]()
    candidates = chain(_coordinate_candidates(model, run), _time_candidates(model, run))
    for subject, view, path in islice(candidates, _MAX_EXPRESSIONS):
        # samples may be the ends of adaptive steps, which shorten at detected features
        ends_are_steps = run.settings.output_times is None and run.settings.step is None
        peak = _first_missed_peak(view, path, ends_are_steps)
        if peak is not None:
            risks.setdefault(subject, _risk(subject, view.variable, path, *peak))
    return tuple(risks.values())


def _rerun_with_all_steps(model: CompiledScene, run: Trajectory) -> Trajectory | None:
    """Repeat the run with all its steps as samples, as far as it came.

    None if that takes too long, or does not reach the same end.
    """
    if run.statistics.steps > _MAX_RERUN_STEPS:
        return None
    _, q, u = run.first
    t_end = run.settings.t_end if run.last_state is None else run.last_state[0]
    settings = replace(run.settings, t_end=t_end, output_times=None)
    rerun = first_run(model, settings, q, u, RunMonitor(None, settings))
    return replace(rerun, start=(q, u)) if rerun.is_comparable else None


def _risk(
    what: str, name: str, path: _SampledPath, position: float, step_distance: float, longest: float
) -> Risk:
    remedy = f"use max_step = {longest:.1g} or less"
    if not path.ranges:
        remedy = (
            f"write it as where({name} > a, where({name} < b, ..., 0), 0), with a and b close "
            "around the feature, so that steps end there, or give max_step"
        )
    return Risk(
        "narrow-load", what,
        f"{what} has a feature near {name} = {position:.6g}, narrower than {longest:.2g}, that was "
        f"missed by steps of up to {step_distance:.2g} there",
        remedy, step_distance, longest, path.unit,
    )  # fmt: skip


# --- names and paths ------------------------------------------------------------------------------


def _coordinate_candidates(
    model: CompiledScene, run: Trajectory
) -> Iterator[tuple[str, ExpressionFunctions, _SampledPath]]:
    """Active expressions of coordinates, as functions of one of them, with its path.

    Each with its description.
    """
    fractions = _step_fractions(run)
    if fractions is None:
        return
    for load in active_expressions(model.scene):
        if load.condition or load.spring is not None or load.expression.depends_on_time_only:
            continue
        constants = dict(load.constants)
        for hinge in examined_hinges(load, model.scene.hinges):
            for name in load.expression.names:
                path = _coordinate_path(model, run, fractions, name, hinge)
                if path is not None:
                    view = ExpressionFunctions(load.expression, constants, names=(name.text,))
                    yield load.description, view, path


def _time_candidates(
    model: CompiledScene, run: Trajectory
) -> Iterator[tuple[str, ExpressionFunctions, _SampledPath]]:
    """Active expressions of speeds, several names or a length, as functions of time.

    Long runs are divided into pieces.
    """
    states = _distinct_states(run)
    if states is None:
        return
    max_step = _max_step(run)
    for load, hinge, constants, names in _multi_variable_loads(model):
        motion = sampled_variables(model, states, load, hinge)
        if motion is not None:
            order = (TIME, *(name for name in names if name != TIME))
            whole_view = ExpressionFunctions(
                load.expression, constants, False, order, make_enclosures(states.t, motion, names)
            )
            ranges = _function_ranges(whole_view, states.t, {name: motion[name] for name in names})
            for first in range(0, len(states.t) - 1, _STEPS_PER_PIECE):
                t = states.t[first : first + _STEPS_PER_PIECE + 1]
                piece = {
                    name: SampledVariable(x.values[first : first + _STEPS_PER_PIECE + 1],
                                 x.rates[first : first + _STEPS_PER_PIECE + 1])
                    for name, x in motion.items()
                }  # fmt: skip
                path = _SampledPath(t, t[:-1], t[1:], np.minimum(np.diff(t), max_step), "s", ranges)
                view = ExpressionFunctions(
                    load.expression, constants, False, order, make_enclosures(t, piece, names)
                )
                yield load.description, view, path


def _peaked_terms(view: ExpressionFunctions) -> list[WatchedFunction]:
    """Terms that may have peaks; an angle only jumps, at half a turn."""
    terms = view.expression.terms
    return [watched for watched in view.narrow_candidates() if terms[watched.term].op != "atan2"]


def _function_ranges(
    view: ExpressionFunctions, t: Array, known: Mapping[str, SampledVariable]
) -> dict[int, float]:
    """Ranges of functions of an expression by term, at the times t (n,).

    Including a small part of the range around the motion.
    """
    result = dict[int, float]()
    enclosures = _enclosures_around(view.expression, view.constants, known)
    for term in {view.expression.root, *(watched.term for watched in _peaked_terms(view))}:
        values, width = view.values(term, t), enclosures[term].value.width
        finite = values[np.isfinite(values)]
        result[term] = float(np.ptp(finite)) if len(finite) else 0.0
        if np.isfinite(width).all():
            result[term] = max(result[term], _MIN_RANGE_RATIO * float(width.max()))
    return result


def _enclosures_around(
    expression: Expression, constants: Mapping[str, float], known: Mapping[str, SampledVariable]
) -> dict[int, Enclosure]:
    """Bounds of all terms of an expression around a motion."""
    box = {name: _padded_enclosure(course) for name, course in known.items()}
    view = ExpressionFunctions(expression, constants, names=(TIME, *known), leaves=lambda _: box)
    return view.terms(Interval(np.zeros(1), np.zeros(1)))


def _multi_variable_loads(
    model: CompiledScene,
) -> Iterator[tuple[ActiveExpression, Hinge | None, dict[str, float], list[str]]]:
    """Loads and efforts with possible narrow peaks that are no functions of one coordinate.

    They depend on a speed, on a spring, or on several state variables.  Each comes with its hinge,
    constants and names of variables.
    """
    for load in active_expressions(model.scene):
        if load.condition or load.drive or load.expression.depends_on_time_only:
            continue
        for hinge in islice(examined_hinges(load, model.scene.hinges), _MAX_EXPRESSIONS):
            constants = dict(load.constants) | ({} if hinge is None else dict(hinge.parameters))
            names = [n.text for n in load.expression.names if n.text not in constants]
            is_single = len(names) == 1 and load.spring is None
            coordinate = is_single and load.expression.names[0].quantity == "q"
            if not coordinate and _peaked_terms(
                ExpressionFunctions(load.expression, constants, names=names or [TIME])
            ):
                yield load, hinge, constants, names


def _may_hide_features(model: CompiledScene, run: Trajectory) -> bool:
    """Whether functions of speeds or several names may be narrow enough to hide between samples."""
    states, max_step = _distinct_states(run), _max_step(run)
    if states is None or np.diff(states.t).max() <= 2 * max_step:
        return False
    for load, hinge, constants, names in _multi_variable_loads(model):
        motion = sampled_variables(model, states, load, hinge)
        if motion is None:
            continue
        terms = _enclosures_around(load.expression, constants, motion)
        for watched in _peaked_terms(ExpressionFunctions(load.expression, constants, names=names)):
            enclosure = terms[watched.term]
            slope = np.maximum(np.abs(enclosure.slope.lo), np.abs(enclosure.slope.hi))
            if not (slope * max_step <= 2 * enclosure.value.width).all():
                return True
    return False


def _padded_enclosure(course: SampledVariable) -> Enclosure:
    """Bounds of all values and rates of a variable along a run, widened by half."""
    bounds = []
    for x in (course.values, course.rates):
        margin = 0.25 * np.ptp(x)
        bounds.append(Interval(np.array([x.min() - margin]), np.array([x.max() + margin])))
    return Enclosure(*bounds)


def _distinct_states(run: Trajectory) -> RunStates | None:
    """States of a run at distinct times, the last of each; None for fewer than two."""
    t, q, u = _all_states(run)
    memory = run.memory
    if run.start is not None and run.last_state is not None and len(memory):
        memory = np.concatenate([memory[:1], memory, memory[-1:]])
    if len(t) < 2 or len(memory) != len(t) or not (np.isfinite(q).all() and np.isfinite(u).all()):
        return None
    last = np.append(np.diff(t) > 0, True)
    return RunStates(t[last], q[last], u[last], memory[last]) if last.sum() > 1 else None


def _max_step(run: Trajectory) -> float:
    """Upper bound of the steps between two samples, s."""
    settings = run.settings
    if settings.output_times is None:
        return np.inf
    max_step = settings.step if settings.step is not None else run.statistics.largest_step
    return np.inf if max_step is None else max_step


def _all_states(run: Trajectory) -> tuple[Array, Array, Array]:
    """Times, coordinates and speeds (t, q, u) at the start, the samples and the end."""
    t, q, u = run.t, run.q, run.u
    if run.start is not None and run.last_state is not None:
        (end, *last), first = run.last_state, (run.settings.t_start, *run.start)
        rows = zip(first, (t, q, u), (end, *last), strict=True)
        t, q, u = (np.concatenate([np.asarray(a)[None], x, np.asarray(b)[None]])
                   for a, x, b in rows)  # fmt: skip
    return t, q, u


def _step_fractions(run: Trajectory) -> Array | None:
    """Largest part of the interval between two states that one step covers; None without any."""
    t, q, _ = _all_states(run)
    if len(t) < 2 or not np.isfinite(q).all():
        return None
    intervals, max_step = np.diff(t), _max_step(run)
    return np.divide(max_step, intervals, out=np.ones(len(intervals)), where=intervals > max_step)


def _coordinate_path(
    model: CompiledScene, run: Trajectory, parts: Array, name: Name, own: Hinge | None
) -> _SampledPath | None:
    """Path of a coordinate; None for other names."""
    hinge = name.hinge or ("" if own is None else own.name)
    if name.quantity != "q" or not hinge:
        return None
    slots, index = model.coordinate_layout.hinges[hinge], name.index or 0
    t, q, u = _all_states(run)
    ends = q[:, slots.q + index]
    values = np.stack([ends[:-1], ends[1:]])
    if slots.rates_are_speeds:
        values = _cubic_values(np.diff(t), ends, u[:, slots.u + index])
    distance = np.abs(np.diff(values, axis=0)).sum(axis=0)
    return _SampledPath(
        ends, values.min(axis=0), values.max(axis=0), parts * distance, slots.q_units[index]
    )


def _cubic_values(h: Array, ends: Array, rates: Array) -> Array:
    """Values (7, n - 1) of cubics with these rates between `ends` (n,), ends included.

    The ends are `h` (n - 1,) apart.
    """
    x = np.linspace(0.0, 1.0, 7)[:, None]
    a, b, va, vb = ends[:-1], ends[1:], h * rates[:-1], h * rates[1:]
    return np.asarray(a + x * (b - a) + x * (1 - x) * ((1 - x) * (va - b + a) + x * (b - a - vb)))


# --- peaks ----------------------------------------------------------------------------------------


def _first_missed_peak(
    view: ExpressionFunctions, path: _SampledPath, ends_are_steps: bool
) -> tuple[float, float, float] | None:
    """First missed peak: (position, length of steps there, required length)."""
    low, high = float(path.minima.min()), float(path.maxima.max())
    watched = _peaked_terms(view) if path.ranges else view.narrow_candidates()
    if not high > low or not watched:
        return None
    edges = path.positions if path.ranges else None
    max_cells = _MAX_CELLS_PER_PIECE if path.ranges else view.max_cells
    resolution = step_limits(view.terms, watched, low, high, max_cells, edges)
    is_narrow = resolution.longest < path.step_distances.max(initial=0.0)
    if not is_narrow.any():
        return None
    root = view.expression.root
    for term in watched:
        positions, values, limits = _narrow_peaks(view, term, resolution, is_narrow, high)
        ends = view.values(term.term, path.positions)
        for position, value, limit in zip(positions, values, limits, strict=True):
            factor = _TIME_STEP_FACTOR if path.ranges and ends_are_steps else 1.0
            is_long = path.step_distances > factor * limit
            missed = (path.minima <= position) & (position <= path.maxima) & is_long
            if ends_are_steps or path.ranges:
                function_range = max(
                    np.ptp(np.append(values, ends)), path.ranges.get(term.term, 0.0)
                )
                height = _hidden_height(value, ends, ends_are_steps)
                missed &= height > _MIN_PEAK_RATIO * function_range
            if path.ranges and missed.any():  # a narrow part may not affect the whole
                whole_values = view.values(root, np.append(path.positions, position))
                height = _hidden_height(whole_values[-1], whole_values[:-1], ends_are_steps)
                missed &= height > _MIN_PEAK_RATIO * path.ranges[root]
            if missed.any():
                return position, float(path.step_distances[missed].max()), limit
    return None


def _hidden_height(value: float, ends: Array, both: bool) -> Array:
    """Height (n - 1,) of a value over those at the ends (n,) of steps: over both, or over one."""
    distances = np.abs(value - ends)
    return np.asarray((np.minimum if both else np.maximum)(distances[1:], distances[:-1]))


def _narrow_peaks(
    view: ExpressionFunctions,
    watched: WatchedFunction,
    known: StepLimits,
    narrow: Array,
    high: float,
) -> tuple[Array, Array, Array]:
    """Peaks of a function in its narrow parts: position, height, and step limit there."""
    ends = np.append(known.starts[1:], high)
    positions, limits = [np.zeros(0)], [np.zeros(0)]
    parts = (known.starts, ends, known.longest)
    for a, b, limit_of_part in zip(*(part[narrow] for part in parts), strict=True):
        count = int(min(np.ceil(2 * CELLS_PER_STEP * (b - a) / limit_of_part), _MAX_POINTS)) + 2
        positions.append(np.linspace(a, b, count))
        limits.append(np.full(count, limit_of_part))
    points, first_indices = np.unique(
        np.concatenate(positions), return_index=True
    )  # shared edges of parts
    limit = np.concatenate(limits)[first_indices]
    values = view.values(watched.term, points)
    signs = np.sign(np.diff(values))
    moving = np.flatnonzero(np.abs(signs) > 0)  # equal neighbours may be a turning point, too
    peak_indices = moving[1:][np.diff(signs[moving]) != 0][:_MAX_PEAKS]
    return points[peak_indices], values[peak_indices], limit[peak_indices]
