"""Curves that answer to the pointer, one panel per unit (extra: plot)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...extras import missing

if TYPE_CHECKING:
    from ...runtime.result.names import Quantity
    from ...runtime.result.result import Result

#: Curves in one panel, points of a curve, height of a panel in pixels.
_MOST, _POINTS, _TALL = 12, 1500, 240
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#555555", "#8a7a00")


def curves(result: Result, names: Sequence[str]) -> str:
    """The quantities over time.  SceneError for a name that there is not."""
    if len(result.t) < 2:
        return ""
    try:
        from plotly import graph_objects, subplots
    except ImportError as error:
        raise missing("plot", "the curves of a report", error) from None
    panels = _panels([result.quantity(name) for name in names])
    figure = subplots.make_subplots(
        rows=len(panels), cols=1, shared_xaxes=True, vertical_spacing=0.12 / len(panels)
    )
    for row, (unit, quantities) in enumerate(panels.items(), 1):
        lines = [line for quantity in quantities for line in _lines(result, quantity)]
        for k, (label, t, values) in enumerate(lines[:_MOST]):
            figure.add_trace(
                graph_objects.Scatter(
                    x=t, y=values, name=label, mode="lines", line={"color": _COLOURS[k % 8]},
                    legend=f"legend{row if row > 1 else ''}", hovertemplate="%{y:.6g}",
                ),
                row=row, col=1,
            )  # fmt: skip
        figure.update_yaxes(title_text=unit or "1", row=row, col=1)
        top = 1 - (row - 1) / len(panels)
        figure.update_layout({f"legend{row if row > 1 else ''}": {"y": top, "yanchor": "top"}})
    figure.update_xaxes(title_text="t in s", row=len(panels), col=1)
    figure.update_layout(
        height=_TALL * len(panels) + 80, margin={"l": 70, "r": 10, "t": 20, "b": 45},
        hovermode="x unified", template="plotly_white",
    )  # fmt: skip
    drawn: str = figure.to_html(
        full_html=False, include_plotlyjs=True, config={"displaylogo": False, "responsive": True}
    )
    return f'<div class="curves">{drawn}</div>'


def _panels(quantities: Sequence[Quantity]) -> dict[str, list[Quantity]]:
    """Quantities by their units, in the order in which units are met."""
    found: dict[str, list[Quantity]] = {}
    for quantity in quantities:
        found.setdefault(quantity.unit, []).append(quantity)
    return found


def _lines(result: Result, quantity: Quantity) -> list[tuple[str, Any, Any]]:
    """(label, t, values) of every component, at no more points than can be seen."""
    from ...runtime.result.output.curves import curve

    t, values = curve(result.t, quantity)
    some = np.unique(np.linspace(0, len(t) - 1, _POINTS).round().astype(int))
    labels = quantity.labels or [""]
    return [
        (f"{quantity.name}.{label}" if len(labels) > 1 and label else quantity.name,
         t[some], values[some, k])
        for k, label in enumerate(labels)
    ]  # fmt: skip
