"""Plots of root loci, of frequency responses and of the matrices of a linear model."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array
from mstmm.errors import SceneError

from ...figures import curve_style, figure_style, new_figure, write_figure

if TYPE_CHECKING:
    from ..state_space import StateSpace

#: Largest number of curves with the legend inside the axes.
_INSIDE = 4
#: Smallest distance of labels at curve ends, relative to the height of the axes.
_APART = 0.035
#: Whirl sense beyond which a mode is labelled forward or backward.
_WHIRLS = 0.05
#: Ratio of largest to smallest frequency above which the axis is logarithmic.
_DECADES = 30.0


@figure_style()
def locus(
    parameter: str,
    x: Array,
    eigenvalues: NDArray[Any],
    path: str | Path | None,
    orders: Sequence[float],
    frame: str,
    whirl: Array,
) -> Any:
    """Plot frequencies over a parameter and, if any is nonzero, growth rates below.

    Unstable modes are red; `orders` adds lines of multiples of the parameter, dashed.
    """
    frequencies, growths = np.abs(np.imag(eigenvalues)) / (2 * np.pi), np.real(eigenvalues)
    label = "frequency in Hz"
    if orders or frame == "rotating":
        label += f", {frame} frame"
    parts = [(label, frequencies), ("growth in 1/s", growths)]
    if not np.nan_to_num(growths).any():
        parts = parts[:1]
    drawing = new_figure(7.5, 6.0 if len(parts) > 1 else 4.5)
    axes = drawing.subplots(len(parts), 1, sharex=True, height_ratios=[2, 1][: len(parts)],
                         squeeze=False)[:, 0]  # fmt: skip
    for axis, (label, columns) in zip(axes, parts, strict=True):
        for k, (column, growth) in enumerate(zip(columns.T, growths.T, strict=True)):
            axis.plot(x, column, **curve_style(k))
            axis.plot(x[growth > 0], column[growth > 0], ".", color="tab:red", ms=4, zorder=3)
        axis.set_ylabel(label)
    above = axes[0]
    top = np.nanmax(frequencies, initial=0.0)
    for order in orders:
        above.plot(x, order * x / (2 * np.pi), color="0.5", lw=0.8, ls="--")
        inside = x[order * x / (2 * np.pi) <= 1.02 * top]
        if len(inside):
            above.annotate(
                f"{order:g}x", (inside[-1], order * inside[-1] / (2 * np.pi)), color="0.5",
                fontsize=8, ha="right", va="center", xytext=(-4, 4), textcoords="offset points",
            )  # fmt: skip
    above.set_ylim(0, 1.05 * top if top > 0 else None)
    for axis, (_, columns) in zip(axes, parts, strict=True):
        _label_curves(axis, x, columns, whirl)
    for below in axes[1:]:
        below.axhline(0, color="0.7", lw=0.8)
    axes[-1].set_xlabel(parameter)
    return write_figure(drawing, path)


def _label_curves(axis: Any, x: Array, columns: Array, whirl: Array) -> None:
    """Label every curve at its end with its mode number from 1, and F or B for its whirl.

    F is forward whirl, B backward whirl.  Labels too close to an earlier one are left out.
    """
    low, high = axis.get_ylim()
    taken: list[tuple[float, float]] = []
    for k, column in enumerate(columns.T):
        known = np.flatnonzero(np.isfinite(column))
        if not len(known):
            continue
        end, y = x[known[-1]], column[known[-1]]
        if any(
            end == there and abs(y - other_y) < _APART * (high - low) for there, other_y in taken
        ):
            continue
        taken.append((end, y))
        sense = whirl[known[-1], k]
        kind = " F" if sense > _WHIRLS else " B" if sense < -_WHIRLS else ""
        axis.annotate(
            f"{k + 1}{kind}", (end, y), fontsize=8,
            color=curve_style(k)["color"], va="center", xytext=(4, 0), textcoords="offset points",
        )  # fmt: skip


def _add_legend(drawing: Any, axis: Any, labels: Sequence[str]) -> None:
    """Add a legend, outside the axes for many curves, none for a single unlabelled one."""
    if len(labels) > _INSIDE:
        drawing.legend(*axis.get_legend_handles_labels(), loc="outside right upper", fontsize=8)
    elif len(labels) > 1 or labels[0]:
        axis.legend(fontsize=8)


@figure_style()
def bode(
    frequency: Array,
    values: NDArray[Any],
    labels: Sequence[str],
    units: str,
    path: str | Path | None,
) -> Any:
    """Plot magnitude and phase over frequency, Hz, for each column of `values` (k, curves)."""
    from matplotlib.ticker import MaxNLocator

    require_columns(values)
    drawing = new_figure(7.5, 6.0)
    above, below = drawing.subplots(2, 1, sharex=True, height_ratios=[3, 2])
    order = np.argsort(frequency, kind="stable")
    x = frequency[order]
    for k, (curve, label) in enumerate(zip(values[order].T, labels, strict=True)):
        above.loglog(x, np.abs(curve), label=label, **curve_style(k))
        below.semilogx(x, np.degrees(np.unwrap(np.angle(curve))), **curve_style(k))
    above.set_ylabel(f"magnitude in {units}" if units else "magnitude")
    below.set_ylabel("phase in degrees")
    below.set_xlabel("frequency in Hz")
    below.yaxis.set_major_locator(MaxNLocator(nbins=6, steps=[1, 1.8, 3, 4.5, 9, 10]))
    for axis in (above, below):
        axis.grid(which="minor", lw=0.4)
    _add_legend(drawing, above, labels)
    return write_figure(drawing, path)


@figure_style()
def nyquist(values: NDArray[Any], labels: Sequence[str], path: str | Path | None) -> Any:
    """Plot responses (k, curves) in the complex plane."""
    require_columns(values)
    drawing = new_figure(7.5, 5.5)
    axis = drawing.subplots()
    for k, (curve, label) in enumerate(zip(values.T, labels, strict=True)):
        axis.plot(curve.real, curve.imag, label=label, **curve_style(k))
    axis.axhline(0, color="0.7", lw=0.8)
    axis.axvline(0, color="0.7", lw=0.8)
    axis.set_aspect("equal", adjustable="datalim")
    axis.set_xlabel("real part")
    axis.set_ylabel("imaginary part")
    _add_legend(drawing, axis, labels)
    return write_figure(drawing, path)


@figure_style()
def unbalance(spin: Array, amplitude: Array, labels: Sequence[str], path: str | Path | None) -> Any:
    """Plot amplitudes (m, points), m, over spin (m,), rad/s."""
    drawing = new_figure(7.5, 4.5)
    axis, order = drawing.subplots(), np.argsort(spin, kind="stable")
    for k, (curve, label) in enumerate(zip(amplitude[order].T, labels, strict=True)):
        axis.plot(spin[order], curve, label=label, **curve_style(k))
    if (amplitude > 0).any():
        axis.set_yscale("log")
    axis.set_xlabel("spin in rad/s")
    axis.set_ylabel("whirl amplitude in m")
    _add_legend(drawing, axis, labels)
    return write_figure(drawing, path)


@figure_style()
def waterfall(
    frequency: Array, rows: Array, values: NDArray[Any], about: str, path: str | Path | None
) -> Any:
    """Plot magnitudes (rows, k) as colours, dB, over frequency, Hz, and another quantity."""
    drawing = new_figure(7.5, 5.0)
    axis = drawing.subplots()
    axis.grid(False)
    with np.errstate(divide="ignore"):
        decibels = 20 * np.log10(np.abs(values))
    colours = axis.pcolormesh(frequency, rows, decibels, cmap="viridis", shading="nearest")
    drawing.colorbar(colours, ax=axis, label="magnitude in dB")
    if frequency.max() > _DECADES * frequency.min():
        axis.set_xscale("log")
    axis.set_xlabel("frequency in Hz")
    axis.set_ylabel(about)
    return write_figure(drawing, path)


def require_columns(values: NDArray[Any]) -> None:
    """Raise SceneError if `values` has no column to draw."""
    if not values.shape[1]:
        raise SceneError("nothing to draw: the scene has no degrees of freedom")


# --- matrices -------------------------------------------------------------------------------------

#: Largest number of coordinates with a name on every row.
_NAMED = 40
#: Size relative to the largest entry below which the colour scale is linear.
_SMALL = 1e-5
#: Inner ticks of the colour bar, relative to the largest entry.
_INNER = 1e-2


@figure_style()
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
    drawing = new_figure(len(drawn) * side + 2.4, side + 1.6)
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
    return write_figure(drawing, path)


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
    panel.grid(False)
    bar = drawing.colorbar(drawn, ax=panel, location="bottom", shrink=0.9, pad=0.02)
    inner = top * _INNER
    bar.set_ticks([-top, -inner, 0, inner, top])
    bar.set_ticklabels([f"{x:.2g}" for x in (-top, -inner, 0, inner, top)])
    bar.ax.minorticks_off()
    bar.ax.tick_params(labelsize=8)
    bar.ax.set_visible(not none)  # hidden, not removed: equal panel sizes
