"""Shape panels of a plot: "shape", "blade.shape", "blade.deflection".

Deflected shapes, deflection along a beam and modal energies are drawn into one matplotlib axes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.scene import split_reference

from ..plotting.panels import curve
from . import motion as observe

if TYPE_CHECKING:
    from ..result_record import Record

# --- drawing of arrays ----------------------------------------------------------------------------

#: Number of shapes in a strip, and the colour map of their times: dark to bright, readable in grey.
MAX_SHAPES, _COLOUR_MAP = 12, "viridis"

#: The bright end of the map is too pale on white.
_MAX_BRIGHTNESS = 0.88

_REST_STYLE: dict[str, Any] = {
    "color": "#9a9a9a",
    "linewidth": 0.9,
    "linestyle": (0, (4, 3)),
    "zorder": 1,
}

_RIGID_STYLE: dict[str, Any] = {"color": "#b9b9b9", "linewidths": 1.4, "zorder": 2}

#: An inertial direction is named if an axis of the plot is aligned with it within this.
_MIN_ALIGNMENT = 1 - 1e-6


@dataclass(frozen=True)
class Strip:
    """Shapes of one body at k times: deflected and undeformed in its frame, (k, m, 3) m."""

    name: str
    times: Array
    deflected: Array
    at_rest: Array


def shape_samples(t: Array, count: int = MAX_SHAPES) -> NDArray[np.int64]:
    """Indices of `count` samples spread evenly over time, including the first and last."""
    targets = np.linspace(t[0], t[-1], max(2, count))
    right = np.clip(np.searchsorted(t, targets), 1, max(1, len(t) - 1))
    left = right - 1
    right = np.minimum(right, len(t) - 1)
    nearest = np.where(targets - t[left] < t[right] - targets, left, right)
    nearest[0], nearest[-1] = 0, len(t) - 1
    return np.unique(nearest)


def principal_plane(points: Array) -> tuple[Array, Array]:
    """Unit vectors (3,), two, spanning the plane in which points (..., 3) spread most.

    A coordinate plane if the points are close to one, so that a planar scene is drawn as written;
    otherwise the principal plane. Points that are not finite are ignored.
    """
    cloud = _finite_points(points.reshape(-1, 3))
    if not len(cloud):
        return np.eye(3)[0], np.eye(3)[1]
    cloud = cloud - cloud.mean(axis=0)
    spread = np.sqrt(np.mean(cloud**2, axis=0))
    normal_index = int(
        np.argmin(spread[::-1])
    )  # the last of equal ones: y up, z towards the reader
    normal_index = 2 - normal_index
    if (
        spread[normal_index] <= _MAX_FLATNESS * np.sort(spread)[1]
        or np.sort(spread)[1] <= 1e-9 * spread.max()
    ):
        first, second = (np.eye(3)[k] for k in range(3) if k != normal_index)
        return first, second
    rows = np.linalg.svd(cloud, full_matrices=False)[2]
    return rows[0] * _dominant_sign(rows[0]), rows[1] * _dominant_sign(rows[1])


#: Points count as planar if their spread normal to the plane is at most this part of that within.
_MAX_FLATNESS = 0.3


def _dominant_sign(v: Array) -> float:
    return 1.0 if v[int(np.argmax(np.abs(v)))] > 0 else -1.0


def direction_label(v: Array) -> str:
    """Label x, y or z of a unit vector along that axis; otherwise its components."""
    k = int(np.argmax(np.abs(v)))
    if v[k] > _MIN_ALIGNMENT:
        return "xyz"[k]
    return "along (" + ", ".join(f"{c:.2f}" for c in v) + ")"


def _finite_points(points: Array) -> Array:
    """Finite points among (n, 3): samples may be beyond the model."""
    return points[np.isfinite(points).all(axis=1)]


def strip_height(strips: list[Strip]) -> float:
    """Height in inches of a panel of the usual width in which these shapes fill the axes."""
    cloud = _finite_points(np.concatenate([s.deflected.reshape(-1, 3) for s in strips]))
    if not len(cloud):
        return _MIN_HEIGHT + _LABEL_HEIGHT
    first, second = (float(np.ptp(cloud @ axis)) for axis in principal_plane(cloud))
    return (
        float(np.clip(_AXES_WIDTH * second / max(first, 1e-300), _MIN_HEIGHT, _MAX_HEIGHT))
        + _LABEL_HEIGHT
    )


#: Inches: width of a strip's axes, their least and largest height, height of the labels.
_AXES_WIDTH, _MIN_HEIGHT, _MAX_HEIGHT, _LABEL_HEIGHT = 5.6, 1.2, 4.6, 0.6


def draw_strip(
    figure: Any, axis: Any, strips: list[Strip], rigid: list[Array], ground: list[Array]
) -> None:
    """Draw deflected shapes coloured by time, and undeformed bodies dashed.

    `rigid` are lines (k, 2, 3) of rigid bodies at the same times, `ground` points (3,) to mark.
    """
    from matplotlib.collections import LineCollection

    points = np.concatenate([s.deflected.reshape(-1, 3) for s in strips])
    first, second = principal_plane(points)
    basis = np.stack([first, second], axis=1)
    colours, norm = _time_colours(np.concatenate([s.times for s in strips]))
    for lines in rigid:
        axis.add_collection(LineCollection(list(lines @ basis), **_RIGID_STYLE))
    for strip in strips:
        axis.add_collection(LineCollection(list(strip.at_rest @ basis), **_REST_STYLE))
        shade = colours(norm(strip.times))
        axis.add_collection(
            LineCollection(
                list(strip.deflected @ basis), colors=shade, linewidths=1.8, capstyle="round",
                zorder=3,
            )
        )  # fmt: skip
        axis.scatter(*(strip.deflected[:, -1] @ basis).T, s=12, c=shade, zorder=4, linewidths=0)
    for position in ground:
        axis.plot(*(position @ basis), marker="s", color="#000000", markersize=4.5, zorder=5)
    axis.autoscale_view()
    axis.set_aspect("equal", adjustable="datalim")
    axis.set_xlabel(f"{direction_label(first)} in m")
    axis.set_ylabel(f"{direction_label(second)} in m")
    _draw_colour_bar(figure, axis, colours, norm)


def draw_deflections(
    figure: Any, axis: Any, x: Array, times: Array, across: Array, name: str
) -> None:
    """Draw deflections (k, m) in m along a beam at k times, with the undeformed axis."""
    from matplotlib.collections import LineCollection

    colours, norm = _time_colours(times)
    axis.axhline(0.0, **_REST_STYLE)
    curves = [np.stack([x, row], axis=1) for row in across]
    axis.add_collection(LineCollection(curves, colors=colours(norm(times)), linewidths=1.6))
    axis.autoscale_view()
    axis.margins(x=0.01)
    axis.set_xlabel("position along the beam in m")
    axis.set_ylabel(f"{name} in m")
    _draw_colour_bar(figure, axis, colours, norm)


def _time_colours(times: Array) -> tuple[Any, Any]:
    """Colour map of the times, and the normalisation of times for it."""
    import matplotlib as mpl

    colour_map = mpl.colormaps[_COLOUR_MAP]
    colours = mpl.colors.ListedColormap(colour_map(np.linspace(0, _MAX_BRIGHTNESS, 256)))
    first, last = float(times.min()), float(times.max())
    return colours, mpl.colors.Normalize(first, last if last > first else first + 1)


def _draw_colour_bar(figure: Any, axis: Any, colours: Any, norm: Any) -> None:
    import matplotlib as mpl

    mappable = mpl.cm.ScalarMappable(norm, colours)
    bar = figure.colorbar(mappable, ax=axis, pad=0.02, fraction=0.05, aspect=25)
    bar.outline.set_visible(False)
    bar.set_label("time in s")


def draw_energies(axis: Any, t: Array, energies: Array, modes: tuple[str, ...], name: str) -> None:
    """Draw the energy shares (n, modes) in J over time as stacked layers, the largest lowest."""
    order = np.argsort(-energies.max(axis=0, initial=0.0), kind="stable")[:_MAX_LAYERS]
    other_modes = np.setdiff1d(np.arange(len(modes)), order)
    layers = [energies[:, k] for k in order]
    names = [modes[k] for k in order]
    if len(other_modes):
        layers.append(energies[:, other_modes].sum(axis=1))
        names.append(f"{len(other_modes)} more")
    axis.stackplot(t, *layers, labels=names, colors=_LAYER_COLOURS, linewidth=0)
    axis.margins(x=0.01)
    axis.set_ylim(bottom=0.0)
    axis.set_ylabel(f"modal energy\nof {name} in J")
    handles, texts = axis.get_legend_handles_labels()
    axis.legend(
        handles[::-1], texts[::-1], loc="upper left", bbox_to_anchor=(1.0, 1.0), handlelength=1.2
    )


#: Largest number of modes with a separate layer.
_MAX_LAYERS = 6
_LAYER_COLOURS = ("#0072B2", "#56B4E9", "#009E73", "#E69F00", "#D55E00", "#CC79A7", "#bdbdbd")


# --- panels of a result ---------------------------------------------------------------------------

#: Points along a beam in a plot.
_STATION_COUNT = 61

#: Largest number of bodies in one plot; more would hide each other.
_MAX_BODIES = 60


@dataclass(frozen=True)
class ShapePanel:
    """Panel of shapes: `draw(figure, axes)`, height in inches, and whether x is the time."""

    draw: Callable[[Any, Any], None]
    height: float
    over_time: bool = False


def panel_names(result: Record) -> Iterator[str]:
    """Names of all shape panels of a result."""
    bodies = result.model.flexible_bodies
    if bodies:
        yield "shape"
    for name, body in bodies.items():
        yield f"{name}.shape"
        if body.has_axis:
            yield f"{name}.deflection"
        yield f"{name}.modal_energy"


def shape_panel(result: Record, name: str) -> ShapePanel:
    """Shape panel of a name, one of `panel_names`."""
    body, kind = split_reference(name) if "." in name else ("", name)
    if kind == "shape":
        return _strip_panel(result, [body] if body else None)
    if kind == "deflection":
        return ShapePanel(partial(_draw_body_deflections, result, body), 2.6)
    return ShapePanel(partial(_draw_body_energies, result, body), 2.3, over_time=True)


def _drawn_samples(result: Record) -> NDArray[np.int64]:
    """Indices of the samples to draw; SceneError if there are none."""
    valid_samples = np.flatnonzero(np.isfinite(result.q).all(axis=1))
    if not len(valid_samples):
        raise SceneError("no shapes to draw: the run has no samples; give other output times")
    return valid_samples[shape_samples(result.t[valid_samples], MAX_SHAPES)]


def _strip_panel(result: Record, bodies: list[str] | None) -> ShapePanel:
    body_names = list(result.model.flexible_bodies) if bodies is None else bodies
    samples = _drawn_samples(result)
    strips = [_body_strip(result, name, samples) for name in body_names[:_MAX_BODIES]]
    rigid = [] if bodies is not None else _rigid_lines(result, samples)
    scene = result.model.scene
    ground = [np.array(hinge.position) for hinge in scene.hinge if hinge.inboard == "ground"]
    marks = ground if bodies is None else []
    height = strip_height(strips)
    return ShapePanel(lambda figure, axis: draw_strip(figure, axis, strips, rigid, marks), height)


def _body_strip(result: Record, name: str, some: NDArray[np.int64]) -> Strip:
    motion = result._flexible.motion(name).select_samples(some)
    body = motion.body
    if body.has_axis:
        x = np.linspace(0.0, motion.length, _STATION_COUNT)
        local = observe.axis_at_rest(motion, x)
        deflected = observe.deflected_axis(motion, x)
    else:
        local = np.array([port.position for port in body.ports.values()])
        ends = [result.position(f"{name}.{end}")[some] for end in body.ports]
        deflected = np.stack(ends, axis=1)
    rest = motion.position[:, None] + motion.outward(np.broadcast_to(local, deflected.shape))
    return Strip(name, motion.t, deflected, rest)


def _rigid_lines(result: Record, some: NDArray[np.int64]) -> list[Array]:
    """Lines (k, 2, 3) from the origins of rigid bodies to their ends."""
    lines: list[Array] = []
    for body in result.model.scene.body[:_MAX_BODIES]:
        origin = result.position(body.name)[some]
        for end in body.ends:
            lines.append(np.stack([origin, result.position(f"{body.name}.{end}")[some]], axis=1))
    return lines


def _draw_body_deflections(result: Record, name: str, figure: Any, axis: Any) -> None:
    motion = result._flexible.motion(name).select_samples(_drawn_samples(result))
    length = motion.length
    x = np.linspace(0.0, length, _STATION_COUNT)
    displacement = observe.deflection(motion, x)
    k = 1 + int(np.argmax(np.abs(displacement[:, :, 1:]).max(axis=(0, 1))))
    draw_deflections(
        figure, axis, x, motion.t, displacement[:, :, k], f"deflection of {name}\nalong {'xyz'[k]}"
    )


def _draw_body_energies(result: Record, name: str, figure: Any, axis: Any) -> None:
    body = result.model.flexible_bodies[name]
    t, energies = curve(result.t, result.quantity(f"{name}.modal_energy"))
    draw_energies(axis, t, np.maximum(energies, 0.0), body.modes, name)
