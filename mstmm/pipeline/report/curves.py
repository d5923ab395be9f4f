"""Interactive curves of a report, in the panels of `Result.plot` (extra: plot)."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from ...display import text
from ...optional_packages import missing_package_error

if TYPE_CHECKING:
    from ...runtime.result.plotting.panels import Panel, Trace
    from ...runtime.result.result import Result

#: Largest number of curves in one panel, and of points of a curve.
_MAX_CURVES, _MAX_POINTS = 12, 1500
#: Pixels: height of a panel, of a line of its title and of its legend; spaces above the legend and
#: between panels.
_PANEL_HEIGHT, _TITLE_LINE_HEIGHT, _LEGEND_LINE_HEIGHT, _LEGEND_SPACE, _PANEL_SPACE = (
    210,
    19,
    18,
    8,
    28,
)
#: Largest number of characters of a line of a title.
_MAX_TITLE_LENGTH = 42
#: Pixels: width of a legend in narrow windows, of the line of an entry, and of each character.
_LEGEND_WIDTH, _LEGEND_ENTRY_WIDTH, _CHARACTER_WIDTH = 285, 50, 6.0
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#555555", "#8a7a00")
#: Position of a legend: between title and panel, so that it covers no curve in narrow windows.
_LEGEND_STYLE = {
    "x": 0, "xanchor": "left", "yanchor": "bottom", "orientation": "h", "font": {"size": 11},
}  # fmt: skip


def curves_html(result: Result, names: Sequence[str]) -> str:
    """HTML of quantities over time; without names those of `Result.plot`, and the energy.

    SceneError for an unknown name.
    """
    if len(result.t) < 2:
        return ""
    try:
        from plotly import graph_objects, subplots
    except ImportError as error:
        raise missing_package_error("plot", "the curves of a report", error) from None
    from ...runtime.result.plotting.panels import constant_axis_limits

    panels_shown = _select_panels(result, names)
    titles = [wrap(panel.title, _MAX_TITLE_LENGTH) for panel in panels_shown]
    figure = subplots.make_subplots(
        rows=len(panels_shown), cols=1, shared_xaxes=True,
        subplot_titles=["<br>".join(map(text, lines)) for lines in titles],
    )  # fmt: skip
    for row, panel in enumerate(panels_shown, 1):
        legend = f"legend{row if row > 1 else ''}"
        for k, trace in enumerate(panel.traces[:_MAX_CURVES]):
            x, y = _reduce_points(trace)
            figure.add_trace(
                graph_objects.Scatter(
                    x=x, y=y, name=text(trace.label), mode="lines",
                    line={"color": _COLOURS[k % 8]}, legend=legend, hovertemplate="%{y:.6g}",
                ),
                row=row, col=1,
            )  # fmt: skip
        figure.update_yaxes(range=constant_axis_limits(panel), row=row, col=1)
    height = _place_panels(
        figure, [_legend_height(panel) for panel in panels_shown], [*map(len, titles)]
    )
    figure.update_annotations(x=0, xanchor="left", align="left", font={"size": 13})
    figure.update_xaxes(title_text="time (s)", row=len(panels_shown), col=1)
    figure.update_layout(
        height=height + 85, margin={"l": 60, "r": 10, "t": 40, "b": 45},
        hovermode="x unified", template="plotly_white",
    )  # fmt: skip
    plot_html: str = figure.to_html(
        full_html=False, include_plotlyjs=True, config={"displaylogo": False, "responsive": True}
    )
    notes = "".join(f"<p>{text(note)}</p>" for panel in panels_shown for note in panel.notes)
    return f'<div class="curves">{plot_html}</div>{notes}'


def _place_panels(figure: Any, legends: Sequence[int], lines: Sequence[int]) -> int:
    """Place the panels below each other, under title and legend; returns the height in pixels."""
    heads = [
        _TITLE_LINE_HEIGHT * line_count + legend
        for line_count, legend in zip(lines, legends, strict=True)
    ]
    total_height = sum(heads) + _PANEL_HEIGHT * len(heads) + _PANEL_SPACE * (len(heads) - 1)
    height_above = 0
    for row, (head, legend) in enumerate(zip(heads, legends, strict=True), 1):
        top, bottom = (
            1 - (height_above + head) / total_height,
            1 - (height_above + head + _PANEL_HEIGHT) / total_height,
        )
        height_above += head + _PANEL_HEIGHT + _PANEL_SPACE
        figure.update_yaxes(domain=(max(0.0, bottom), top), row=row, col=1)
        figure.layout.annotations[row - 1].update(y=top, yshift=legend)
        name = f"legend{row if row > 1 else ''}"
        figure.update_layout({name: {**_LEGEND_STYLE, "y": top, "visible": legend > 0}})
    return total_height


def _legend_height(panel: Panel) -> int:
    """Height of a legend in a narrow window, in pixels; 0 without a legend."""
    labels = [trace.label for trace in panel.traces[:_MAX_CURVES]]
    if len(labels) < 2:
        return 0
    columns = max(
        1, int(_LEGEND_WIDTH / (_LEGEND_ENTRY_WIDTH + _CHARACTER_WIDTH * max(map(len, labels))))
    )
    return _LEGEND_LINE_HEIGHT * ceil(len(labels) / columns) + _LEGEND_SPACE


def _select_panels(result: Result, names: Sequence[str]) -> list[Panel]:
    from ...runtime.result.plotting.panels import PlotSelection, build_panels

    runs = {"run": result}
    if names:
        return build_panels(runs, PlotSelection(tuple(dict.fromkeys(names))))
    return [*build_panels(runs, PlotSelection()), *build_panels(runs, PlotSelection(("energy",)))]


def _reduce_points(trace: Trace) -> tuple[Any, Any]:
    """Points (x, y) of a curve, reduced to as many as can be seen."""
    indices = np.unique(np.linspace(0, len(trace.x) - 1, _MAX_POINTS).round().astype(int))
    return trace.x[indices], trace.y[indices]
