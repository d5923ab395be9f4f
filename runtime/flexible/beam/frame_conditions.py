"""Conditions of the floating frame of a beam, which remove a rigid part from each shape.

tangent at section s: no displacement and no rotation there; chord: no deflection at either end, no
axial displacement and no twist at the root; mean: int rho u = 0 and int rho r0 x u = 0 over the
undeformed mass.  Together with the rigid motions all three span the same motions.  The choice
therefore changes no linear results, and others only by terms beyond second order.

The same conditions apply to the second-order displacement and rotation (`second_order`).
"""

from __future__ import annotations

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError

from .beam_data import BeamData, Frame
from .gauss_quadrature import gauss_points, shape_density
from .shape_fields import Mode
from .shape_functions import Shape, ShiftedShape, section_rotation

#: Smallest norm of a shape without its rigid part, or without the shapes before it, relative to the
#: shape; less is rounding.
MIN_REMAINDER = 1e-9
#: Largest condition number of the mass matrix of the shapes, each scaled to norm one.
MAX_CONDITION = 1e11


def modes_in_frame(
    data: BeamData, direction: str, shapes: list[Shape], frame: Frame
) -> tuple[list[Mode], list[str]]:
    """Modes of one direction: shapes without rigid parts; and notes on dropped shapes.

    Raises SceneError for shapes that are linearly dependent or all rigid.
    """
    x, weight, inertia = _weighted_rule(data, direction, shapes)
    modes: list[Mode] = []
    deformations: list[Array] = []
    notes: list[str] = []
    basis: list[Array] = []
    for k, shape in enumerate(shapes, 1):
        name = f"{direction}{k}"
        a, b = _rigid_part(data, direction, shape, frame, x, weight, inertia)
        values = _weighted_field(data, shape, x, weight, inertia, a, b)
        scale = np.linalg.norm(_weighted_field(data, shape, x, weight, inertia))
        residual = values / scale
        if np.linalg.norm(residual) < MIN_REMAINDER:
            notes.append(f"shape {name} is a rigid motion; left out")
            continue
        residual = residual / np.linalg.norm(residual)
        for previous in basis * 2:  # the second pass removes rounding errors of the first
            residual = residual - previous * (previous @ residual)
        if np.linalg.norm(residual) < MIN_REMAINDER:
            notes.append(f"shape {name} is linearly dependent on the shapes before it; left out")
            continue
        basis.append(residual / np.linalg.norm(residual))
        deformations.append(values / np.linalg.norm(values))
        shifted = shape if a == 0.0 and b == 0.0 else ShiftedShape(shape, a, b)
        modes.append(Mode(f"{direction}{len(modes) + 1}", direction, shifted, frame_rotation=-b))
    if shapes and not modes:
        raise SceneError(
            f'beam "{data.name}": its {len(shapes)} shapes along {direction} are rigid motions; '
            "expected at least one that deforms the beam; give other shapes"
        )
    _check_condition(data, direction, deformations)
    return [_with_rotation_sign(mode, direction) for mode in modes], notes


def _weighted_field(
    data: BeamData, shape: Shape, x: Array, mass: Array, inertia: Array, a: float = 0.0,
    b: float = 0.0,
) -> Array:  # fmt: skip
    """Shape less a + b x at quadrature points, whose products are those of the mass matrix.

    With shear also the rotation of the sections: fast shapes of two kinds differ in it alone.
    """
    values = np.sqrt(mass) * (shape(x) - a - b * x)
    if not (data.has_shear and inertia.any()):
        return np.asarray(values)
    return np.append(values, np.sqrt(inertia) * (section_rotation(shape, x) - b))


def _with_rotation_sign(mode: Mode, direction: str) -> Mode:
    """Mode with the sign of its frame rotation: v' about z, -w' about y."""
    if direction == "z" and mode.frame_rotation:
        return Mode(mode.name, direction, mode.shape, -mode.frame_rotation)
    return mode if direction in ("y", "z") else Mode(mode.name, direction, mode.shape)


def _check_condition(data: BeamData, direction: str, deformations: list[Array]) -> None:
    if not deformations:
        return
    singular = np.linalg.svd(np.array(deformations), compute_uv=False)
    condition = (singular[0] / max(singular[-1], 1e-300)) ** 2
    if condition > MAX_CONDITION:
        raise SceneError(
            f'beam "{data.name}": its {len(deformations)} shapes along {direction} are linearly '
            f"dependent (mass matrix condition {condition:.1e}, limit {MAX_CONDITION:.0e}); use "
            "fewer or more distinct shapes"
        )


def _weighted_rule(
    data: BeamData, direction: str, shapes: list[Shape]
) -> tuple[Array, Array, Array]:
    """Quadrature points x (m), mass (kg) and rotary inertia (kg m^2) at them, in one direction."""
    places = np.unique([*data.breaks, *(b for shape in shapes for b in shape.breaks)])
    places = places[(places >= 0) & (places <= data.length)]
    x, w = gauss_points(places, shape_density(shapes))
    mass, yy, zz = data.inertia[:, data.piece(x)]
    if direction == "twist":
        polar = yy + zz
        return x, w * (polar if polar.all() else np.ones_like(polar)), np.zeros_like(w)
    rotary = {"y": yy, "z": zz}.get(direction, np.zeros_like(w))
    return x, w * mass, w * rotary


def _rigid_part(
    data: BeamData, direction: str, shape: Shape, frame: Frame, x: Array, mass: Array,
    inertia: Array,
) -> tuple[float, float]:  # fmt: skip
    """Coefficients a, b of the rigid part a + b x that the frame removes."""
    bends = direction in ("y", "z")
    origin = frame.x if frame.kind == "tangent" else 0.0
    if frame.kind == "tangent" or (frame.kind == "chord" and not bends):
        place = np.array([origin])
        value = float(shape(place)[0])
        slope = float(section_rotation(shape, place)[0]) if bends else 0.0
        return _without_rounding(shape, data, value - slope * origin, slope)
    if frame.kind == "chord":
        root_value, tip_value = shape(np.array([0.0, data.length]))
        slope = float(tip_value - root_value) / data.length
        return _without_rounding(shape, data, float(root_value), slope)
    values = shape(x)
    if not bends:
        return _without_rounding(shape, data, float(mass @ values) / float(mass.sum()), 0.0)
    slopes = section_rotation(shape, x) if data.rotary else np.zeros_like(x)
    matrix = np.array([[mass.sum(), mass @ x], [mass @ x, mass @ x**2 + inertia.sum()]])
    right = np.array([mass @ values, mass @ (x * values) + inertia @ slopes])
    a, b = np.linalg.solve(matrix, right)
    return _without_rounding(shape, data, float(a), float(b))


def _without_rounding(shape: Shape, data: BeamData, a: float, b: float) -> tuple[float, float]:
    """a, b with rounding errors set to zero, so that shapes that fit the frame stay unchanged."""
    x = np.linspace(0.0, data.length, 33)
    scale = float(np.abs(shape(x)).max())
    slope_scale = max(float(np.abs(shape(x, 1)).max()), scale / data.length)
    return (a if abs(a) > 1e-13 * scale else 0.0), (b if abs(b) > 1e-13 * slope_scale else 0.0)
