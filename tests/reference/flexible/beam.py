"""A beam of a scene as particles: places, displacement fields and masses of Gauss points.

Polynomial shapes only, read from the scene's own text, so that the quadrature is exact.  A section
is four particles at (+-a, 0) and (0, +-b) that carry its mass and its two moments of inertia.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial

from tests.reference.algebra import orientation
from tests.reference.jets import Array

DIRECTIONS = ("y", "z", "twist", "axial")
#: Row of (s, v, w, psi) that a direction moves.
ROW = {"axial": 0, "y": 1, "z": 2, "twist": 3}


@dataclass(frozen=True)
class Section:
    """A section of the beam: place, end axes at rest, displacement and rotation per mode, and the
    second derivatives (6, n, n) of displacement and rotation vector by the modes."""

    place: Array
    rotation: Array
    phi: Array
    theta: Array
    second: Array


@dataclass(frozen=True)
class Particles:
    """`mass` (m,), `place` (m, 3), displacement `phi` (m, 3, n) per mode and its second derivatives
    `second` (m, 3, n, n)."""

    mass: Array
    place: Array
    phi: Array
    second: Array


@dataclass(frozen=True)
class Body:
    """A rigid or flexible body in its floating frame; rigid ones have no modes."""

    name: str
    particles: Particles
    ends: Mapping[str, Section]
    K: Array
    D: Array
    #: Viscous drag of the axis as particles whose `mass` is N s/m; None where there is none.
    drag: Particles | None = None
    #: Mean sections on which loads per length act, by (from, to).
    shapes: Shapes | None = None

    @property
    def n(self) -> int:
        return len(self.K)


def rigid_body(data: Mapping[str, Any]) -> Body:
    """Six particles with the mass, the mass centre and the inertia of a [[body]]."""
    xx, yy, zz, xy, xz, yz = (list(map(float, data["inertia"])) + [0.0] * 3)[:6]
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    mass = float(data["mass"])
    spread, axes = np.linalg.eigh(np.trace(inertia) / 2 * np.eye(3) - inertia)
    arms = (axes * np.sqrt(3 * spread / mass)).T
    center = np.asarray(data.get("center_of_mass") or (0, 0, 0), float)
    place = center + np.vstack([arms, -arms])
    none = Particles(np.full(6, mass / 6), place, np.zeros((6, 3, 0)), np.zeros((6, 3, 0, 0)))
    ends = {"": _rigid_end([0, 0, 0])}
    for name, end in (data.get("ends") or {}).items():
        ends[name] = _rigid_end(end)
    return Body(data["name"], none, ends, np.zeros((0, 0)), np.zeros((0, 0)))


def _rigid_end(end: Any) -> Section:
    turned = end.get("orientation") if isinstance(end, Mapping) else None
    place = end["position"] if isinstance(end, Mapping) else end
    nothing = np.zeros((3, 0))
    return Section(
        np.asarray(place, float), orientation(turned), nothing, nothing, np.zeros((6, 0, 0))
    )


def polynomial(text: str) -> Polynomial:
    """The polynomial of a text "a + b*x^2 + c*x^3" (as `text_of` writes it)."""
    coefficients = np.zeros(20)
    for term in re.split(r"\s\+\s", text):
        factor, _, power = term.partition("*x^")
        coefficients[int(power or 0)] += float(factor.strip("()"))
    return Polynomial(np.trim_zeros(coefficients, "b"))


def text_of(coefficients: Mapping[int, float]) -> str:
    """Sum of powers of x with the given factors, as a scene may state it."""
    return " + ".join(f"({float(c)!r})*x^{k}" for k, c in coefficients.items())


class Shapes:
    """Fields (s, v, w, psi) of the modes of a [[beam]], less the rigid motion of its frame."""

    def __init__(self, beam: Mapping[str, Any], held: str) -> None:
        self.beam, self.length = beam, float(beam["length"])
        self.modes = [
            (ROW[word], polynomial(text))
            for word in DIRECTIONS
            for text in beam["shapes"].get(word, ())
        ]
        self.n = len(self.modes)
        self.x, self.w = self.gauss(0.0, self.length)
        inertia = beam.get("rotary_inertia")
        self.rotary = inertia is not None
        polar = float(beam.get("polar_inertia_per_length") or 0.0)
        about_y, about_z = inertia if inertia is not None else (polar / 2, polar / 2)
        self.section = (float(beam["mass_per_length"]), about_z, about_y)
        #: Rigid motion (translation; rotation) of the origin that the frame takes from each mode.
        self.taken = np.zeros((6, self.n))
        #: The same of their second derivatives, (6, n, n).
        self.taken_second = np.zeros((6, self.n, self.n))
        self.taken, self.taken_second = self._frame(held)

    def gauss(self, a: float, b: float) -> tuple[Array, Array]:
        """Points and weights between two places; exact for all products that occur."""
        x, w = np.polynomial.legendre.leggauss(24)
        return a + (b - a) * (x + 1) / 2, (b - a) * w / 2

    def rows(self, x: Array, d: int = 0) -> Array:
        """d-th derivative of (s, v, w, psi), (m, 4, n), the frame's motion taken off."""
        out = np.zeros((len(x), 4, self.n))
        for k, (row, shape) in enumerate(self.modes):
            out[:, row, k] = (shape.deriv(d) if d else shape)(x)
        a, b = self.taken[:3], self.taken[3:]
        if d == 0:
            # Rigid rotation b moves the axis point (x, 0, 0) by b x (x, 0, 0).
            out[:, :3] -= a
            out[:, 1] -= x[:, None] * b[2]
            out[:, 2] += x[:, None] * b[1]
            out[:, 3] -= b[0]
        elif d == 1:
            out[:, 1] -= b[2]
            out[:, 2] += b[1]
        return out

    def rotation(self, x: Array, d: int = 0) -> Array:
        """d-th derivative of the section rotations (psi, -w', v'), (m, 3, n)."""
        values, slopes = self.rows(x, d), self.rows(x, d + 1)
        return np.stack([values[:, 3], -slopes[:, 2], slopes[:, 1]], axis=1)

    def inertia_rotation(self, x: Array) -> Array:
        """Rotation that turns the section's inertia: without rotary inertia, twist and what the
        frame takes off alone."""
        turn = self.rotation(x)
        if not self.rotary:
            turn[:, 1:] = -self.taken[4:]
        return turn

    def second(self, x: Array) -> Array:
        """Second derivatives (m, 6, n, n) by the modes of a section's displacement and rotation
        vector: a rod whose strains s', psi', w'', v'' are those of its shapes."""
        found = np.polynomial.polynomial.polyval(x, self._from_root)
        out = np.moveaxis(np.asarray(found, dtype=np.float64), -1, 0)
        a, b = self.taken_second[:3], self.taken_second[3:]
        out[:, :3] -= a
        out[:, 1] -= x[:, None, None] * b[2]
        out[:, 2] += x[:, None, None] * b[1]
        out[:, 3:] -= b
        return out

    @cached_property
    def _from_root(self) -> Array:
        """Coefficients (degree + 1, 6, n, n) of the same with a root that does not move.

        By matrices: R = 1 + A1 + A2, A1 = theta~, R' = R kappa~ gives A2' = A1 theta'~; the axis
        follows by r' = (1 + s') R e_x.  R = exp(Psi~) leaves the rotation vector in A2 - A1 A1/2.
        """
        turned, stretch = np.zeros((self.n, 3, 3, _LENGTH)), np.zeros((self.n, _LENGTH))
        for k in range(self.n):
            turned[k] = _tilde_of(self._rotation_of(k))
            stretch[k] = _coefficients(self._field(k, 0).deriv())
        both = _symmetric_product(turned, _derivative(turned))
        square = _symmetric_product(turned, turned)
        grown = _integral(both)
        grown[..., 0] += square[..., 0] / 2
        along = grown[:, :, :, 0] + _symmetric_column_product(stretch, turned[:, :, 0])
        rest = grown - square / 2
        turn = [(rest[:, :, c, b] - rest[:, :, b, c]) / 2 for b, c in ((1, 2), (2, 0), (0, 1))]
        fields = np.concatenate([_integral(along), np.stack(turn, axis=2)], axis=2)
        return np.moveaxis(fields, (3, 2), (0, 1))

    def _field(self, k: int, row: int) -> Polynomial:
        """Row s, v, w or psi of mode k, the frame's motion taken off."""
        own, shape = self.modes[k]
        a, b = self.taken[:3, k], self.taken[3:, k]
        line = [[a[0], 0.0], [a[1], b[2]], [a[2], -b[1]], [b[0], 0.0]][row]
        found = (shape if own == row else Polynomial([0.0])) - Polynomial(line)
        return Polynomial(found.coef)

    def _rotation_of(self, k: int) -> list[Polynomial]:
        return [self._field(k, 3), -self._field(k, 2).deriv(), self._field(k, 1).deriv()]

    def _frame(self, held: str) -> tuple[Array, Array]:
        kind, _, end = str(self.beam.get("frame", "tangent")).partition("@")
        if kind == "tangent":
            at = end_place(self.beam, end or held)
            values, turn = self.rows(np.array([at]))[0], self.rotation(np.array([at]))[0]
            self.taken = np.vstack([values[:3] - np.cross(turn.T, [at, 0.0, 0.0]).T, turn])
            second = self.second(np.array([at]))[0]
            back = np.cross(np.moveaxis(second[3:], 0, -1), [at, 0.0, 0.0])
            return self.taken, np.concatenate([second[:3] - np.moveaxis(back, -1, 0), second[3:]])
        if kind == "chord":
            first, last = self.rows(np.array([0.0, self.length]))
            # A chord leaves the twist about it and the place along it to the section that is held.
            slope, own = (
                (last - first) / self.length,
                self.rows(np.array([end_place(self.beam, held)]))[0],
            )
            self.taken = np.vstack([own[0], first[1:3], own[3], -slope[2], slope[1]])
            bent = self.second(np.array([0.0, self.length, end_place(self.beam, held)]))
            rise = (bent[1] - bent[0]) / self.length
            turned = np.stack([bent[2, 3], -rise[2], rise[1]])
            return self.taken, np.concatenate([bent[0, :3], turned])
        place, field, mass = self.points()
        self.taken = _mean_motion(place, field, mass)
        second = self.second(self.x)
        turn = self._carried_second(second)
        shape = (len(place), 3, self.n**2)
        bent = _of_points(second[:, :3], turn, self._offsets()).reshape(shape)
        return self.taken, _mean_motion(place, bent, mass).reshape(6, self.n, self.n)

    def _carried_second(self, second: Array) -> Array:
        """Second derivatives of the rotation that turns the section's inertia, (m, 3, n, n)."""
        turn = second[:, 3:].copy()
        if not self.rotary:
            turn[:, 1:] = -self.taken_second[4:]
        return turn

    def points_second(self) -> Array:
        """Second derivatives (m, 3, n, n) of the displacement of all particles: a section turns by
        exp(theta~) = 1 + theta~ + theta~ theta~ / 2."""
        second, theta = self.second(self.x), self.inertia_rotation(self.x)
        crosses = np.array([tilde(t) for t in theta])
        both = _symmetric(np.einsum("mkab,mlbc->mklac", crosses, crosses)) / 2
        offsets = self._offsets()
        linear = _of_points(second[:, :3], self._carried_second(second), offsets)
        off = np.einsum("mklab,ob->moakl", both, offsets).reshape(linear.shape)
        return np.asarray(linear + off)

    def points(self) -> tuple[Array, Array, Array]:
        """Places, displacements per mode and masses of all particles."""
        mass, offsets = self.section[0], self._offsets()
        axis, turn = self.rows(self.x)[:, :3], self.inertia_rotation(self.x)
        place = np.array([[x, *o[1:]] for x in self.x for o in offsets])
        field = [axis[i] + np.cross(turn[i].T, o).T for i in range(len(self.x)) for o in offsets]
        return place, np.array(field), np.repeat(self.w * mass / 4, 4)

    def _offsets(self) -> Array:
        """Places (4, 3) of the particles of a section about its axis."""
        mass, yy, zz = self.section
        a, b = np.sqrt(2 * yy / mass), np.sqrt(2 * zz / mass)
        return np.array([[0, a, 0], [0, -a, 0], [0, 0, b], [0, 0, -b]])


