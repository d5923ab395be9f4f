"""A case with everybody: points of one kind, judged against one reference, timed in one go."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from mstmm.errors import MstmmError
from mstmm.runtime.chart.chart_points import Point, Reference, Setting
from mstmm.runtime.chart.pareto_front import bound_errors, pareto_front, recommend

from ..common import measure
from ..stiff.cases import Case
from ..stiff.programs import Curve
from . import mstmm_runs as ours
from . import peers

OWN = "mstmm"
#: Errors (m) for which the cheapest settings are told.
ASKED = (1e-4, 1e-6)
#: A curve of a peer ends where it errs by less than this, m, for the second time.
_ENOUGH = 1e-8

Call = Callable[[], object]


@dataclass(frozen=True)
class Limits:
    """How much time there is: clock s of mstmm's survey, CPU s of a peer's run after which no
    tighter one is tried, alternating rounds, every how many-th setting of a peer is run, and which
    of mstmm's methods (all for none)."""

    budget: float = 40.0
    run: float = 2.0
    rounds: int = 5
    stride: int = 1
    methods: tuple[str, ...] = ()


def compared(case: Case, limits: Limits, with_peers: bool, say: Callable[[str], None]) -> Any:
    """Plain values: reference, points of every tool, what is recommended, who did not run."""
    missing: list[str] = []
    own = ours.surveyed(case, limits.budget, say, limits.methods)
    reference = own.reference
    say(f"{case.name}: mstmm: {len(own.points)} settings")
    points: dict[str, list[Point]] = {OWN: list(own.points)}
    calls: dict[Setting, Call] = {
        point.setting: ours.call(own, case, point.setting) for point in own.points
    }
    curves = peers.of_case(own.model, case, missing.append) if with_peers else []
    for curve in curves:
        found = dict(tried(curve, own, limits))
        points.setdefault(curve.tool, []).extend(point for point, _ in found.values())
        calls |= {setting: run for setting, (_, run) in found.items()}
        say(f"{case.name}: {curve.tool}, {curve.manner}: {len(found)} settings")
    known = {tool: bound_errors(some, reference) for tool, some in points.items()}
    fronts = {
        tool: pareto_front(some, reference.smallest_resolved_error) for tool, some in known.items()
    }
    best = timed(fronts, calls, limits.rounds)
    return {
        "case": case.name, "title": case.title, "t_end_s": case.t_end, "of": case.watched[-1],
        "engines": list(own.models),
        "shortest_call_ms": float(f"{1e3 * ours.shortest_call(own, case):.3g}"),
        "reference": reference.to_dict(),
        "fronts": {tool: [plain(p) for p in some] for tool, some in best.items()},
        "single": behind(known[OWN]),
        "recommended": {f"{asked:g}": choice(best, asked, reference) for asked in ASKED},
        "missing": missing,
    }  # fmt: skip


def tried(
    curve: Curve, own: ours.Own, limits: Limits
) -> Iterator[tuple[Setting, tuple[Point, Call]]]:
    """The points of a peer's curve, loose to tight, and how each is run again."""
    accurate = 0
    for value, run in list(curve.settings)[:: limits.stride]:
        setting = Setting(curve.tool, curve.manner, value, peers.takes_steps(curve))
        try:
            begin = time.process_time()
            look, _ = run()
            spent = time.process_time() - begin
            error = float(np.linalg.norm(look()[-1] - own.exact))
        except Exception as failure:  # one that gives up is a result too
            text = (str(failure).strip().splitlines() or [type(failure).__name__])[0]
            yield setting, (Point(setting, failure=text[:120]), run)
            continue
        if not math.isfinite(error):
            yield setting, (Point(setting, failure="places that are not numbers"), run)
            continue
        yield setting, (Point(setting, error, spent, 1), run)
        accurate += error < max(_ENOUGH, own.reference.smallest_resolved_error)
        if accurate == 2 or spent > limits.run:
            return


def timed(
    fronts: Mapping[str, Sequence[Point]], calls: Mapping[Setting, Call], rounds: int
) -> dict[str, list[Point]]:
    """The points of all fronts with the least of their times in alternating rounds."""
    settings = {name(p): p.setting for some in fronts.values() for p in some}
    work = {key: partial(measure.once, calls[setting]) for key, setting in settings.items()}
    samples = measure.rounds(work, rounds)
    return {
        tool: [replace(p, cpu_s=min(samples[name(p)]), repeats=rounds) for p in some]
        for tool, some in fronts.items()
    }


def name(point: Point) -> str:
    """Of a setting, among those of all tools."""
    return f"{point.method}|{point.model}|{point.setting.value!r}"


def choice(
    fronts: Mapping[str, Sequence[Point]], asked: float, reference: Reference
) -> dict[str, Any]:
    """The cheapest point of every tool for an error, and mstmm's time in that of the best peer."""
    found: dict[str, Any] = {}
    for tool, some in fronts.items():
        try:
            found[tool] = plain(recommend(some, asked, reference))
        except MstmmError as why:
            found[tool] = {"missed": str(why)}
    met = {tool: p["cpu_ms"] for tool, p in found.items() if "cpu_ms" in p and tool != OWN}
    peer = min(met, key=met.__getitem__, default=None)
    ratio = found[OWN]["cpu_ms"] / met[peer] if peer and "cpu_ms" in found[OWN] else None
    return {"tools": found, "best_peer": peer, "ratio": ratio}


def behind(points: Sequence[Point]) -> dict[str, list[list[float]]]:
    """Pairs of error (m) and CPU ms, timed once, by method and engine."""
    found: dict[str, list[list[float]]] = {}
    for p in points:
        if p.error and p.cpu_s:
            pair = [float(f"{p.error:.3g}"), float(f"{1e3 * p.cpu_s:.3g}")]
            found.setdefault(f"{p.method}, {p.model}", []).append(pair)
    return found


def plain(point: Point) -> dict[str, Any]:
    """A point that ran."""
    assert point.error is not None and point.cpu_s is not None
    return {
        "method": point.method, "manner": point.model,
        "value": point.setting.value, "fixed": point.setting.fixed,
        "error_m": float(f"{point.error:.4g}"), "sure_error_m": float(f"{point.error_bound:.4g}"),
        "cpu_ms": float(f"{1e3 * point.cpu_s:.4g}"),
    }  # fmt: skip
