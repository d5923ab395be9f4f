"""Pictures of flexible bodies: deflected shapes over time, deflection along a beam, modal energies.

The functions draw arrays into one matplotlib axes; nothing here knows a result.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Shapes of a strip, and the colour map of their times: dark to bright, readable in grey.
SHAPES, _COLOURS = 12, "viridis"

#: The bright end of the map is too pale on white.
_BRIGHTEST = 0.88

_REST = {"color": "#9a9a9a", "linewidth": 0.9, "linestyle": (0, (4, 3)), "zorder": 1}

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

    Where it is (nearly) one of the coordinate planes, that one, x before y before z; so a planar
    scene is drawn as it was written.
    """
    cloud = points.reshape(-1, 3) - points.reshape(-1, 3).mean(axis=0)
    spread = np.sqrt(np.mean(cloud**2, axis=0))
    across = int(np.argmin(spread))
    _, sizes, rows = np.linalg.svd(cloud, full_matrices=False)
    if sizes[2] < 1e-6 * sizes[0] or spread[across] < 0.3 * np.sort(spread)[1]:
        flat = sizes[1] > 1e-9 * sizes[0] or spread[across] < 1e-9 * spread.max()
        if flat and abs(rows[2][across]) > 0.9 or spread[across] < 0.3 * np.sort(spread)[1]:
            first, second = (np.eye(3)[k] for k in range(3) if k != across)
            return first, second
    first = rows[0] * _sign(rows[0])
    second = rows[1] * _sign(rows[1])
    return first, second


def _sign(v: Array) -> float:
    return 1.0 if v[int(np.argmax(np.abs(v)))] > 0 else -1.0


def direction(v: Array) -> str:
    """x, y or z for a unit vector along that axis; else its components."""
    k = int(np.argmax(np.abs(v)))
    if v[k] > _ALONG:
        return "xyz"[k]
    return "along (" + ", ".join(f"{c:.2f}" for c in v) + ")"


def draw_strip(figure: Any, axis: Any, strips: list[Strip], labels: list[tuple[str, Array]]) -> None:
    """Deflected shapes coloured by time, dashed where the undeformed body would lie.

    `labels` are fixed points (name, (3,)) to mark.
    """
    import matplotlib as mpl
    from matplotlib.collections import LineCollection

    everything = np.concatenate([s.deflected.reshape(-1, 3) for s in strips])
    first, second = plane(everything)
    basis = np.stack([first, second], axis=1)
    t = np.concatenate([s.times for s in strips])
    colours = mpl.colormaps[_COLOURS].resampled(256)
    colours = mpl.colors.ListedColormap(colours(np.linspace(0, _BRIGHTEST, 256)))
    norm = mpl.colors.Normalize(t.min(), t.max() if t.max() > t.min() else t.min() + 1)
    for strip in strips:
        rest = LineCollection(list(strip.at_rest @ basis), **_REST)
        axis.add_collection(rest)
        lines = LineCollection(
            list(strip.deflected @ basis), colors=colours(norm(strip.times)), linewidths=1.8,
            capstyle="round", zorder=2,
        )  # fmt: skip
        axis.add_collection(lines)
        tip = strip.deflected[:, -1] @ basis
        axis.scatter(*tip.T, s=14, c=colours(norm(strip.times)), zorder=3, linewidths=0)
    for name, place in labels:
        axis.plot(*(place @ basis), marker="o", color="#000000", markersize=4, zorder=4)
        axis.annotate(name, place @ basis, xytext=(5, 5), textcoords="offset points")
    axis.autoscale_view()
    axis.set_aspect("equal", adjustable="datalim")
    axis.set_xlabel(f"{direction(first)} in m")
    axis.set_ylabel(f"{direction(second)} in m")
    bar = figure.colorbar(
        mpl.cm.ScalarMappable(norm, colours), ax=axis, pad=0.02, fraction=0.05, aspect=25
    )
    bar.outline.set_visible(False)
    bar.set_label("time in s")


def draw_deflections(
    figure: Any, axis: Any, x: Array, times: Array, across: Array, name: str
) -> None:
    """Deflection (k, m) in m along a beam at k times, against the straight axis of its frame."""
    import matplotlib as mpl
    from matplotlib.collections import LineCollection

    colours = mpl.colormaps[_COLOURS].resampled(256)
    colours = mpl.colors.ListedColormap(colours(np.linspace(0, _BRIGHTEST, 256)))
    norm = mpl.colors.Normalize(
        times.min(), times.max() if times.max() > times.min() else times.min() + 1
    )
    axis.axhline(0.0, **_REST)
    curves = [np.stack([x, row], axis=1) for row in across]
    axis.add_collection(LineCollection(curves, colors=colours(norm(times)), linewidths=1.6))
    axis.autoscale_view()
    axis.margins(x=0.01)
    axis.set_xlabel("place along the beam in m")
    axis.set_ylabel(f"{name} in m")
    bar = figure.colorbar(
        mpl.cm.ScalarMappable(norm, colours), ax=axis, pad=0.02, fraction=0.05, aspect=25
    )
    bar.outline.set_visible(False)
    bar.set_label("time in s")


def draw_energies(axis: Any, t: Array, energies: Array, modes: tuple[str, ...]) -> None:
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
    axis.set_ylabel("energy of modes in J")
    axis.set_xlabel("time in s")
    handles, words = axis.get_legend_handles_labels()
    axis.legend(
        handles[::-1], words[::-1], loc="upper left", bbox_to_anchor=(1.0, 1.0), handlelength=1.2
    )


#: Modes with a layer of their own.
_MODES = 6
_LAYERS = ("#0072B2", "#56B4E9", "#009E73", "#E69F00", "#D55E00", "#CC79A7", "#bdbdbd")
