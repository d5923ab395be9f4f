"""A beam of a scene as particles: places, displacement fields and masses of Gauss points.

Polynomial shapes only, read from the scene's own text, so that the quadrature is exact.  A section
is four particles at (+-a, 0) and (0, +-b) that carry its mass and its two moments of inertia.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial

from reference.algebra import orientation
from reference.jets import Array

DIRECTIONS = ("y", "z", "twist", "axial")
#: Row of (s, v, w, psi) that a direction moves.
ROW = {"axial": 0, "y": 1, "z": 2, "twist": 3}


@dataclass(frozen=True)
class Section:
    """A section of the beam: place, end axes at rest, displacement and rotation per mode, and G,
    with the displacement -1/2 eta^T G eta along x."""

    place: Array
    rotation: Array
    phi: Array
    theta: Array
    shortening: Array


@dataclass(frozen=True)
class Particles:
    """`mass` (m,), `place` (m, 3), `phi` (m, 3, n), `shortening` (m, n, n) along x."""

    mass: Array
    place: Array
    phi: Array
    shortening: Array


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
    none = Particles(np.full(6, mass / 6), place, np.zeros((6, 3, 0)), np.zeros((6, 0, 0)))
    ends = {"": _rigid_end([0, 0, 0])}
    for name, end in (data.get("ends") or {}).items():
        ends[name] = _rigid_end(end)
    return Body(data["name"], none, ends, np.zeros((0, 0)), np.zeros((0, 0)))


def _rigid_end(end: Any) -> Section:
    turned = end.get("orientation") if isinstance(end, Mapping) else None
    place = end["position"] if isinstance(end, Mapping) else end
    nothing = np.zeros((3, 0))
    return Section(
        np.asarray(place, float), orientation(turned), nothing, nothing, np.zeros((0, 0))
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
        self.origin: float | None = None
        self.taken, self.origin = self._frame(held)

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

    def rotation(self, x: Array) -> Array:
        """Section rotations (psi, -w', v'), (m, 3, n)."""
        values, slopes = self.rows(x), self.rows(x, 1)
        return np.stack([values[:, 3], -slopes[:, 2], slopes[:, 1]], axis=1)

    def carried(self, x: Array) -> Array:
        """Rotation that turns the section's inertia: without rotary inertia, twist and what the
        frame takes off alone."""
        turn = self.rotation(x)
        if not self.rotary:
            turn[:, 1:] = -self.taken[4:]
        return turn

    def shortening(self, x: Array) -> Array:
        """G(x) (m, n, n), from the frame's own origin."""
        out = np.array([self._from_root(float(v)) for v in x])
        if self.origin is None:
            gauss = np.array([self._from_root(float(v)) for v in self.x])
            return out - np.einsum("m,mkl->kl", self.w, gauss) / self.w.sum()
        return out - self._from_root(self.origin)

    def _from_root(self, x: float) -> Array:
        s, w = self.gauss(0.0, x)
        slopes = self.rows(s, 1)[:, 1:3]
        return np.einsum("m,mak,mal->kl", w, slopes, slopes)

    def _frame(self, held: str) -> tuple[Array, float | None]:
        kind, _, end = str(self.beam.get("frame", "tangent")).partition("@")
        if kind == "tangent":
            at = end_place(self.beam, end or held)
            values, turn = self.rows(np.array([at]))[0], self.rotation(np.array([at]))[0]
            back = np.cross(turn.T, [at, 0.0, 0.0]).T
            return np.vstack([values[:3] - back, turn]), at
        if kind == "chord":
            first, last = self.rows(np.array([0.0, self.length]))
            # A chord leaves the twist about it and the place along it to the section that is held.
            slope, own = (
                (last - first) / self.length,
                self.rows(np.array([end_place(self.beam, held)]))[0],
            )
            return np.vstack([own[0], first[1:3], own[3], -slope[2], slope[1]]), 0.0
        place, field, mass = self.points()
        tilde = np.cross(np.eye(3), place[:, None, :])  # e_a x r0
        rigid = np.concatenate([np.tile(np.eye(3), (len(place), 1, 1)), tilde], axis=1)
        rigid = np.swapaxes(rigid, 1, 2)  # (m, 3, 6)
        normal = np.einsum("m,mai,maj->ij", mass, rigid, rigid)
        right = np.einsum("m,mai,mak->ik", mass, rigid, field)
        return np.linalg.lstsq(normal, right, rcond=1e-14)[0], None

    def points(self) -> tuple[Array, Array, Array]:
        """Places, displacements per mode and masses of all particles."""
        mass, yy, zz = self.section
        a, b = np.sqrt(2 * yy / mass), np.sqrt(2 * zz / mass)
        offsets = np.array([[0, a, 0], [0, -a, 0], [0, 0, b], [0, 0, -b]])
        axis, turn = self.rows(self.x)[:, :3], self.carried(self.x)
        place = np.array([[x, *o[1:]] for x in self.x for o in offsets])
        field = [axis[i] + np.cross(turn[i].T, o).T for i in range(len(self.x)) for o in offsets]
        return place, np.array(field), np.repeat(self.w * mass / 4, 4)


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
    bends = np.repeat(shapes.shortening(shapes.x), 4, axis=0) * stiff
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
            shapes.shortening(x)[0] * stiff,
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
        shapes.w * float(beam["viscous_drag"]), place, field, shapes.shortening(shapes.x) * stiff
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
        np.einsum("m,mkl->kl", w, shapes.shortening(x)) * stiff,
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
