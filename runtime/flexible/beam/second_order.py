"""Displacement and rotation of second order along a beam, -1/2 eta^T g eta, in its floating frame.

The rates along the beam are generated kernels (`derive.flexible.beam_second_order`); here they are
integrated, and the rigid motion that the choice of the floating frame leaves open is taken off: to
second order as to first, the frame is that of a section, of the chord or of the mean.

Arrays g of all pairs of shapes are made for few sections or sums over sections; for given modal
coordinates a^T g b is integrated from their own fields, without the pairs.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array

from ..memory_chunks import slices
from .second_order_rates import Rates

if TYPE_CHECKING:
    from .frame_location import Frame
    from .shape_fields import ShapeFields


class SecondOrder:
    """g (6, n, n) at any section: displacement x, y, z in 1/m, rotation vector x, y, z.

    With `carried` the rotation is that which carries the sections' inertia: all of it with rotary
    inertia, else the twist and what the frame's choice turned back.
    """

    def __init__(self, shapes: ShapeFields, frames: Mapping[str, Frame]) -> None:
        self.shapes, self._frames = shapes, frames

    @cached_property
    def _rates(self) -> Rates:
        return Rates(self.shapes)

    @cached_property
    def _rigid(self) -> Array:
        return _RigidMotion(self).taken(self._frames)

    def at(self, x: Array, carried: bool = False) -> Array:
        """(m, 6, n, n) at sections x (m,)."""
        found = np.empty((len(x), 6, self.shapes.n, self.shapes.n))
        for some in slices(len(x), 12 * self.shapes.n**2):
            found[some] = self.sums(x[some], np.eye(len(x[some])), carried)
        return found

    def sums(self, x: Array, weights: Array, carried: bool = False) -> Array:
        """(p, 6, n, n): sums over sections x (m,) with weights (p, m)."""
        moved = _moved(weights.sum(axis=1), weights @ x)
        return self.from_root(x, weights, carried) - np.tensordot(moved, self._rigid, axes=(2, 0))

    def from_root(self, x: Array, weights: Array, carried: bool = False) -> Array:
        """`sums` with neither displacement nor rotation of second order at x = 0."""
        found = self._rates.sums(x, weights)
        if carried and not self.shapes.rotary:
            found[:, 4:] = 0.0
        return found

    def of(self, x: Array, a: Array, b: Array, carried: bool = False) -> Array:
        """(t, m, 6) numbers a^T g b at sections x (m,) for modal coordinates a and b (t, n)."""
        rows = len(self._rates.points) * 32
        found = np.empty((len(a), len(x), 6))
        with np.errstate(over="ignore", invalid="ignore"):  # a run that failed may have run away
            for some in slices(len(a), max(rows, 6 * len(x), self.shapes.n**2)):
                found[some] = self._of(x, a[some], b[some], carried)
        return found

    def _of(self, x: Array, a: Array, b: Array, carried: bool) -> Array:
        if self.shapes.n <= _FEW:
            pairs = (a[:, :, None] * b[:, None, :]).reshape(len(a), -1)
            g = _pairs_first(self, x.tobytes(), carried)
            return np.asarray(pairs @ g).reshape(len(a), len(x), 6)
        found = self._rates.of(x, a, b)
        if carried and not self.shapes.rotary:
            found[..., 4:] = 0.0
        rigid = np.stack([((a @ g) * b).sum(axis=1) for g in self._rigid], axis=1)
        return found - np.tensordot(rigid, _moved(np.ones(len(x)), x), axes=(1, 2))


#: Shapes up to which all their pairs are fewer than the points that rates are integrated from.
_FEW = 25


@lru_cache(maxsize=16)
def _pairs_first(field: SecondOrder, places: bytes, carried: bool) -> Array:
    """(n n, m 6) g at sections."""
    g = field.at(np.frombuffer(places), carried)
    return np.ascontiguousarray(np.moveaxis(g, (2, 3), (0, 1)).reshape(field.shapes.n**2, -1))


def _moved(whole: Array, lever: Array) -> Array:
    """(p, 6, 6): sums of the rigid motion of the origin over sections, from the sums `whole` of the
    weights and `lever` of the weights times x."""
    found = np.multiply.outer(whole, np.eye(6))
    found[:, 1, 5], found[:, 2, 4] = lever, -lever
    return found


class _RigidMotion:
    """Translation and rotation (6, n, n) of the origin that the frame takes from the field.

    Each bending plane, the twist and the displacement along the beam follow the frame of their own
    direction, and where it has no shapes that of the first one that has.
    """

    def __init__(self, field: SecondOrder) -> None:
        self.field, self.shapes = field, field.shapes
        self._at: dict[float, Array] = {0.0: np.zeros((6, self.shapes.n, self.shapes.n))}

    def taken(self, frames: Mapping[str, Frame]) -> Array:
        rigid = np.zeros((6, self.shapes.n, self.shapes.n))
        if not frames:
            return rigid
        first = next(iter(frames.values()))
        rigid[0] = self._value(0, first)
        rigid[3] = self._value(3, frames.get("twist", first))
        rigid[1], rigid[5] = self._line((1, 5), frames.get("y", first))
        # A rotation about y moves the axis against z.
        rigid[2], rigid[4] = self._line((2, 4), frames.get("z", first))
        return rigid

    def _section(self, x: float) -> Array:
        """(6, n, n) at one section."""
        if x not in self._at:
            self._at[x] = self.field.from_root(np.array([x]), np.ones((1, 1)))[0]
        return self._at[x]

    @cached_property
    def _weights(self) -> tuple[Array, Array]:
        """Sections of the mean, and how the mass, the mass times x, the rotary inertia about y and
        z and what twist is the mean by weigh them."""
        x, w = self.shapes.rule()
        sections = self.shapes.sections(x)
        mass, (polar, about_y, about_z) = sections.mass_per_length, sections.rho_I
        twist = polar if polar.all() else mass
        return x, w * np.stack([mass, mass * x, about_y, about_z, twist])

    @cached_property
    def _sums(self) -> Array:
        """(5, 6, n, n) by the weights of the mean."""
        return self.field.from_root(*self._weights, carried=True)

    def _value(self, row: int, frame: Frame) -> Array:
        """What the frame takes from a row by itself: its value at a section, or its mean."""
        if frame.origin is not None:
            return self._section(frame.origin)[row]
        which = 0 if row == 0 else 4
        return np.asarray(self._sums[which, row] / self._weights[1][which].sum())

    def _line(self, rows: tuple[int, int], frame: Frame) -> tuple[Array, Array]:
        """(displacement at the origin, rotation) that the frame takes from deflection and slope."""
        place, turn = rows
        sign = 1.0 if place == 1 else -1.0  # v' = theta_z, w' = -theta_y
        if frame.kind == "tangent":
            here = self._section(frame.x)
            return here[place] - sign * frame.x * here[turn], here[turn]
        if frame.kind == "chord":
            length = self.shapes.length
            end = self._section(length)[place]
            return np.zeros_like(end), sign * end / length
        (x, weights), about = self._weights, 3 if place == 1 else 2
        mass, first, inertia = weights[0].sum(), weights[1].sum(), weights[about].sum()
        matrix = np.array([[mass, first], [first, weights[1] @ x + inertia]])
        right = np.stack(
            [self._sums[0, place], self._sums[1, place] + sign * self._sums[about, turn]]
        )
        origin, slope = np.tensordot(np.linalg.inv(matrix), right, axes=1)
        return origin, sign * slope


__all__ = ["SecondOrder"]