def tilde(vectors: Array) -> Array:
    """(n, 3, 3) cross products with the columns of (3, n)."""
    return np.cross(vectors.T[:, None, :], np.eye(3)[None], axisb=2).swapaxes(1, 2)


#: Number of coefficients of every polynomial, enough for products of two fields.
_LENGTH = 40


def _coefficients(polynomial: Polynomial) -> Array:
    """Coefficients (_LENGTH,), with zeros above the degree."""
    return np.pad(polynomial.coef, (0, _LENGTH - len(polynomial.coef)))


def _tilde_of(vector: list[Polynomial]) -> Array:
    """Coefficients (3, 3, _LENGTH) of the cross product with a vector of polynomials."""
    x, y, z = map(_coefficients, vector)
    none = np.zeros(_LENGTH)
    return np.array([[none, -z, y], [z, none, -x], [-y, x, none]])


def _derivative(polynomials: Array) -> Array:
    """Derivatives of polynomials, along the last axis."""
    return np.pad(
        polynomials[..., 1:] * np.arange(1, _LENGTH), [(0, 0)] * (polynomials.ndim - 1) + [(0, 1)]
    )


def _integral(polynomials: Array) -> Array:
    """Integrals from 0 of polynomials below the highest degree, along the last axis."""
    found = np.zeros_like(polynomials)
    found[..., 1:] = polynomials[..., :-1] / np.arange(1, _LENGTH)
    return found


