"""Atlas: measured cases of numerical methods, as data, plots and a page."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..argument_validation import abbreviate
from ..errors import EnvironmentFailure, NumericalFailure, SceneError
from ..runtime.platform_support.safe_files import write_text
from . import cases as case_registry
from .case_definition import CaseDefinition, CaseResult
from .frontier import MeasuredMethod, find_end, find_frontier
from .page import draw_case, markdown_page

#: Values of the coarse grid, and relative width of the last bracket.
GRID_POINTS, BRACKET_TOLERANCE = 13, 0.01


# --- measurement of a case ------------------------------------------------------------------------


class MeasuredCase(CaseResult):
    """Result of a case, with its plot."""

    def plot(self, path: str | Path | None = None) -> Any:
        """Plot both methods along the parameter; returns a `matplotlib.figure.Figure`.

        With `path` the figure is also written to that file.  Raises SceneError for a path that is
        no .png, .svg or .pdf, EnvironmentFailure without the extra `plot`.
        """
        return draw_case(self, path)


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
        case.name, case.title, case.cause, case.parameter, case.unit, case.scale.name,
        case.measured, case.limit,
        case.method.name, "above" if holds_at_low else "below", bracket.fails_at,
        bracket.holds_at, bracket.monotone, method.points(),
        case.remedy.name, remedy_bracket.holds_at, remedy_bracket.fails_at,
        remedy_bracket.monotone, remedy.points(), case.source,
    )  # fmt: skip


# --- atlas of cases -------------------------------------------------------------------------------


@dataclass(frozen=True)
class Atlas:
    """Measured cases of the atlas, in the requested order."""

    cases: tuple[MeasuredCase, ...]

    def to_dict(self) -> dict[str, Any]:
        """Convert to plain data, {"cases": [...]}."""
        return {"cases": [case.to_dict() for case in self.cases]}

    def plot(self, folder: str | Path) -> list[Path]:
        """Write a plot NAME.png of each case to an existing folder; returns the paths.

        Raises EnvironmentFailure without the extra `plot`.
        """
        paths = [Path(folder) / f"{case.name}.png" for case in self.cases]
        for case, path in zip(self.cases, paths, strict=True):
            case.plot(path)
        return paths

    def save(self, folder: str | Path, pictures: bool = True) -> list[Path]:
        """Write `atlas.json`, the page `atlas.md` and optionally a plot of each case.

        Returns the paths.  The folder is created with its parents; raises EnvironmentFailure if
        that fails.
        """
        folder_path = Path(folder)
        try:
            folder_path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise EnvironmentFailure(
                f'folder "{folder_path}" cannot be created: {error.strerror}'
            ) from None
        json_path, page_path = folder_path / "atlas.json", folder_path / "atlas.md"
        write_text(json_path, json.dumps(self.to_dict(), indent=1, allow_nan=False) + "\n")
        write_text(page_path, markdown_page(self.cases, pictures))
        return [json_path, page_path, *(self.plot(folder_path) if pictures else ())]


def stability(
    cases: Iterable[str] | None = None,
    *,
    points: int = GRID_POINTS,
    tolerance: float = BRACKET_TOLERANCE,
    progress: Callable[[str, int, int], None] | None = None,
) -> Atlas:
    """Find the parameter values at which methods fail, and the range of each remedy.

    Args:
        cases: names (`mstmm stability --list`); default: all whose packages are installed.
        points: values of the coarse grid along each parameter, 3 or more.
        tolerance: width of the last bracket of a frontier, relative to the parameter.
        progress: called with the name of a case, its index and the number of cases.

    Raises SceneError for an unknown name and for invalid settings, EnvironmentFailure for a named
    case without its packages.
    """
    if isinstance(cases, str) or (cases is not None and not isinstance(cases, Iterable)):
        raise SceneError(f"cases = {abbreviate(cases)}: expected a list of names")
    if isinstance(points, bool) or not isinstance(points, int) or not 3 <= points <= 1000:
        raise SceneError(f"points = {points!r}: expected a whole number from 3 to 1000")
    if not 0 < tolerance < 1:
        raise SceneError(f"tolerance = {tolerance!r}: expected a number between 0 and 1")
    measured_cases = []
    definitions = case_registry.select_cases(None if cases is None else list(cases))
    if cases is None:
        definitions = tuple(definition for definition in definitions if not definition.lacks)
    for number, definition in enumerate(definitions):
        if progress is not None:
            progress(definition.name, number, len(definitions))
        measured_cases.append(measure_case(definition, points, tolerance))
    return Atlas(tuple(measured_cases))
