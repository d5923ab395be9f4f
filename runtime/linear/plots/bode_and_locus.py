"""Plots of root loci over a parameter and of frequency responses."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array

from .figure import figure, finish_axes, require_columns, write

#: Largest number of curves with the legend inside the axes.
_INSIDE = 4
#: Line styles of curves of the same colour.
_DASHES = ("-", "--", ":", "-.")
#: Smallest distance of labels at curve ends, relative to the height of the axes.
_APART = 0.035
#: Whirl sense beyond which a mode is labelled forward or backward.
_WHIRLS = 0.05
#: Ratio of largest to smallest frequency above which the axis is logarithmic.
_DECADES = 30.0


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
    drawing = figure(6.0 if len(parts) > 1 else 4.5)
    axes = drawing.subplots(len(parts), 1, sharex=True, height_ratios=[2, 1][: len(parts)],
                         squeeze=False)[:, 0]  # fmt: skip
    for axis, (label, columns) in zip(axes, parts, strict=True):
        for k, (column, growth) in enumerate(zip(columns.T, growths.T, strict=True)):
            axis.plot(x, column, lw=1.2, **_curve_style(k))
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
    finish_axes(*axes)
    write(drawing, path)
    return drawing


def _curve_style(k: int) -> dict[str, Any]:
    """Colour and line style of curve `k`, distinct for 40 curves."""
    return {"color": f"C{k % 10}", "ls": _DASHES[k // 10 % len(_DASHES)]}


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
        axis.annotate(
            f"{k + 1}{_sense(whirl[known[-1], k])}", (end, y), fontsize=8, color=f"C{k % 10}",
            va="center", xytext=(4, 0), textcoords="offset points",
        )  # fmt: skip


def _sense(whirl: float) -> str:
    return " F" if whirl > _WHIRLS else " B" if whirl < -_WHIRLS else ""


def _add_legend(drawing: Any, axis: Any, labels: Sequence[str]) -> None:
    """Add a legend, outside the axes for many curves, none for a single unlabelled one."""
    if len(labels) > _INSIDE:
        drawing.legend(*axis.get_legend_handles_labels(), loc="outside right upper", fontsize=8,
                    frameon=False)  # fmt: skip
    elif len(labels) > 1 or labels[0]:
        axis.legend(fontsize=8, frameon=False)


def bode(
    frequency: Array,
    values: NDArray[Any],
    labels: Sequence[str],
    units: str,
    path: str | Path | None,
) -> Any:
    """Plot magnitude and phase over frequency, Hz, for each column of `values` (k, curves)."""
    require_columns(values)
    drawing = figure(6.0)
    above, below = drawing.subplots(2, 1, sharex=True, height_ratios=[3, 2])
    order = np.argsort(frequency, kind="stable")
    x = frequency[order]
    for k, (curve, label) in enumerate(zip(values[order].T, labels, strict=True)):
        above.loglog(x, np.abs(curve), lw=1.2, label=label, **_curve_style(k))
        below.semilogx(x, np.degrees(np.unwrap(np.angle(curve))), lw=1.2, **_curve_style(k))
    above.set_ylabel(f"magnitude in {units}" if units else "magnitude")
    below.set_ylabel("phase in degrees")
    below.set_xlabel("frequency in Hz")
    below.yaxis.set_major_locator(_right_angle_locator())
    _add_legend(drawing, above, labels)
    finish_axes(above, below)
    write(drawing, path)
    return drawing


def nyquist(values: NDArray[Any], labels: Sequence[str], path: str | Path | None) -> Any:
    """Plot responses (k, curves) in the complex plane."""
    require_columns(values)
    drawing = figure(5.5)
    axis = drawing.subplots()
    for k, (curve, label) in enumerate(zip(values.T, labels, strict=True)):
        axis.plot(curve.real, curve.imag, lw=1.2, label=label, **_curve_style(k))
    axis.axhline(0, color="0.7", lw=0.8)
    axis.axvline(0, color="0.7", lw=0.8)
    axis.set_aspect("equal", adjustable="datalim")
    axis.set_xlabel("real part")
    axis.set_ylabel("imaginary part")
    _add_legend(drawing, axis, labels)
    finish_axes(axis)
    write(drawing, path)
    return drawing


def unbalance(spin: Array, amplitude: Array, labels: Sequence[str], path: str | Path | None) -> Any:
    """Plot amplitudes (m, points), m, over spin (m,), rad/s."""
    drawing = figure(4.5)
    axis, order = drawing.subplots(), np.argsort(spin, kind="stable")
    for k, (curve, label) in enumerate(zip(amplitude[order].T, labels, strict=True)):
        axis.plot(spin[order], curve, lw=1.2, label=label, **_curve_style(k))
    if (amplitude > 0).any():
        axis.set_yscale("log")
    axis.set_xlabel("spin in rad/s")
    axis.set_ylabel("whirl amplitude in m")
    _add_legend(drawing, axis, labels)
    write(drawing, path)
    return drawing


def waterfall(
    frequency: Array, rows: Array, values: NDArray[Any], about: str, path: str | Path | None
) -> Any:
    """Plot magnitudes (rows, k) as colours, dB, over frequency, Hz, and another quantity."""
    drawing = figure(5.0)
    axis = drawing.subplots()
    with np.errstate(divide="ignore"):
        decibels = 20 * np.log10(np.abs(values))
    colours = axis.pcolormesh(frequency, rows, decibels, cmap="viridis", shading="nearest")
    drawing.colorbar(colours, ax=axis, label="magnitude in dB")
    if frequency.max() > _DECADES * frequency.min():
        axis.set_xscale("log")
    axis.set_xlabel("frequency in Hz")
    axis.set_ylabel(about)
    write(drawing, path)
    return drawing


def _right_angle_locator() -> Any:
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(nbins=6, steps=[1, 1.8, 3, 4.5, 9, 10])
