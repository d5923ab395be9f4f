"""Pictures of flexible bodies: deflected shapes over time, deflection along a beam, modal energies.

The functions draw arrays into one matplotlib axes; nothing here knows a result.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mstmm.arrays import Array

#: Shapes of a strip, and the colour map of their times: dark to bright, readable in grey.
SHAPES, _COLOURS = 12, "viridis"

#: The bright end of the map is too pale on white.
_BRIGHTEST = 0.88

_REST: dict[str, Any] = {
    "color": "#9a9a9a",
    "linewidth": 0.9,
    "linestyle": (0, (4, 3)),
    "zorder": 1,
}

_RIGID: dict[str, Any] = {"color": "#b9b9b9", "linewidths": 1.4, "zorder": 2}

#: An inertial direction is named if a picture's axis lies along it up to this.
_ALONG = 1 - 1e-6


@dataclass(frozen=True)
class Strip:
    """Shapes of one body at k times: deflected and at rest in its floating frame, (k, m, 3) m."""

    name: str
    times: Array
    deflected: Array
    at_rest: Array


def instants(t: Array, count: int = SHAPES) -> NDArray[np.int64]:
    """Indices of `count` samples spread evenly over the time, first and last among them."""
    wanted = np.linspace(t[0], t[-1], max(2, count))
    right = np.clip(np.searchsorted(t, wanted), 1, max(1, len(t) - 1))
    left = right - 1
    right = np.minimum(right, len(t) - 1)
    nearer = np.where(wanted - t[left] < t[right] - wanted, left, right)
    nearer[0], nearer[-1] = 0, len(t) - 1
    return np.unique(nearer)


def plane(points: Array) -> tuple[Array, Array]:
    """Two unit vectors (3,) that span the plane in which points (..., 3) spread most.

    A coordinate plane where the points lie close to one, so that a planar scene is drawn as it was
    written; else the principal plane.  Points that are not finite do not count.
    """
    cloud = _finite(points.reshape(-1, 3))
    if not len(cloud):
        return np.eye(3)[0], np.eye(3)[1]
    cloud = cloud - cloud.mean(axis=0)
    spread = np.sqrt(np.mean(cloud**2, axis=0))
    across = int(np.argmin(spread[::-1]))  # of equal ones the last: y up, z towards the reader
    across = 2 - across
    if spread[across] <= _FLAT * np.sort(spread)[1] or np.sort(spread)[1] <= 1e-9 * spread.max():
        first, second = (np.eye(3)[k] for k in range(3) if k != across)
        return first, second
    rows = np.linalg.svd(cloud, full_matrices=False)[2]
    return rows[0] * _sign(rows[0]), rows[1] * _sign(rows[1])


#: Points count as lying in a plane if their spread across it is this part of that within.
_FLAT = 0.3


def _sign(v: Array) -> float:
    return 1.0 if v[int(np.argmax(np.abs(v)))] > 0 else -1.0


def direction(v: Array) -> str:
    """x, y or z for a unit vector along that axis; else its components."""
    k = int(np.argmax(np.abs(v)))
    if v[k] > _ALONG:
        return "xyz"[k]
    return "along (" + ", ".join(f"{c:.2f}" for c in v) + ")"


def _finite(points: Array) -> Array:
    """Those of the points (n, 3) that are numbers: samples may be beyond the model."""
    return points[np.isfinite(points).all(axis=1)]


def strip_height(strips: list[Strip]) -> float:
    """Height in inches of a panel of the usual width in which these shapes fill the axes."""
    cloud = _finite(np.concatenate([s.deflected.reshape(-1, 3) for s in strips]))
    if not len(cloud):
        return _LOWEST + _LABELS
    first, second = (float(np.ptp(cloud @ axis)) for axis in plane(cloud))
    return float(np.clip(_WIDTH * second / max(first, 1e-300), _LOWEST, _HIGHEST)) + _LABELS


#: Inches: axes of a strip, least and most height of its axes, room for its labels.
_WIDTH, _LOWEST, _HIGHEST, _LABELS = 5.6, 1.2, 4.6, 0.6


def draw_strip(
    figure: Any, axis: Any, strips: list[Strip], rigid: list[Array], ground: list[Array]
) -> None:
    """Deflected shapes coloured by time, dashed where the undeformed bodies would lie.

    `rigid` are lines (k, 2, 3) of rigid bodies at the same times, `ground` points (3,) to mark.
    """
    from matplotlib.collections import LineCollection

    everything = np.concatenate([s.deflected.reshape(-1, 3) for s in strips])
    first, second = plane(everything)
    basis = np.stack([first, second], axis=1)
    colours, norm = _scale(np.concatenate([s.times for s in strips]))
    for lines in rigid:
        axis.add_collection(LineCollection(list(lines @ basis), **_RIGID))
    for strip in strips:
        axis.add_collection(LineCollection(list(strip.at_rest @ basis), **_REST))
        shade = colours(norm(strip.times))
        axis.add_collection(
            LineCollection(
                list(strip.deflected @ basis), colors=shade, linewidths=1.8, capstyle="round",
                zorder=3,
            )
        )  # fmt: skip
        axis.scatter(*(strip.deflected[:, -1] @ basis).T, s=12, c=shade, zorder=4, linewidths=0)
    for place in ground:
        axis.plot(*(place @ basis), marker="s", color="#000000", markersize=4.5, zorder=5)
    axis.autoscale_view()
    axis.set_aspect("equal", adjustable="datalim")
    axis.set_xlabel(f"{direction(first)} in m")
    axis.set_ylabel(f"{direction(second)} in m")
    _bar(figure, axis, colours, norm)


def draw_deflections(
    figure: Any, axis: Any, x: Array, times: Array, across: Array, name: str
) -> None:
    """Deflection (k, m) in m along a beam at k times, against the straight axis of its frame."""
    from matplotlib.collections import LineCollection

    colours, norm = _scale(times)
    axis.axhline(0.0, **_REST)
    curves = [np.stack([x, row], axis=1) for row in across]
    axis.add_collection(LineCollection(curves, colors=colours(norm(times)), linewidths=1.6))
    axis.autoscale_view()
    axis.margins(x=0.01)
    axis.set_xlabel("place along the beam in m")
    axis.set_ylabel(f"{name} in m")
    _bar(figure, axis, colours, norm)


def _scale(times: Array) -> tuple[Any, Any]:
    """Colour map of the times, and what takes times to it."""
    import matplotlib as mpl

    whole = mpl.colormaps[_COLOURS]
    colours = mpl.colors.ListedColormap(whole(np.linspace(0, _BRIGHTEST, 256)))
    first, last = float(times.min()), float(times.max())
    return colours, mpl.colors.Normalize(first, last if last > first else first + 1)


def _bar(figure: Any, axis: Any, colours: Any, norm: Any) -> None:
    import matplotlib as mpl

    shown = mpl.cm.ScalarMappable(norm, colours)
    bar = figure.colorbar(shown, ax=axis, pad=0.02, fraction=0.05, aspect=25)
    bar.outline.set_visible(False)
    bar.set_label("time in s")


def draw_energies(axis: Any, t: Array, energies: Array, modes: tuple[str, ...], name: str) -> None:
    """Shares (n, modes) in J of the modes over time, one upon the other, the largest below."""
    order = np.argsort(-energies.max(axis=0, initial=0.0), kind="stable")[:_MODES]
    rest = np.setdiff1d(np.arange(len(modes)), order)
    layers = [energies[:, k] for k in order]
    names = [modes[k] for k in order]
    if len(rest):
        layers.append(energies[:, rest].sum(axis=1))
        names.append(f"{len(rest)} more")
    axis.stackplot(t, *layers, labels=names, colors=_LAYERS, linewidth=0)
    axis.margins(x=0.01)
    axis.set_ylim(bottom=0.0)
    axis.set_ylabel(f"modal energy\nof {name} in J")
    handles, words = axis.get_legend_handles_labels()
    axis.legend(
        handles[::-1], words[::-1], loc="upper left", bbox_to_anchor=(1.0, 1.0), handlelength=1.2
    )


#: Modes with a layer of their own.
_MODES = 6
_LAYERS = ("#0072B2", "#56B4E9", "#009E73", "#E69F00", "#D55E00", "#CC79A7", "#bdbdbd")
