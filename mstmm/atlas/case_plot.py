"""Measurement and plot of a case of the atlas."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..errors import NumericalFailure
from .case_definition import CaseDefinition
from .case_result import CaseResult
from .frontier import MeasuredMethod, find_end, find_frontier


class MeasuredCase(CaseResult):
    """Result of a case, with its plot."""

    def plot(self, path: str | Path | None = None) -> Any:
        """Plot both methods along the parameter; returns a `matplotlib.figure.Figure`.

        With `path` the figure is also written to that file.  Raises SceneError for a path that is
        no .png, .svg or .pdf, EnvironmentFailure without the extra `plot`.
        """
        from .picture import draw_case

        return draw_case(self, None if path is None else Path(path))


def measure_case(case: CaseDefinition, points: int, tolerance: float) -> MeasuredCase:
    """Find the frontiers of a case: a grid of `points` values, then bisection to `tolerance`.

    Raises NumericalFailure, with the name of the case, if the results contradict its definition.
    """
    method = MeasuredMethod(case.method.measure, case.limit)
    remedy = MeasuredMethod(case.remedy.measure, case.limit)
    values = case.scale.grid(case.low, case.high, points)
    holds_at_low = method.is_within_limit(case.low)
    if not holds_at_low:
        values = values[::-1]
    try:
        bracket = find_frontier(method, values, case.scale, tolerance)
        assert bracket.fails_at is not None
        for value in values:
            remedy.is_within_limit(value)  # adds a point to the plot
        remedy_values = case.scale.grid(bracket.fails_at, case.reach, points)
        remedy_bracket = find_end(remedy, remedy_values, case.scale, tolerance)
    except NumericalFailure as error:
        raise NumericalFailure(f'case "{case.name}": {error}') from None
    return MeasuredCase(
        case.name,
        case.title,
        case.cause,
        case.parameter,
        case.unit,
        case.scale.name,
        case.measured,
        case.limit,
        case.method.name,
        "above" if holds_at_low else "below",
        bracket.fails_at,
        bracket.holds_at,
        bracket.monotone,
        method.points(),
        case.remedy.name,
        remedy_bracket.holds_at,
        remedy_bracket.fails_at,
        remedy_bracket.monotone,
        remedy.points(),
        case.source,
    )
