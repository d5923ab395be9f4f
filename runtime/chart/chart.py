"""A chart and the ways out of it: a picture, a page, a file of numbers."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mstmm.errors import EnvironmentFailure

from ..platform_support.safe_files import write_text
from .chart_record import ChartRecord
from .html_page import page
from .matplotlib_plot import has_matplotlib, plot


@dataclass(frozen=True)
class Chart(ChartRecord):
    """Cost against accuracy of one scene.  Made by `mstmm.chart`.

    `ChartRecord` says what its attributes are.
    """

    def plot(self, path: str | Path | None = None) -> Any:
        """`matplotlib.figure.Figure` (extra: plot); with `path` also written: .png, .svg, .pdf."""
        return plot(self, None if path is None else Path(path))

    def to_html(self) -> str:
        """A page that needs nothing else: the picture, its points shown by the pointer, and all
        that is known in tables."""
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
            write_text(place / name, text)
            made.append(place / name)
        if has_matplotlib():
            self.plot(place / "chart.png")
            made.append(place / "chart.png")
        return tuple(made)
