"""Work-precision chart of a scene with its plot, HTML page and JSON file."""

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
    """Work-precision chart: CPU time against error of all methods.  Made by `mstmm.chart`.

    The attributes are those of `ChartRecord`.
    """

    def plot(self, path: str | Path | None = None) -> Any:
        """Plot as `matplotlib.figure.Figure`; needs the extra `plot`.

        With `path` (.png, .svg, .pdf) also write the file.
        """
        return plot(self, None if path is None else Path(path))

    def to_html(self) -> str:
        """Self-contained HTML page: the plot, with details of a point on hover, and all tables."""
        return page(self)

    def save(self, folder: str | Path) -> tuple[Path, ...]:
        """Write chart.html, chart.json and, where matplotlib is installed, chart.png.

        Returns the paths of the files.  Raises EnvironmentFailure if the folder cannot be created
        or written to.
        """
        directory = Path(folder)
        try:
            directory.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise EnvironmentFailure(
                f'folder "{directory}": cannot be created: {error.strerror}'
            ) from None
        paths = []
        for name, text in (("chart.html", self.to_html()), ("chart.json", self.to_json())):
            write_text(directory / name, text)
            paths.append(directory / name)
        if has_matplotlib():
            self.plot(directory / "chart.png")
            paths.append(directory / "chart.png")
        return tuple(paths)
