"""Floating frames of a beam: the rigid part that each shape must lose so that the frame is there.

tangent at section s: no displacement and no rotation there; chord: no deflection at either end, no
axial displacement and no twist at the root; mean: int rho u = 0 and int rho r0 x u = 0 over the
undeformed mass.  All three span the same motions together with the rigid ones, so that the choice
changes neither linear results nor, but for terms beyond second order, any others.

The same conditions hold for what bending and twist displace and turn to second order
(`second_order`).
"""

from __future__ import annotations

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError

from .beam_data import BeamData
from .frame_location import Frame
from .gauss_quadrature import density_of, gauss_between
from .shape_fields import Mode
from .shape_functions import Shape, ShiftedShape

#: What is left of a shape without its rigid part, or without the shapes before it, as a share of
#: its size; less is rounding.
NOTHING_LEFT = 1e-9
#: Largest condition number of the shapes' mass matrix, each shape scaled to one.
WORST_CONDITION = 1e11


def in_frame(
    data: BeamData, direction: str, shapes: list[Shape], frame: Frame
) -> tuple[list[Mode], list[str]]:
    """(modes, notes): the shapes without their rigid parts; those of which nothing is left go.

    Raises SceneError for shapes that cannot be told apart.
    """
    x, weight, inertia = _rule(data, direction, shapes)
    modes: list[Mode] = []
    kept: list[Array] = []
    notes: list[str] = []
    basis: list[Array] = []
    for k, shape in enumerate(shapes, 1):
        name = f"{direction}{k}"
        a, b = _rigid_part(data, direction, shape, frame, x, weight, inertia)
        values = np.sqrt(weight) * (shape(x) - a - b * x)
        size = np.linalg.norm(np.sqrt(weight) * shape(x))
        rest = values / size
        if np.linalg.norm(rest) < NOTHING_LEFT:
            notes.append(f"shape {name} is a rigid motion and was left out")
            continue
        rest = rest / np.linalg.norm(rest)
        for known in basis * 2:  # twice: once more removes what rounding left
            rest = rest - known * (known @ rest)
        if np.linalg.norm(rest) < NOTHING_LEFT:
            notes.append(f"shape {name} is a sum of the shapes before it and was left out")
            continue
        basis.append(rest / np.linalg.norm(rest))
        kept.append(values / np.linalg.norm(values))
        moved = shape if a == 0.0 and b == 0.0 else ShiftedShape(shape, a, b)
        modes.append(Mode(f"{direction}{len(modes) + 1}", direction, moved, turned=-b))
    if shapes and not modes:
        raise SceneError(
            f'beam "{data.name}": its {len(shapes)} shapes along {direction} are rigid motions; '
            "expected at least one that deforms the beam; give other shapes"
        )
    _check_condition(data, direction, kept)
    return [_signed(mode, direction) for mode in modes], notes


def _signed(mode: Mode, direction: str) -> Mode:
    """The frame's rotation about z goes with v', that about y with -w'."""
    if direction == "z" and mode.turned:
        return Mode(mode.name, direction, mode.shape, -mode.turned)
    return mode if direction in ("y", "z") else Mode(mode.name, direction, mode.shape)


def _check_condition(data: BeamData, direction: str, kept: list[Array]) -> None:
    if not kept:
        return
    singular = np.linalg.svd(np.array(kept), compute_uv=False)
    condition = (singular[0] / max(singular[-1], 1e-300)) ** 2
    if condition > WORST_CONDITION:
        raise SceneError(
            f'beam "{data.name}": its {len(kept)} shapes along {direction} cannot be told apart '
            f"(condition of their mass matrix {condition:.1e}, expected below "
            f"{WORST_CONDITION:.0e}); give fewer shapes, or shapes that differ more"
        )


def _rule(data: BeamData, direction: str, shapes: list[Shape]) -> tuple[Array, Array, Array]:
    """(x, mass, inertia of turning sections) of a quadrature along the beam, per direction."""
    places = np.unique([*data.breaks, *(b for shape in shapes for b in shape.breaks)])
    places = places[(places >= 0) & (places <= data.length)]
    x, w = gauss_between(places, density_of(shapes))
    mass, yy, zz = data.inertia[:, data.piece(x)]
    if direction == "twist":
        polar = yy + zz
        return x, w * (polar if polar.all() else np.ones_like(polar)), np.zeros_like(w)
    turning = {"y": yy, "z": zz}.get(direction, np.zeros_like(w))
    return x, w * mass, w * turning


def _rigid_part(
    data: BeamData, direction: str, shape: Shape, frame: Frame, x: Array, mass: Array,
    inertia: Array,
) -> tuple[float, float]:  # fmt: skip
    """a, b of the rigid part a + b x that the frame takes away."""
    bends = direction in ("y", "z")
    at = frame.x if frame.kind == "tangent" else 0.0
    if frame.kind == "tangent" or (frame.kind == "chord" and not bends):
        place = np.array([at])
        value, slope = float(shape(place)[0]), float(shape(place, 1)[0]) if bends else 0.0
        return _clean(shape, data, value - slope * at, slope)
    if frame.kind == "chord":
        first, last = shape(np.array([0.0, data.length]))
        return _clean(shape, data, float(first), float(last - first) / data.length)
    values = shape(x)
    if not bends:
        return _clean(shape, data, float(mass @ values) / float(mass.sum()), 0.0)
    turned = shape(x, 1) if data.rotary else np.zeros_like(x)
    matrix = np.array([[mass.sum(), mass @ x], [mass @ x, mass @ x**2 + inertia.sum()]])
    right = np.array([mass @ values, mass @ (x * values) + inertia @ turned])
    a, b = np.linalg.solve(matrix, right)
    return _clean(shape, data, float(a), float(b))


def _clean(shape: Shape, data: BeamData, a: float, b: float) -> tuple[float, float]:
    """Rounding noise as exact zeros, so that shapes that fit the frame are left as they are."""
    x = np.linspace(0.0, data.length, 33)
    size = float(np.abs(shape(x)).max())
    steep = max(float(np.abs(shape(x, 1)).max()), size / data.length)
    return (a if abs(a) > 1e-13 * size else 0.0), (b if abs(b) > 1e-13 * steep else 0.0)