def _product(pairing: str, left: Array, right: Array) -> Array:
    """Products of polynomials, whose factors are paired as in `np.einsum`."""
    found = 0.0 * np.einsum(pairing, left[..., 0], right)
    for power in range(_LENGTH):
        if left[..., power].any():
            term = np.einsum(pairing, left[..., power], right[..., : _LENGTH - power])
            found[..., power:] += term
    return np.asarray(found)


def _symmetric_product(left: Array, right: Array) -> Array:
    """left_k right_m + left_m right_k of matrices (n, 3, 3) of polynomials."""
    pairs = _product("kab,mbcj->kmacj", left, right)
    return pairs + pairs.swapaxes(0, 1)


def _symmetric_column_product(stretch: Array, column: Array) -> Array:
    """s_k c_m + s_m c_k of scalars (n,) and columns (n, 3) of polynomials."""
    pairs = _product("k,maj->kmaj", stretch, column)
    return pairs + pairs.swapaxes(0, 1)


def _symmetric(pairs: Array) -> Array:
    """A_kl + A_lk of arrays (..., n, n, 3, 3)."""
    return np.asarray(pairs + np.swapaxes(pairs, -4, -3))


def _of_points(axis: Array, turn: Array, offsets: Array) -> Array:
    """Displacements (m * 4, 3, n, n) of particles at the offsets of sections that move and turn."""
    crossed = np.cross(np.moveaxis(turn, 1, -1)[:, None], offsets[None, :, None, None, :])
    moved = axis[:, None] + np.moveaxis(crossed, -1, 2)
    return moved.reshape(-1, *moved.shape[2:])


