"""Curves that answer to the pointer, in the panels that a picture has (extra: plot)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...extras import missing
from ...markup import text

if TYPE_CHECKING:
    from ...runtime.result.plotting.panels import Panel, Trace
    from ...runtime.result.result import Result

#: Curves in one panel, points of a curve, height of a panel in pixels.
_MOST, _POINTS, _TALL = 12, 1500, 260
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#555555", "#8a7a00")
#: Within its panel, so that narrow windows have room for the curves.
_LEGEND = {
    "x": 1, "xanchor": "right", "yanchor": "top", "bgcolor": "rgba(255,255,255,0.6)",
    "font": {"size": 11},
}  # fmt: skip


def curves(result: Result, names: Sequence[str]) -> str:
    """The quantities over time; without names those that a picture would show, and the energy.
    SceneError for a name that there is not."""
    if len(result.t) < 2:
        return ""
    try:
        from plotly import graph_objects, subplots
    except ImportError as error:
        raise missing("plot", "the curves of a report", error) from None
    from ...runtime.result.plotting.panels import steady

    shown = _panels(result, names)
    figure = subplots.make_subplots(
        rows=len(shown), cols=1, shared_xaxes=True, vertical_spacing=0.24 / len(shown),
        subplot_titles=[text(panel.title) for panel in shown],
    )  # fmt: skip
    for row, panel in enumerate(shown, 1):
        legend = f"legend{row if row > 1 else ''}"
        for k, trace in enumerate(panel.traces[:_MOST]):
            x, y = _thinned(trace)
            figure.add_trace(
                graph_objects.Scatter(
                    x=x, y=y, name=text(trace.label), mode="lines",
                    line={"color": _COLOURS[k % 8]}, legend=legend, hovertemplate="%{y:.6g}",
                ),
                row=row, col=1,
            )  # fmt: skip
        figure.update_yaxes(range=steady(panel), row=row, col=1)
        top = figure.layout["yaxis" if row == 1 else f"yaxis{row}"].domain[1]
        figure.update_layout({legend: {**_LEGEND, "y": top, "visible": len(panel.traces) > 1}})
    figure.update_annotations(x=0, xanchor="left", font={"size": 14})
    figure.update_xaxes(title_text="time (s)", row=len(shown), col=1)
    figure.update_layout(
        height=_TALL * len(shown) + 110, margin={"l": 60, "r": 10, "t": 60, "b": 45},
        hovermode="x unified", template="plotly_white",
    )  # fmt: skip
    drawn: str = figure.to_html(
        full_html=False, include_plotlyjs=True, config={"displaylogo": False, "responsive": True}
    )
    notes = "".join(f"<p>{text(note)}</p>" for panel in shown for note in panel.notes)
    return f'<div class="curves">{drawn}</div>{notes}'


def _panels(result: Result, names: Sequence[str]) -> list[Panel]:
    from ...runtime.result.plotting.panels import Wanted, panels

    runs = {"run": result}
    if names:
        return panels(runs, Wanted(tuple(dict.fromkeys(names))))
    return [*panels(runs, Wanted()), *panels(runs, Wanted(("energy",)))]


def _thinned(trace: Trace) -> tuple[Any, Any]:
    """At no more points than can be seen."""
    some = np.unique(np.linspace(0, len(trace.x) - 1, _POINTS).round().astype(int))
    return trace.x[some], trace.y[some]
