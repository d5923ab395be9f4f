"""Rules of the comparison: which setting counts, and its cost.

A point is a setting that was run: its `tolerance` (or step; less is tighter), `error_m`, `cpu_ms`
(samples) and `counts`; one that failed has `failure` instead and is no point here.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

Point = Mapping[str, Any]

#: Costs in evaluations of the explicit sweep (planar sweeps, chains of bushings).
WEIGHTS = {"evaluations": 1.0, "residuals": 0.6, "tangents": 2.0, "solves": 1.0, "products": 0.6}


def accurate_points(points: Iterable[Point], target: float) -> list[Point]:
    """Points with an error of at most `target` (m) whose tighter settings meet it too."""
    points_kept: list[Point] = []
    evaluated = [point for point in points if "error_m" in point]
    for point in sorted(evaluated, key=lambda p: float(p["tolerance"])):
        if not point["error_m"] <= target:
            break
        points_kept.append(point)
    return points_kept


def milliseconds(point: Point) -> float:
    """Least CPU time of one run."""
    return float(min(point["cpu_ms"]))


def evaluations(point: Point) -> float | None:
    """Counts in evaluations of the explicit sweep; None without counts."""
    counts = point.get("counts") or {}
    costs = [WEIGHTS[name] * number for name, number in counts.items() if name in WEIGHTS]
    return sum(costs) if costs else None


def cheapest(points: Iterable[Point], target: float) -> Point | None:
    """Accurate point of least CPU time."""
    return min(accurate_points(points, target), key=milliseconds, default=None)


def frontier(points: Iterable[Point]) -> list[Point]:
    """Points that are the cheapest for their own error, loosest first."""
    points = [point for point in points if "error_m" in point]
    errors = sorted({float(point["error_m"]) for point in points}, reverse=True)
    points_kept: list[Point] = []
    for error in errors:
        fastest = cheapest(points, error)
        if fastest is not None and (not points_kept or fastest is not points_kept[-1]):
            points_kept.append(fastest)
    return points_kept