def _mean_motion(place: Array, field: Array, mass: Array) -> Array:
    """Rigid motion (6, k) of fields (m, 3, k) of particles that has their momenta."""
    across = np.cross(np.eye(3), place[:, None, :])  # e_a x r0
    rigid = np.concatenate([np.tile(np.eye(3), (len(place), 1, 1)), across], axis=1)
    rigid = np.swapaxes(rigid, 1, 2)  # (m, 3, 6)
    normal = np.einsum("m,mai,maj->ij", mass, rigid, rigid)
    right = np.einsum("m,mai,mak->ik", mass, rigid, field)
    return np.asarray(np.linalg.lstsq(normal, right, rcond=1e-14)[0])


def end_place(beam: Mapping[str, Any], name: str) -> float:
    """x of an end of a beam."""
    if name in ("", "root"):
        return 0.0
    if name == "tip":
        return float(beam["length"])
    end = beam["ends"][name]
    return float(end["position"] if isinstance(end, Mapping) else end)


def flexible_body(beam: Mapping[str, Any], held: str = "root") -> Body:
    """Particles, ends and stiffness of a [[beam]] with shapes of its own, held by an end."""
    shapes = Shapes(beam, held)
    place, field, mass = shapes.points()
    stiff = bool(beam.get("stiffening", True))
    bends = shapes.points_second() * stiff
    ends = {}
    for name in ("", "root", "tip", *(beam.get("ends") or {})):
        x = np.array([end_place(beam, name)])
        given = (beam.get("ends") or {}).get(name)
        turned = given.get("orientation") if isinstance(given, Mapping) else None
        ends[name] = Section(
            np.array([x[0], 0.0, 0.0]),
            orientation(turned),
            shapes.rows(x)[0, :3],
            shapes.rotation(x)[0],
            shapes.second(x)[0] * stiff,
        )
    K = _stiffness(beam, shapes)
    damping = beam.get("damping") or {}
    D = float(damping.get("stiffness", 0.0)) * K if isinstance(damping, Mapping) else 0.0 * K
    made = Particles(mass, place, field, bends)
    return Body(beam["name"], made, ends, K, D, _drag(beam, shapes, stiff), shapes)


