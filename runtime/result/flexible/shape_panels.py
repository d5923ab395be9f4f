"""Shape panels of a plot: "shape", "blade.shape", "blade.deflection"."""

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

from ..plotting.curve_interpolation import curve
from . import motion as observe
from .plot_shapes import (
    MAX_SHAPES,
    Strip,
    draw_deflections,
    draw_energies,
    draw_strip,
    shape_samples,
    strip_height,
)

if TYPE_CHECKING:
    from ..result_record import Record


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
        if body.shapes is not None:
            yield f"{name}.deflection"
        yield f"{name}.modal_energy"


def shape_panel(result: Record, name: str) -> ShapePanel | None:
    """Shape panel of this name; None if there is none."""
    if name not in panel_names(result):
        return None
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
    if body.shapes is not None:
        x = np.linspace(0.0, body.shapes.length, _STATION_COUNT)
        local = np.zeros((len(x), 3))
        local[:, 0] = x
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
    length = observe.shapes_of(motion.body, "deflection").length
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
