"""All programs on a case: points against one reference, timed together."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from mstmm.errors import MstmmError
from mstmm.runtime.experiments.chart.chart_record import (
    Point,
    Reference,
    bound_errors,
    pareto_front,
    recommend,
)
from mstmm.runtime.experiments.trial import Setting

from ..common import measure
from ..stiff.cases import Case
from ..stiff.programs import Curve
from . import mstmm_runs as mstmm_runs
from . import peers

OWN = "mstmm"
#: Target errors of the recommended settings, m.
TARGET_ERRORS = (1e-4, 1e-6)
#: Error, m; the second smaller one ends the curve of a program.
_SMALLEST_ERROR = 1e-8

Call = Callable[[], object]


@dataclass(frozen=True)
class Limits:
    """Limits: wall time s of mstmm's survey, CPU s of a peer's run after which no
    tighter one is tried, alternating rounds, every how many-th setting of a peer is run, and which
    of mstmm's methods (all for none)."""

    budget: float = 40.0
    run: float = 2.0
    rounds: int = 5
    stride: int = 1
    methods: tuple[str, ...] = ()


def compare(case: Case, limits: Limits, with_peers: bool, report: Callable[[str], None]) -> Any:
    """Plain data: reference, points of all programs, recommended settings, missing programs."""
    missing: list[str] = []
    own_runs = mstmm_runs.survey_case(case, limits.budget, report, limits.methods)
    reference = own_runs.reference
    report(f"{case.name}: mstmm: {len(own_runs.points)} settings")
    points: dict[str, list[Point]] = {OWN: list(own_runs.points)}
    calls: dict[Setting, Call] = {
        point.setting: mstmm_runs.simulate_call(own_runs, case, point.setting)
        for point in own_runs.points
    }
    curves = peers.case_curves(own_runs.model, case, missing.append) if with_peers else []
    for curve in curves:
        evaluated = dict(evaluate_curve(curve, own_runs, limits))
        points.setdefault(curve.tool, []).extend(point for point, _ in evaluated.values())
        calls |= {setting: run for setting, (_, run) in evaluated.items()}
        report(f"{case.name}: {curve.tool}, {curve.variant}: {len(evaluated)} settings")
    bounded = {tool: bound_errors(tool_points, reference) for tool, tool_points in points.items()}
    fronts = {
        tool: pareto_front(tool_points, reference.smallest_resolved_error)
        for tool, tool_points in bounded.items()
    }
    timed = time_fronts(fronts, calls, limits.rounds)
    return {
        "case": case.name, "title": case.title, "t_end_s": case.t_end, "end": case.end_names[-1],
        "engines": list(own_runs.models),
        "shortest_call_ms": float(f"{1e3 * mstmm_runs.shortest_call(own_runs, case):.3g}"),
        "reference": reference.to_dict(),
        "fronts": {tool: [point_values(p) for p in front] for tool, front in timed.items()},
        "method_curves": method_curves(bounded[OWN]),
        "recommended": {
            f"{target:g}": recommended_points(timed, target, reference) for target in TARGET_ERRORS
        },
        "missing": missing,
    }  # fmt: skip


def evaluate_curve(
    curve: Curve, own_runs: mstmm_runs.OwnRuns, limits: Limits
) -> Iterator[tuple[Setting, tuple[Point, Call]]]:
    """Points of a curve, loose to tight, with their runs."""
    accurate_count = 0
    for value, run in list(curve.settings)[:: limits.stride]:
        setting = Setting(curve.tool, curve.variant, value, peers.has_fixed_steps(curve))
        try:
            start_time = time.process_time()
            read_positions, _ = run()
            cpu_s = time.process_time() - start_time
            error = float(np.linalg.norm(read_positions()[-1] - own_runs.exact))
        except Exception as failure:  # a failed run is a result too
            text = (str(failure).strip().splitlines() or [type(failure).__name__])[0]
            yield setting, (Point(setting, failure=text[:120]), run)
            continue
        if not math.isfinite(error):
            yield setting, (Point(setting, failure="positions not finite"), run)
            continue
        yield setting, (Point(setting, error, cpu_s, 1), run)
        accurate_count += error < max(_SMALLEST_ERROR, own_runs.reference.smallest_resolved_error)
        if accurate_count == 2 or cpu_s > limits.run:
            return


def time_fronts(
    fronts: Mapping[str, Sequence[Point]], calls: Mapping[Setting, Call], rounds: int
) -> dict[str, list[Point]]:
    """Points of all fronts with minimum times of alternating rounds."""
    settings = {setting_key(p): p.setting for tool_points in fronts.values() for p in tool_points}
    work = {key: partial(measure.call_time, calls[setting]) for key, setting in settings.items()}
    samples = measure.sample_rounds(work, rounds)
    return {
        tool: [replace(p, cpu_s=min(samples[setting_key(p)]), repeats=rounds) for p in tool_points]
        for tool, tool_points in fronts.items()
    }


def setting_key(point: Point) -> str:
    """Unique key of a setting."""
    return f"{point.method}|{point.model}|{point.setting.value!r}"


def recommended_points(
    fronts: Mapping[str, Sequence[Point]], target: float, reference: Reference
) -> dict[str, Any]:
    """The cheapest point of every tool for an error, and mstmm's time in that of the best peer."""
    points: dict[str, Any] = {}
    for tool, tool_points in fronts.items():
        try:
            points[tool] = point_values(recommend(tool_points, target, reference))
        except MstmmError as error:
            points[tool] = {"missed": str(error)}
    peer_times = {tool: p["cpu_ms"] for tool, p in points.items() if "cpu_ms" in p and tool != OWN}
    peer = min(peer_times, key=peer_times.__getitem__, default=None)
    ratio = points[OWN]["cpu_ms"] / peer_times[peer] if peer and "cpu_ms" in points[OWN] else None
    return {"tools": points, "best_peer": peer, "ratio": ratio}


def method_curves(points: Sequence[Point]) -> dict[str, list[list[float]]]:
    """Pairs of error (m) and CPU ms, timed once, by method and engine."""
    curves: dict[str, list[list[float]]] = {}
    for p in points:
        if p.error and p.cpu_s:
            pair = [float(f"{p.error:.3g}"), float(f"{1e3 * p.cpu_s:.3g}")]
            curves.setdefault(f"{p.method}, {p.model}", []).append(pair)
    return curves


def point_values(point: Point) -> dict[str, Any]:
    """A point that ran."""
    assert point.error is not None and point.cpu_s is not None
    return {
        "method": point.method, "variant": point.model,
        "value": point.setting.value, "has_fixed_steps": point.setting.fixed,
        "error_m": float(f"{point.error:.4g}"), "error_bound_m": float(f"{point.error_bound:.4g}"),
        "cpu_ms": float(f"{1e3 * point.cpu_s:.4g}"),
    }  # fmt: skip
