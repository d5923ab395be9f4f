"""Pictures of linear models: motions over a parameter, and answers over the frequency."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mstmm.arrays import Array
from mstmm.errors import SceneError
from mstmm.extras import missing

from ..host.files import replacing

#: Frequencies that reach further than this stand on a logarithmic scale.
_DECADES = 30.0

_FORMATS = (".png", ".svg", ".pdf")


def figure(height: float = 4.5) -> Any:
    """An empty figure.  EnvironmentFailure without the extra."""
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise missing("plot", "a picture", error) from None
    return Figure(figsize=(7.5, height), layout="constrained")


def write(made: Any, path: Path | None) -> None:
    """The figure into a file; its ending says how.  SceneError for another ending."""
    if path is None:
        return
    if path.suffix.lower() not in _FORMATS:
        raise SceneError(f'picture "{path}": expected a name ending in {", ".join(_FORMATS)}')
    with replacing(path) as temporary:
        made.savefig(temporary, dpi=150, format=path.suffix[1:].lower())


def locus(
    parameter: str, x: Array, eigenvalues: NDArray[Any], path: Path | None, orders: Sequence[float]
) -> Any:
    """Frequencies above, growth below; what grows is red."""
    made = figure(6.0)
    above, below = made.subplots(2, 1, sharex=True, height_ratios=[2, 1])
    frequencies = np.abs(eigenvalues.imag) / (2 * np.pi)
    for frequency, growth in zip(frequencies.T, eigenvalues.real.T, strict=True):
        (line,) = above.plot(x, frequency, color="0.25", lw=1.2)
        below.plot(x, growth, color=line.get_color(), lw=1.2)
        unstable = growth > 0
        above.plot(x[unstable], frequency[unstable], ".", color="tab:red", ms=4)
        below.plot(x[unstable], growth[unstable], ".", color="tab:red", ms=4)
    top = np.nanmax(frequencies, initial=0.0)
    for order in orders:
        above.plot(x, order * x / (2 * np.pi), color="tab:blue", lw=0.8, ls="--")
        inside = x[order * x / (2 * np.pi) <= 1.02 * top]
        if len(inside):
            above.annotate(
                f"{order:g}x", (inside[-1], order * inside[-1] / (2 * np.pi)), color="tab:blue",
                fontsize=8, ha="left", va="center", xytext=(4, 0), textcoords="offset points",
            )  # fmt: skip
    above.set_ylim(0, 1.05 * top if top > 0 else None)
    above.set_ylabel("frequency in Hz")
    below.axhline(0, color="0.7", lw=0.8)
    if not eigenvalues.real.any():
        below.set_ylim(-1, 1)
    below.set_ylabel("growth in 1/s")
    below.set_xlabel(parameter)
    _settled(above, below)
    write(made, path)
    return made


def _refuse_none(values: NDArray[Any]) -> None:
    if not values.shape[1]:
        raise SceneError("nothing moves in this scene, so that there is nothing to draw")


def bode(
    frequency: Array, values: NDArray[Any], labels: Sequence[str], units: str, path: Path | None
) -> Any:
    """Magnitude above, phase below, over the frequency in Hz; a curve for each column of `values`
    (k, curves)."""
    _refuse_none(values)
    made = figure(6.0)
    above, below = made.subplots(2, 1, sharex=True, height_ratios=[3, 2])
    order = np.argsort(frequency, kind="stable")
    x = frequency[order]
    for curve, label in zip(values[order].T, labels, strict=True):
        above.loglog(x, np.abs(curve), lw=1.2, label=label)
        below.semilogx(x, np.degrees(np.unwrap(np.angle(curve))), lw=1.2)
    above.set_ylabel(f"magnitude in {units}" if units else "magnitude")
    below.set_ylabel("phase in degrees")
    below.set_xlabel("frequency in Hz")
    below.yaxis.set_major_locator(_every_right_angle())
    if len(labels) > 1 or labels[0]:
        above.legend(fontsize=8, frameon=False)
    _settled(above, below)
    write(made, path)
    return made


def nyquist(values: NDArray[Any], labels: Sequence[str], path: Path | None) -> Any:
    """Curves (k, curves) in the complex plane."""
    _refuse_none(values)
    made = figure(5.5)
    axis = made.subplots()
    for curve, label in zip(values.T, labels, strict=True):
        axis.plot(curve.real, curve.imag, lw=1.2, label=label)
    axis.axhline(0, color="0.7", lw=0.8)
    axis.axvline(0, color="0.7", lw=0.8)
    axis.set_aspect("equal", adjustable="datalim")
    axis.set_xlabel("real part")
    axis.set_ylabel("imaginary part")
    axis.legend(fontsize=8, frameon=False)
    _settled(axis)
    write(made, path)
    return made


def waterfall(
    frequency: Array, rows: Array, values: NDArray[Any], about: str, path: Path | None
) -> Any:
    """Magnitudes (rows, k) as colours over the frequency in Hz and another number."""
    made = figure(5.0)
    axis = made.subplots()
    with np.errstate(divide="ignore"):
        decibels = 20 * np.log10(np.abs(values))
    colours = axis.pcolormesh(frequency, rows, decibels, cmap="viridis", shading="nearest")
    made.colorbar(colours, ax=axis, label="magnitude in dB")
    if frequency.max() > _DECADES * frequency.min():
        axis.set_xscale("log")
    axis.set_xlabel("frequency in Hz")
    axis.set_ylabel(about)
    write(made, path)
    return made


def _every_right_angle() -> Any:
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(nbins=6, steps=[1, 1.8, 3, 4.5, 9, 10])


def _settled(*axes: Any) -> None:
    for axis in axes:
        axis.grid(alpha=0.3, which="both", lw=0.5)
        axis.spines[["top", "right"]].set_visible(False)
