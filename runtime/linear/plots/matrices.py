"""Plots of the matrices of a linear model."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.array_validation import Array

from .figure import figure, require_columns, write

if TYPE_CHECKING:
    from ..state_space import StateSpace

#: Largest number of coordinates with a name on every row.
_NAMED = 40
#: Size relative to the largest entry below which the colour scale is linear.
_SMALL = 1e-5
#: Inner ticks of the colour bar, relative to the largest entry.
_INNER = 1e-2


def matrices(linear: StateSpace, path: str | Path | None) -> Any:
    """Plot M, C and K side by side, or A if they do not exist.

    Each matrix has its own colour scale, logarithmic in both signs.
    """
    drawn, names = (
        ("MCK", linear.coordinate_names) if linear.has_stiffness else ("A", linear.state_names)
    )
    require_columns(getattr(linear, drawn[0]))
    named = len(names) <= _NAMED
    side = float(np.clip(0.2 * len(names), 2.4, 6.0)) if named else 4.0
    drawing = figure(side + 1.6, len(drawn) * side + 2.4)
    panels = drawing.subplots(1, len(drawn), sharey=True, squeeze=False)[0]
    for panel, name in zip(panels, drawn, strict=True):
        matrix = getattr(linear, name)
        _map(drawing, panel, matrix)
        panel.set_title(name if matrix.any() else f"{name} = 0", fontsize=11)
        if named:
            panel.set_xticks(range(len(names)), names, rotation=90, fontsize=7)
            panel.set_yticks(range(len(names)), names, fontsize=7)
        panel.set_xlabel(_unit(linear, name), fontsize=8)
        panel.tick_params(length=0)
    write(drawing, path)
    return drawing


def _unit(linear: StateSpace, name: str) -> str:
    """Unit of the entries; for coordinates of several units, that of the rows."""
    if name == "A":
        return "rates of rows per column"
    units = set(linear.coordinate_units)
    if len(units) > 1:
        return "rows in N or N*m"
    per = {"M": "/s^2", "C": "/s", "K": ""}[name]
    unit = units.pop()
    return f"{'N' if unit == 'm' else 'N*m'} per {unit}{per}"


def _map(drawing: Any, panel: Any, matrix: Array) -> None:
    """Draw entries as colours on a symmetric logarithmic scale.

    The colour map is "RdBu_r": positive entries are red, negative ones blue.
    """
    from matplotlib.colors import SymLogNorm

    top = float(np.abs(matrix).max())
    none, top = top == 0, top or 1.0
    scale = SymLogNorm(_SMALL * top, linscale=0.5, vmin=-top, vmax=top)
    drawn = panel.imshow(matrix, cmap="RdBu_r", norm=scale, interpolation="none")
    panel.spines[:].set_visible(False)
    bar = drawing.colorbar(drawn, ax=panel, location="bottom", shrink=0.9, pad=0.02)
    inner = top * _INNER
    bar.set_ticks([-top, -inner, 0, inner, top])
    bar.set_ticklabels([f"{x:.2g}" for x in (-top, -inner, 0, inner, top)])
    bar.ax.minorticks_off()
    bar.ax.tick_params(labelsize=8)
    bar.ax.set_visible(not none)  # hidden, not removed: equal panel sizes
