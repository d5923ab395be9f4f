"""Plots of modes: shapes of the scene, and eigenvalues in the complex plane."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array

from .figure import figure, finish_axes, require_columns, write
from .wireframe import Outline, deformed_outlines

if TYPE_CHECKING:
    from ..linear_equations import LinearEquations

Complex = NDArray[np.complex128]

#: Largest displacement drawn, relative to the size of the scene.
_PART = 0.15
#: Largest number of hinges drawn as dots; largest number drawn as large dots, and also at rest,
#: where more dots would hide the shape.
_DOTTED, _FEW = 60, 12
_BLUE, _GREY, _RED = "#0072B2", "#9a9a9a", "#D55E00"
#: Number of eigenvalues with a label; damping ratios of the lines of constant damping.
_NUMBERED, _RATIOS = 40, (0.01, 0.05, 0.2)
#: Ratio of largest to smallest frequency above which both axes are logarithmic.
_SPREAD = 50.0
#: Distance, relative to the axes, below which only the first of several eigenvalues is labelled.
_CLOSE = 0.03


def shapes(
    linear: LinearEquations,
    eigenvalues: Complex,
    shapes: NDArray[Any],
    which: Sequence[int],
    path: str | Path | None,
) -> Any:
    """Plot a panel for each mode of `which`: the scene at rest (grey, dashed) and displaced."""
    require_columns(shapes)
    columns = min(3, len(which)) if len(which) != 4 else 2
    rows = -(-len(which) // columns)
    drawing = figure(2.6 * rows + 0.3, 3.4 * columns if columns > 1 else 5.0)
    panels = drawing.subplots(rows, columns, squeeze=False).ravel()
    rest, moved = deformed_outlines(linear, np.real(shapes[:, list(which)]), _PART)
    for panel, k, outline in zip(panels, which, moved, strict=False):
        _panel(panel, rest, outline)
        panel.set_title(f"{k + 1}: {eigenvalue_text(complex(eigenvalues[k]))}", fontsize=9)
    for panel in panels[len(which) :]:
        panel.set_visible(False)
    write(drawing, path)
    return drawing


def eigenvalue_text(value: complex) -> str:
    """Text of frequency and damping ratio, or of growth rate, for an eigenvalue, 1/s."""
    if value == 0:
        return "0 Hz, unrestrained"
    if value.imag == 0:
        return f"{'growth' if value.real > 0 else 'decay'} rate {abs(value.real):.4g} 1/s"
    text = f"{value.imag / (2 * np.pi):.4g} Hz"
    if value.real > 0:
        return f"{text}, growth rate {value.real:.3g} 1/s"
    return text + (f", damping {-value.real / abs(value):.2%}" if value.real else "")


def _panel(axis: Any, rest: Outline, moved: Outline) -> None:
    across, up = _plane(rest.points, moved.points)
    _draw(axis, rest, (across, up), _GREY, "--", 0.9)
    _draw(axis, moved, (across, up), _BLUE, "-", 1.6)
    axis.plot(rest.ground[:, across], rest.ground[:, up], "^", color="0.2", ms=6, zorder=4)
    if not np.abs(moved.points - rest.points).max(initial=0):
        axis.text(0.5, 0.03, "rotation about its own axis", transform=axis.transAxes, ha="center",
                  fontsize=8, color="0.4")  # fmt: skip
    axis.set_aspect("equal", adjustable="datalim")
    axis.margins(0.08)
    axis.set_xlabel(f"{'xyz'[across]} in m", fontsize=8)
    axis.set_ylabel(f"{'xyz'[up]} in m", fontsize=8)
    axis.tick_params(labelsize=7)
    axis.locator_params(nbins=5)
    finish_axes(axis)


def _draw(
    axis: Any, outline: Outline, plane: tuple[int, int], colour: str, style: str, width: float
) -> None:
    from matplotlib.collections import LineCollection

    columns = list(plane)
    lines = [line[:, columns] for line in outline.bodies]
    axis.add_collection(
        LineCollection(lines, colors=colour, linestyles=style, linewidths=width, zorder=2)
    )
    springs = [line[:, columns] for line in outline.springs]
    axis.add_collection(LineCollection(springs, colors=colour, linestyles=":", linewidths=1.0))
    few, at_rest = len(outline.joints) <= _FEW, style == "--"
    if few or (len(outline.joints) <= _DOTTED and not at_rest):
        size = 3.5 if few else 2.0
        hollow: dict[str, Any] = {"mfc": "none", "ms": 6.5} if at_rest else {"ms": size}
        axis.plot(*outline.joints[:, columns].T, "o", color=colour, zorder=3, **hollow)
    axis.update_datalim(outline.points[:, columns])
    axis.autoscale_view()


def _plane(rest: Array, moved: Array) -> tuple[int, int]:
    """Axes of the plane to draw, in the order x, y, z.

    These are the axis of the largest displacement, and of the others that with the largest extent
    of the scene; for a point-like scene, of its displacement.
    """
    moves = np.abs(moved - rest).max(axis=0)
    reach = np.ptp(rest, axis=0)
    first = int(np.argmax(moves)) if moves.any() else int(np.argmax(reach))
    other_axes = [k for k in range(3) if k != first]
    second = max(other_axes, key=lambda k: (round(reach[k], 12), moves[k]))
    low, high = sorted((first, second))
    return low, high


def eigenvalues(values: Complex, path: str | Path | None) -> Any:
    """Plot eigenvalues in the complex plane; unstable ones are red."""
    require_columns(values[None])
    drawing = figure(5.0)
    axis = drawing.subplots()
    growing = values.real > 0
    for some, colour in ((~growing, _BLUE), (growing, _RED)):
        axis.plot(values[some].real, values[some].imag, "x", color=colour, ms=7, mew=1.6)
    wide = _frequency_spread(values.imag) > _SPREAD
    (_use_log_axes if wide else _widen_limits)(axis, values.real, values.imag)
    for k in _separate_indices(axis, values[:_NUMBERED]):
        position = values[k].real, values[k].imag
        axis.annotate(str(k + 1), position, xytext=(6, 3), fontsize=8, textcoords="offset points",
                      color="0.35")  # fmt: skip
    if (values.real < 0).any():
        _rays(axis, _decade_below(values.imag[values.imag > 0]) if wide else 0.0)
    axis.axvline(0, color="0.4", lw=0.9)
    axis.set_xlabel("growth in 1/s")
    axis.set_ylabel("angular frequency in rad/s")
    finish_axes(axis)
    write(drawing, path)
    return drawing


def _frequency_spread(imaginary: Array) -> float:
    """Ratio of the largest to the smallest positive frequency."""
    positive = imaginary[imaginary > 0]
    return float(positive.max() / positive.min()) if len(positive) else 1.0


def _use_log_axes(axis: Any, real: Array, imaginary: Array) -> None:
    """Make both axes logarithmic, but linear below the decade of the smallest value."""
    slowest, least = _decade_below(imaginary[imaginary > 0]), _decade_below(np.abs(real[real != 0]))
    axis.set_xscale("symlog", linthresh=least)
    axis.set_yscale("symlog", linthresh=slowest)
    left, right = min(float(real.min()), 0.0), max(float(real.max()), 0.0)
    axis.set_xlim(2 * left - least, 2 * right + least)
    axis.set_ylim(-0.3 * slowest, 2 * float(imaginary.max()))


def _decade_below(numbers: Array) -> float:
    return float(10.0 ** np.floor(np.log10(numbers.min(initial=1.0))))


def _widen_limits(axis: Any, real: Array, imaginary: Array) -> None:
    """Set axis limits that include the imaginary axis."""
    top = max(float(imaginary.max(initial=0)), 0.0) or 1.0
    left, right = min(float(real.min()), 0.0), max(float(real.max()), 0.0)
    width = (right - left) or 0.1 * top
    axis.set_xlim(left - 0.1 * width, right + 0.15 * width)
    axis.set_ylim(-0.04 * top, 1.08 * top)


def _separate_indices(axis: Any, values: Complex) -> list[int]:
    """Indices of eigenvalues that do not overlap an earlier one in the plot."""
    positions = (axis.transScale + axis.transLimits).transform(
        np.column_stack([values.real, values.imag])
    )
    kept: list[int] = []
    for k, position in enumerate(positions):
        if all(np.abs(position - positions[j]).max() > _CLOSE for j in kept):
            kept.append(k)
    return kept


def _rays(axis: Any, slowest: float) -> None:
    """Draw lines of constant damping ratio across the plot.

    `slowest` is the frequency above which the axis is logarithmic, or 0 for a linear axis.
    """
    left, _ = axis.get_xlim()
    _, top = axis.get_ylim()
    for ratio in _RATIOS:
        slope = ratio / np.sqrt(1 - ratio**2)
        height = min(top, -left / slope)
        along = np.geomspace(slowest, height, 60) if slowest else np.array([0.0, height])
        axis.plot(-slope * along, along, color="0.8", lw=0.8, ls="--", zorder=0)
        if slowest or 0.12 * -left < slope * height:
            axis.annotate(
                f"{ratio:.0%}", (-slope * height, height), fontsize=8, color="0.5", ha="left",
                va="top", xytext=(3, -2), textcoords="offset points",
            )  # fmt: skip
