"""Displacement and rotation of second order along a beam, -1/2 eta^T g eta, in its floating frame.

The rates along the beam are generated kernels (`derive.flexible.beam_second_order`); here they are
integrated, and the rigid motion that the choice of the floating frame leaves open is taken off: to
second order as to first, the frame is that of a section, of the chord or of the mean.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ..modal_body import Array
from . import kernels
from .gauss import antiderivatives
from .parts import slices

if TYPE_CHECKING:
    from .beam_shapes import BeamShapes
    from .frames import Frame


class SecondOrder:
    """g (6, n, n) at any section: displacement x, y, z in 1/m, rotation vector x, y, z."""

    def __init__(self, shapes: BeamShapes, frames: Mapping[str, Frame]) -> None:
        self.shapes = shapes
        self._rigid = np.zeros((6, shapes.n, shapes.n))
        if shapes.n:
            self._rigid = _rigid_motion(self, frames)

    def at(self, x: Array) -> Array:
        """(m, 6, n, n) at sections x (m,)."""
        found = self.from_root(x)
        shift, turn = self._rigid[:3], self._rigid[3:]
        found[:, :3] -= shift
        found[:, 1] -= x[:, None, None] * turn[2]
        found[:, 2] += x[:, None, None] * turn[1]
        found[:, 3:] -= turn
        return found

    def carried(self, g: Array) -> Array:
        """(m, 3, n, n) rotation that carries the sections' inertia: all of it with rotary inertia,
        else the twist and what the frame's choice turned back."""
        if self.shapes.rotary:
            return g[:, 3:]
        kept = np.broadcast_to(-self._rigid[3:], g[:, 3:].shape).copy()
        kept[:, 0] = g[:, 3]
        return kept

    def from_root(self, x: Array) -> Array:
        """(m, 6, n, n) with neither displacement nor rotation of second order at x = 0.

        The rate of the displacement contains the rotation, which is an integral itself.
        """
        shapes, n = self.shapes, self.shapes.n
        places, once, twice = antiderivatives(
            shapes.pieces, shapes.density, np.clip(x, 0.0, shapes.length)
        )
        values = _Values(shapes, places)
        found = np.empty((len(x), 6, n, n))
        for some in slices(n, 3 * len(places) * n):
            turning, drawing, lever = values.rates(some)
            turned, drawn, carried = (
                np.tensordot(weights, rate, axes=(1, 0))
                for weights, rate in ((once, turning), (once, drawing), (twice, turning))
            )
            found[:, 3:, some] = turned
            found[:, :3, some] = drawn + np.einsum("ab,mbkl->makl", lever, carried)
        return found

    def at_section(self, x: float) -> Array:
        """(6, n, n) at one section."""
        if x == 0.0:
            return np.zeros((6, self.shapes.n, self.shapes.n))
        return np.asarray(self.from_root(np.array([x]))[0])


class _Values:
    """What the rates along the beam are made of, at points x."""

    def __init__(self, shapes: BeamShapes, x: Array) -> None:
        values, slopes, bends = (shapes.rows(x, d) for d in range(3))
        self.theta = kernels.evaluate("section", {"values": values, "slopes": slopes[1:3]})["theta"]
        self.kappa = kernels.evaluate("section", {"values": slopes, "slopes": bends[1:3]})["theta"]
        self.stretch = slopes[:1]

    def rates(self, some: slice) -> tuple[Array, Array, Array]:
        """dh/dx (m, 3, k, n), dg/dx without its part from h, and that part per h (3, 3), of some
        shapes with all."""
        turned = _pairs("theta", self.theta, some)
        turning = kernels.evaluate("turning", turned | _pairs("kappa", self.kappa, some))["dh"]
        stretched = turned | _pairs("stretch", self.stretch, some)
        drawing = kernels.evaluate("drawing", stretched | {"h": np.zeros((3, 1, 1, 1))})["dg"]
        unmoved = {name: np.zeros((len(a), 1)) for name, a in stretched.items()}
        lever = kernels.evaluate("drawing", unmoved | {"h": np.eye(3)})["dg"]
        return np.moveaxis(turning, 3, 0), np.moveaxis(drawing, 3, 0), lever


def _pairs(name: str, values: Array, some: slice) -> dict[str, Array]:
    """Values (rows, n, m) of some shapes and of all as the two inputs of a kernel of pairs."""
    return {f"{name}_k": values[:, some, None, :], f"{name}_l": values[:, None, :, :]}


def _rigid_motion(field: SecondOrder, frames: Mapping[str, Frame]) -> Array:
    """Translation and rotation (6, n, n) of the origin that the frame takes from the field.

    Each bending plane, the twist and the displacement along the beam follow the frame of their own
    direction, and where it has no shapes that of the first one that has.
    """
    first = next(iter(frames.values()))
    rigid = np.zeros((6, field.shapes.n, field.shapes.n))
    rigid[0] = _value(field, 0, first)
    rigid[3] = _value(field, 3, frames.get("twist", first))
    rigid[1], rigid[5] = _line(field, (1, 5), frames.get("y", first))
    # A rotation about y moves the axis against z.
    rigid[2], slope = _line(field, (2, 4), frames.get("z", first))
    rigid[4] = slope
    return rigid


def _value(field: SecondOrder, row: int, frame: Frame) -> Array:
    """What the frame takes from a row by itself: its value at a section, or its mean."""
    if frame.origin is not None:
        return field.at_section(frame.origin)[row]
    x, w = field.shapes.rule()
    sections = field.shapes.sections(x)
    polar = sections.rho_I[0]
    weight = w * (sections.mass_per_length if row == 0 or not polar.all() else polar)
    return np.asarray(np.einsum("m,mkl->kl", weight, field.from_root(x)[:, row]) / weight.sum())


def _line(field: SecondOrder, rows: tuple[int, int], frame: Frame) -> tuple[Array, Array]:
    """(displacement at the origin, rotation) that the frame takes from deflection and slope."""
    sign = 1.0 if rows[0] == 1 else -1.0  # v' = theta_z, w' = -theta_y
    if frame.kind == "tangent":
        here = field.at_section(frame.x)
        turn = here[rows[1]]
        return here[rows[0]] - sign * frame.x * turn, turn
    if frame.kind == "chord":
        length = field.shapes.length
        end = field.at_section(length)[rows[0]]
        return np.zeros_like(end), sign * end / length
    x, w = field.shapes.rule()
    sections = field.shapes.sections(x)
    found = field.from_root(x)
    mass = w * sections.mass_per_length
    inertia = w * sections.rho_I[2 if rows[0] == 1 else 1]
    carried = found[:, rows[1]] if field.shapes.rotary else np.zeros_like(found[:, 0])
    matrix = np.array([[mass.sum(), mass @ x], [mass @ x, mass @ x**2 + inertia.sum()]])
    right = np.stack([
        np.einsum("m,mkl->kl", mass, found[:, rows[0]]),
        np.einsum("m,mkl->kl", mass * x, found[:, rows[0]])
        + sign * np.einsum("m,mkl->kl", inertia, carried),
    ])  # fmt: skip
    place, slope = np.einsum("ij,jkl->ikl", np.linalg.inv(matrix), right)
    return place, sign * slope


__all__ = ["SecondOrder"]
