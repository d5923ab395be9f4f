"""Shape panels of a plot: "shape", "blade.shape", "blade.deflection"."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mstmm.arrays import Array
from mstmm.errors import SceneError
from mstmm.scene import split

from ..plotting.curves import curve
from . import motion as observe
from .plot_shapes import (
    SHAPES,
    Strip,
    draw_deflections,
    draw_energies,
    draw_strip,
    instants,
    strip_height,
)

if TYPE_CHECKING:
    from ..record import Record


#: Points along a beam in a picture.
_FINE = 61

#: Bodies in one picture; more would hide each other.
_BODIES = 60


@dataclass(frozen=True)
class Picture:
    """A panel: `draw(figure, axes)`, its height in inches, and whether x is the time."""

    draw: Callable[[Any, Any], None]
    height: float
    over_time: bool = False


def names(result: Record) -> Iterator[str]:
    """Names of all pictures of a result."""
    known = result.model.flexible
    if known:
        yield "shape"
    for name, body in known.items():
        yield f"{name}.shape"
        if body.shapes is not None:
            yield f"{name}.deflection"
        yield f"{name}.modal_energy"


def picture(result: Record, name: str) -> Picture | None:
    """The picture of this name, None if there is none."""
    if name not in names(result):
        return None
    body, what = split(name) if "." in name else ("", name)
    if what == "shape":
        return _shapes(result, [body] if body else None)
    if what == "deflection":
        return Picture(partial(_deflections, result, body), 2.6)
    return Picture(partial(_energies, result, body), 2.3, over_time=True)


def _good(result: Record) -> NDArray[np.int64]:
    """Samples to draw; SceneError if there is none."""
    good = np.flatnonzero(np.isfinite(result.q).all(axis=1))
    if not len(good):
        raise SceneError("there are no shapes to draw: the run has no sample; ask for other times")
    return good[instants(result.t[good], SHAPES)]


def _shapes(result: Record, bodies: list[str] | None) -> Picture:
    known = list(result.model.flexible) if bodies is None else bodies
    some = _good(result)
    strips = [_strip(result, name, some) for name in known[:_BODIES]]
    rigid = [] if bodies is not None else _rigid(result, some)
    scene = result.model.scene
    ground = [np.array(hinge.position) for hinge in scene.hinge if hinge.inboard == "ground"]
    marks = ground if bodies is None else []
    height = strip_height(strips)
    return Picture(lambda figure, axis: draw_strip(figure, axis, strips, rigid, marks), height)


def _strip(result: Record, name: str, some: NDArray[np.int64]) -> Strip:
    motion = result._flexible.motion(name).some(some)
    body = motion.body
    if body.shapes is not None:
        x = np.linspace(0.0, body.shapes.length, _FINE)
        local = np.zeros((len(x), 3))
        local[:, 0] = x
        deflected = observe.shape(motion, x)
    else:
        local = np.array([port.position for port in body.ports.values()])
        ends = [result.position(f"{name}.{end}")[some] for end in body.ports]
        deflected = np.stack(ends, axis=1)
    rest = motion.position[:, None] + motion.outward(np.broadcast_to(local, deflected.shape))
    return Strip(name, motion.t, deflected, rest)


def _rigid(result: Record, some: NDArray[np.int64]) -> list[Array]:
    """Lines (k, 2, 3) from the origins of rigid bodies to their ends."""
    found: list[Array] = []
    for body in result.model.scene.body[:_BODIES]:
        origin = result.position(body.name)[some]
        for end in body.ends:
            found.append(np.stack([origin, result.position(f"{body.name}.{end}")[some]], axis=1))
    return found


def _deflections(result: Record, name: str, figure: Any, axis: Any) -> None:
    motion = result._flexible.motion(name).some(_good(result))
    length = observe.shapes_of(motion.body, "deflection").length
    x = np.linspace(0.0, length, _FINE)
    moved = observe.deflection(motion, x)
    k = 1 + int(np.argmax(np.abs(moved[:, :, 1:]).max(axis=(0, 1))))
    draw_deflections(
        figure, axis, x, motion.t, moved[:, :, k], f"deflection of {name}\nalong {'xyz'[k]}"
    )


def _energies(result: Record, name: str, figure: Any, axis: Any) -> None:
    body = result.model.flexible[name]
    t, energies = curve(result.t, result.quantity(f"{name}.modal_energy"))
    draw_energies(axis, t, np.maximum(energies, 0.0), body.modes, name)
