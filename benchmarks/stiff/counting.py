"""Which setting counts, and what it costs: the rules of the comparison, apart from any run.

A point is a setting that was run: its `tolerance` (or step; less is tighter), `error_m`, `cpu_ms`
(samples) and `counts`; one that failed has `failure` instead and is no point here.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

Point = Mapping[str, Any]

#: What one of each costs in evaluations of the explicit sweep (planar sweeps, chains of bushings).
WEIGHTS = {"evaluations": 1.0, "residuals": 0.6, "tangents": 2.0, "solves": 1.0, "products": 0.6}


def holding(points: Iterable[Point], asked: float) -> list[Point]:
    """The points that err by at most `asked` (m), as do all tighter ones, so that no lucky hit is
    taken for accuracy."""
    found: list[Point] = []
    ran = [point for point in points if "error_m" in point]
    for point in sorted(ran, key=lambda p: float(p["tolerance"])):
        if not point["error_m"] <= asked:
            break
        found.append(point)
    return found


def milliseconds(point: Point) -> float:
    """Least CPU time of one run."""
    return float(min(point["cpu_ms"]))


def evaluations(point: Point) -> float | None:
    """Its counts in evaluations of the explicit sweep; None where nothing was counted."""
    counts = point.get("counts") or {}
    known = [WEIGHTS[name] * number for name, number in counts.items() if name in WEIGHTS]
    return sum(known) if known else None


def cheapest(points: Iterable[Point], asked: float) -> Point | None:
    """Of the points that hold, that of least CPU time."""
    return min(holding(points, asked), key=milliseconds, default=None)


def frontier(points: Iterable[Point]) -> list[Point]:
    """(error, time) worth drawing, loosest first: every point that is the cheapest that holds for
    its own error."""
    points = [point for point in points if "error_m" in point]
    worst = sorted({float(point["error_m"]) for point in points}, reverse=True)
    found: list[Point] = []
    for error in worst:
        best = cheapest(points, error)
        if best is not None and (not found or best is not found[-1]):
            found.append(best)
    return found
