"""Measurement and plot of a case of the atlas."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..errors import NumericalFailure
from .definition import Definition
from .found import Found
from .frontier import Tried, bracketed, outwards


class Case(Found):
    """Result of a case, with its plot."""

    def plot(self, path: str | Path | None = None) -> Any:
        """Plot both methods along the parameter; returns a `matplotlib.figure.Figure`.

        With `path` the figure is also written to that file.  Raises SceneError for a path that is
        no .png, .svg or .pdf, EnvironmentFailure without the extra `plot`.
        """
        from .picture import draw

        return draw(self, None if path is None else Path(path))


def measure(case: Definition, points: int, tolerance: float) -> Case:
    """Find the frontiers of a case: a grid of `points` values, then bisection to `tolerance`.

    Raises NumericalFailure, with the name of the case, if the results contradict its definition.
    """
    method = Tried(case.method.measure, case.limit)
    remedy = Tried(case.remedy.measure, case.limit)
    values = case.scale.grid(case.low, case.high, points)
    above = method.holds(case.low)
    if not above:
        values = values[::-1]
    try:
        found = bracketed(method, values, case.scale, tolerance)
        assert found.fails_at is not None
        for value in values:
            remedy.holds(value)  # for the plot
        further = case.scale.grid(found.fails_at, case.reach, points)
        held = outwards(remedy, further, case.scale, tolerance)
    except NumericalFailure as error:
        raise NumericalFailure(f'case "{case.name}": {error}') from None
    return Case(
        case.name, case.title, case.why, case.parameter, case.unit, case.scale.name, case.measured,
        case.limit, case.method.name, "above" if above else "below", found.fails_at, found.holds_at,
        found.monotone, method.points(), case.remedy.name, held.holds_at, held.fails_at,
        held.monotone, remedy.points(), case.source,
    )  # fmt: skip