def _drag(beam: Mapping[str, Any], shapes: Shapes, stiff: bool) -> Particles | None:
    if not beam.get("viscous_drag"):
        return None
    place = np.zeros((len(shapes.x), 3))
    place[:, 0] = shapes.x
    field = shapes.rows(shapes.x)[:, :3]
    return Particles(
        shapes.w * float(beam["viscous_drag"]), place, field, shapes.second(shapes.x)[:, :3] * stiff
    )


def mean_section(body: Body, beam: Mapping[str, Any], first: float, last: float) -> Section:
    """Mean of the sections from `first` to `last`: where a constant force per length acts."""
    shapes = body.shapes
    assert shapes is not None
    x, w = shapes.gauss(first, last)
    w = w / (last - first)
    stiff = bool(beam.get("stiffening", True))
    return Section(
        np.array([w @ x, 0.0, 0.0]),
        np.eye(3),
        np.einsum("m,mak->ak", w, shapes.rows(x)[:, :3]),
        np.einsum("m,mak->ak", w, shapes.rotation(x)),
        np.einsum("m,makl->akl", w, shapes.second(x)) * stiff,
    )


def _stiffness(beam: Mapping[str, Any], shapes: Shapes) -> Array:
    """int EA s'^2 + EI_z v''^2 + EI_y w''^2 + GI_t psi'^2."""
    bending = np.ravel(beam.get("bending_stiffness") or 0.0)
    first, second = shapes.rows(shapes.x, 1), shapes.rows(shapes.x, 2)
    strains = np.stack([first[:, 0], second[:, 1], second[:, 2], first[:, 3]], axis=1)
    factors = np.array(
        [
            float(beam.get("axial_stiffness") or 0.0),
            bending[-1],
            bending[0],
            float(beam.get("torsional_stiffness") or 0.0),
        ]
    )
    return np.einsum("m,a,mak,mal->kl", shapes.w, factors, strains, strains)
