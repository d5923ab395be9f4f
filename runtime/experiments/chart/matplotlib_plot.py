"""Plot of a chart by matplotlib (extra: plot)."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from textwrap import wrap
from typing import Any

from mstmm.display import escape_control_characters

from ...figures import figure_class, figure_style, write_figure
from .chart_record import ChartRecord
from .plot_elements import Drawing, Entry, build_drawing, decades, time_text

#: Characters in a line of the subtitle.
_SUBTITLE_COLUMNS = 150

#: Width and smallest height of the figure, and height of a legend row, inches.
_WIDTH, _HEIGHT, _ROW = 9.4, 5.9, 0.155


def has_matplotlib() -> bool:
    """Whether matplotlib is installed."""
    return find_spec("matplotlib") is not None


@figure_style(9)
def plot(chart: ChartRecord, path: str | Path | None) -> Any:
    """Plot a chart as `matplotlib.figure.Figure`, and write it to `path` if given.

    Raises EnvironmentFailure without matplotlib, SceneError for an unknown file extension.
    """
    drawing = build_drawing(chart)
    height = max(_HEIGHT, _ROW * len(drawing.legend) + 0.9)
    figure = figure_class()(figsize=(_WIDTH, height))
    _draw_axes(figure.add_axes((0.085, 0.62 / height, 0.675, 1 - 1.36 / height)), drawing)
    _draw_legend(figure, drawing.legend, height)
    title = escape_control_characters(drawing.title)
    figure.text(0.085, 1 - 0.1 / height, title, fontsize=12, va="top", weight="bold",
                parse_math=False)  # fmt: skip
    for i, line in enumerate(wrap(escape_control_characters(drawing.below), _SUBTITLE_COLUMNS)):
        figure.text(0.085, 1 - (0.34 + 0.15 * i) / height, line, fontsize=8, va="top",
                    color="#555555", parse_math=False)  # fmt: skip
    return write_figure(figure, path, "plot file")


def _draw_axes(axes: Any, drawing: Drawing) -> None:
    if drawing.empty:
        axes.set_axis_off()
        axes.text(0.5, 0.5, drawing.empty, fontsize=11, ha="center", color="#555555",
                  transform=axes.transAxes)  # fmt: skip
        return
    right = drawing.x[1]
    if drawing.floor > right:
        axes.axvspan(drawing.floor, right, color="#f1f1f1", zorder=0)
        axes.text(
            drawing.floor, 0.985, " not resolved by the reference", fontsize=7, color="#777777",
            va="top", ha="left", rotation=90, transform=axes.get_xaxis_transform(),
        )  # fmt: skip
    if len(drawing.pareto_front) > 1:
        axes.plot(*zip(*drawing.pareto_front, strict=True), color="#111111", lw=7, alpha=0.16,
                  solid_capstyle="round", solid_joinstyle="round", zorder=3)  # fmt: skip
    for line in drawing.lines:
        positions = [position for position, _ in line.points]
        axes.plot(
            *zip(*positions, strict=True), color=line.style.colour,
            marker=line.style.mark or "None", ls="-" if line.is_connected else "None",
            lw=1.7 if line.is_emphasised else 0.8, ms=5 if line.is_emphasised else 3, mec="white",
            mew=0.5, alpha=1.0 if line.is_emphasised else 0.55,
            zorder=5 if line.is_emphasised else 2, clip_on=True,
        )  # fmt: skip
    if drawing.pareto_front:
        axes.plot(*zip(*drawing.pareto_front, strict=True), "o", ms=9, mfc="none", mec="#111111",
                  mew=0.9, zorder=6)  # fmt: skip
    for label in drawing.labels:
        axes.annotate(
            label.text, label.position, (label.at[0], -label.at[1]), textcoords="offset points",
            ha="center", va="center", fontsize=8, zorder=7,
            bbox={"boxstyle": "round,pad=0.12", "fc": "white", "ec": "none", "alpha": 0.6},
        )  # fmt: skip
    for log_error, colour, _ in drawing.own:
        axes.plot([log_error, log_error], [0.0, 0.025], color=colour, lw=2.5, zorder=8,
                  clip_on=False, transform=axes.get_xaxis_transform())  # fmt: skip
    axes.set(xlim=drawing.x, ylim=drawing.y, ylabel=drawing.y_label,
             xlabel=f"{drawing.x_label}  (more accurate to the right)")  # fmt: skip
    powers = decades(*drawing.x)
    axes.set_xticks(powers, [f"$10^{{{power}}}$" for power in powers])
    times = decades(*drawing.y)
    axes.set_yticks(times, [time_text(power) for power in times])


def _draw_legend(figure: Any, entries: Sequence[Entry], height: float) -> None:
    """Draw the legend at the right: headings with names below."""
    for i, entry in enumerate(entries):
        y = 1 - (0.70 + _ROW * i) / height
        if entry.style is None:
            look: dict[str, Any] = {"weight": "bold"} if entry.strong else {"color": "#666666"}
            figure.text(
                0.785 if entry.strong else 0.826,
                y,
                escape_control_characters(entry.text),
                va="center",
                fontsize=8 if entry.strong else 7,
                parse_math=False,
                **look,
            )
            continue
        from matplotlib.lines import Line2D

        shade = 1.0 if entry.strong else 0.6
        figure.add_artist(Line2D(
            [0.792, 0.805, 0.818], [y] * 3, color=entry.style.colour, lw=1.3, alpha=shade,
            marker=entry.style.mark, markevery=[1], ms=5, mec="white", mew=0.4,
        ))  # fmt: skip
        figure.text(0.826, y, escape_control_characters(entry.text), fontsize=8, va="center",
                    color="#111111" if entry.strong else "#666666", parse_math=False)  # fmt: skip
