"""A chart: points, the reference they were measured against, the front, and what to take."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from mstmm.errors import EnvironmentFailure, MstmmError

from ..host.files import replacing
from . import front as fronts
from .point import LeftOut, Level, Point, Reference

#: Errors for which the cheapest setting is told.
ASKED = tuple(10.0**-k for k in range(1, 11))


@dataclass(frozen=True)
class Chart:
    """Cost against accuracy of one scene.  Made by `mstmm.chart`.

    Attributes:
        title: what was charted.
        t_end: end of the runs, s; `samples` is at how many times errors were looked at.
        reference: what errors are measured against, and its own error.
        points: every run; see `Point`.
        levels: of model, from the smallest to the richest, with their own errors.
        left_out: methods and levels that were refused, settings that were not run, and why.
        wanted: the error for which a setting was asked.
        budget, spent: s of the clock.
    """

    title: str
    t_end: float
    samples: int
    reference: Reference
    points: tuple[Point, ...]
    levels: tuple[Level, ...]
    left_out: tuple[LeftOut, ...]
    wanted: float
    budget: float
    spent: float

    @cached_property
    def front(self) -> tuple[Point, ...]:
        """Pareto's front of sure error and processor time, cheapest first."""
        return fronts.front(self.points, self.reference.floor)

    def recommended(self, error: float | None = None) -> Point:
        """The cheapest point that errs by at most `error` (the wanted one unless given), as do all
        tighter settings of its method.

        SceneError for an error that is not above 0, NumericalFailure, with what there is, where no
        point meets it or the reference cannot tell.
        """
        asked = self.wanted if error is None else error
        return fronts.recommended(self.points, asked, self.reference)

    def advice(self) -> list[tuple[float, Point]]:
        """(error, recommended point) for every power of ten that a point meets."""
        found = []
        for error in ASKED:
            try:
                found.append((error, self.recommended(error)))
            except MstmmError:
                break
        return found

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain values."""
        best, why = None, None
        try:
            best = self.recommended().to_dict()
        except MstmmError as error:
            why = str(error)
        return {
            "scene": self.title, "t_end": self.t_end, "samples": self.samples,
            "reference": self.reference.to_dict(),
            "points": [point.to_dict() for point in self.points],
            "front": [point.to_dict() for point in self.front],
            "recommended": best, "recommended_for": self.wanted, "not_recommended": why,
            "advice": [{"error": e, **point.to_dict()} for e, point in self.advice()],
            "models": [level.to_dict() for level in self.levels],
            "left_out": [one.to_dict() for one in self.left_out],
            "budget_s": self.budget, "spent_s": self.spent,
        }  # fmt: skip

    def to_json(self) -> str:
        """The same as JSON text."""
        return json.dumps(self.to_dict(), indent=2, allow_nan=False) + "\n"

    def plot(self, path: str | Path | None = None) -> Any:
        """`matplotlib.figure.Figure` (extra: plot); with `path` also written: .png, .svg, .pdf."""
        from .picture import plot

        return plot(self, None if path is None else Path(path))

    def to_html(self) -> str:
        """A page that needs nothing else: the picture, its points shown by the pointer, and all
        that is known in tables."""
        from .page import page

        return page(self)

    def save(self, folder: str | Path) -> tuple[Path, ...]:
        """Write chart.html, chart.json and, where matplotlib is installed, chart.png.

        EnvironmentFailure where the folder cannot be made or written to.
        """
        place = Path(folder)
        try:
            place.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise EnvironmentFailure(f'folder "{place}" cannot be made: {error.strerror}') from None
        made = []
        for name, text in (("chart.html", self.to_html()), ("chart.json", self.to_json())):
            with replacing(place / name) as temporary:
                temporary.write_text(text, encoding="utf-8")
            made.append(place / name)
        from .picture import installed

        if installed():
            self.plot(place / "chart.png")
            made.append(place / "chart.png")
        return tuple(made)
