"""A free beam by Lagrange's equations in a chart, everything symbolic but the state.

Coordinates: place of the root section (x, y, z), angles a, b, c with R = Rz(c) Ry(b) Rx(a), modes.
Kinetic energy, strain energy and potential are integrated exactly along the beam and cut after the
second order in the modes; the equations are M qdd + Mdot qd - grad T + grad V = 0.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import sympy as sp

Array = npt.NDArray[np.float64]

_X = sp.Symbol("x", positive=True)


@dataclass(frozen=True)
class Beam:
    """Numbers of a uniform beam as rationals; `shapes` (direction, polynomial of "x") per mode.

    `inertia`: mass per length, int rho y^2 dA, int rho z^2 dA; `rotary`: whether bending turns the
    sections' inertia; `stiffness`: EA, GI_t, EI_y, EI_z.
    """

    length: sp.Rational
    inertia: tuple[sp.Rational, ...]
    stiffness: tuple[sp.Rational, ...]
    shapes: tuple[tuple[str, sp.Expr], ...]
    rotary: bool
    stiffening: bool


def beam_of(scene: Mapping[str, Any]) -> Beam:
    """The [[beam]] of a scene, which has polynomial shapes of its own."""

    def exact(value: Any) -> sp.Rational:
        return sp.Rational(str(value))

    shapes = [
        (word, sp.sympify(str(text).replace("^", "**"), rational=True).subs("x", _X))
        for word in ("y", "z", "twist", "axial")
        for text in scene["shapes"].get(word, ())
    ]
    rotary = scene.get("rotary_inertia")
    polar = exact(scene.get("polar_inertia_per_length") or 0)
    about_y, about_z = map(exact, rotary) if rotary else (polar / 2, polar / 2)
    bending = scene["bending_stiffness"]
    given = bending if isinstance(bending, Sequence) else (bending, bending)
    stiffness = (scene.get("axial_stiffness") or 0, scene.get("torsional_stiffness") or 0, *given)
    return Beam(
        exact(scene["length"]),
        (exact(scene["mass_per_length"]), about_z, about_y),
        tuple(map(exact, stiffness)),
        tuple(shapes),
        rotary is not None,
        bool(scene.get("stiffening", True)),
    )


def _length_integral(beam: Beam, entry: sp.Expr) -> sp.Expr:
    """int_0^L entry dx for a polynomial in x."""
    polynomial = sp.Poly(sp.expand(entry), _X)
    return sp.Add(*(c * beam.length ** (k + 1) / (k + 1) for (k,), c in polynomial.terms()))


def _second_order(
    s: sp.Expr, theta: sp.Matrix, carried: list[sp.Expr], offset: tuple[sp.Symbol, sp.Symbol]
) -> sp.Matrix:
    """Second-order displacement of the point (y, z): R = 1 + A1 + A2 with R' = R theta'~, the axis
    by r' = (1 + s') R e_x, from a root section that does not move."""
    first = theta.hat()
    grown = (first * first.diff(_X)).applyfunc(lambda e: sp.integrate(sp.expand(e), (_X, 0, _X)))
    along = grown[:, 0] + s.diff(_X) * first[:, 0]
    axis = along.applyfunc(lambda e: sp.integrate(sp.expand(e), (_X, 0, _X)))
    turn = (grown - first * first / 2).vee()
    if carried[1] == 0 and carried[2] == 0:
        turn[1] = turn[2] = 0
    kept = sp.Matrix(carried).hat()
    return axis + (turn.hat() + kept * kept / 2) * sp.Matrix([0, *offset])


class FreeBeam:
    """Accelerations of a beam whose root section is the floating frame, on nothing."""

    def __init__(self, beam: Beam, planar: bool, gravity: Sequence[float]) -> None:
        n = len(beam.shapes)
        self.planar, self.n = planar, n
        self.eta, self.etad = sp.symbols(f"e:{n}"), sp.symbols(f"d:{n}")
        self.place, self.velocity = sp.symbols("p:3"), sp.symbols("v:3")
        self.angle, self.rate = sp.symbols("a:3"), sp.symbols("r:3")
        a, b, c = self.angle
        if planar:
            turn = sp.rot_axis3(-c)
        else:
            turn = sp.rot_axis3(-c) * sp.rot_axis2(-b) * sp.rot_axis1(-a)
        self.turn = turn
        kept = [0, 1] if planar else [0, 1, 2]
        angles = [2] if planar else [0, 1, 2]
        self.q = [*(self.place[i] for i in kept), *(self.angle[i] for i in angles), *self.eta]
        self.qd = [*(self.velocity[i] for i in kept), *(self.rate[i] for i in angles), *self.etad]
        still = dict.fromkeys((*self.place, *self.velocity, *self.angle, *self.rate), 0)
        for s in (*self.q, *self.qd):
            still.pop(s, None)
        spin = sp.zeros(3, 3)
        for angle, rate in zip(self.angle, self.rate, strict=True):
            spin += turn.T * turn.diff(angle) * rate
        omega = sp.Matrix([spin[2, 1], spin[0, 2], spin[1, 0]])
        self.omega = omega.subs(still)
        # In body axes the energy is a polynomial of these, so that the cut needs no trigonometry.
        w, v = sp.Matrix(sp.symbols("w:3")), sp.Matrix(sp.symbols("o:3"))
        kinetic, potential = self._energies(beam, w, v, sp.Matrix(gravity))
        body = dict(zip(w, self.omega, strict=True)) | dict(
            zip(v, (turn.T * sp.Matrix(self.velocity)).subs(still), strict=True)
        )
        self._equations(kinetic, body, potential.subs(still))

    def _energies(
        self, beam: Beam, w: sp.Matrix, v: sp.Matrix, gravity: sp.Matrix
    ) -> tuple[sp.Expr, sp.Expr]:
        y, z = sp.symbols("y z")
        rows = {"axial": 0, "y": 1, "z": 2, "twist": 3}
        values, turned = [sp.Integer(0)] * 4, [sp.Integer(0)] * 3
        for eta, (word, shape) in zip(self.eta, beam.shapes, strict=True):
            values[rows[word]] += eta * shape
        s, dv, dw, psi = values
        turned[0] = psi
        if beam.rotary:
            turned[1], turned[2] = -dw.diff(_X), dv.diff(_X)
        first = sp.Matrix([s, dv, dw]) + sp.Matrix(turned).cross(sp.Matrix([0, y, z]))
        second = sp.zeros(3, 1)
        if beam.stiffening:
            second = _second_order(s, sp.Matrix([psi, -dw.diff(_X), dv.diff(_X)]), turned, (y, z))
        rest = sp.Matrix([_X, y, z])
        rates = dict(zip(self.eta, self.etad, strict=True))

        def moving(field: sp.Matrix) -> sp.Matrix:
            out = sp.zeros(3, 1)
            for eta, rate in rates.items():
                out += field.diff(eta) * rate
            return out

        orders = [
            v + w.cross(rest),
            w.cross(first) + moving(first),
            w.cross(second) + moving(second),
        ]
        density = (orders[0].dot(orders[0]) + orders[1].dot(orders[1])) / 2
        density += orders[0].dot(orders[1] + orders[2])
        mass, yy, zz = beam.inertia
        weights = {(0, 0): mass, (2, 0): yy, (0, 2): zz}
        sections = sp.Poly(sp.expand(density), y, z).terms()
        per_length = sp.Add(*(c * weights.get(powers, 0) for powers, c in sections))
        kinetic = _length_integral(beam, per_length)
        ea, git, eiy, eiz = beam.stiffness
        strain = ea * s.diff(_X) ** 2 + git * psi.diff(_X) ** 2
        strain += eiy * dw.diff(_X, 2) ** 2 + eiz * dv.diff(_X, 2) ** 2
        potential = _length_integral(beam, strain / 2)
        center = (
            (rest + first + second)
            .subs({y: 0, z: 0})
            .applyfunc(lambda e: _length_integral(beam, mass * e))
        )
        whole = mass * beam.length * sp.Matrix(self.place) + self.turn * center
        return kinetic, potential - gravity.dot(whole)

    def _equations(
        self, kinetic: sp.Expr, body: Mapping[sp.Symbol, sp.Expr], potential: sp.Expr
    ) -> None:
        """Functions of (q, qd): mass matrix, d/dt(dT/dqd) without qdd less dT/dq, and dV/dq."""
        inner = [*body, *self.etad]  # velocities in body axes, then the modes' rates
        hessian = sp.hessian(kinetic, inner)
        velocities = sp.Matrix([*body.values(), *self.etad])
        jacobian = velocities.jacobian(sp.Matrix(self.qd))
        rates = dict(zip(self.q, self.qd, strict=True))

        def moving(matrix: sp.Matrix) -> sp.Matrix:
            out = sp.zeros(*matrix.shape)
            for q, qd in rates.items():
                out += matrix.diff(q) * qd
            return out

        state = [*self.q, *self.qd]
        gradients = [velocities.diff(q) for q in self.q]
        hessians = [hessian.diff(q) for q in self.q]
        pieces = [
            hessian, jacobian, velocities, moving(jacobian), moving(hessian),
            sp.Matrix.hstack(*gradients), sp.Matrix([potential]).jacobian(sp.Matrix(self.q)),
            sp.Matrix.vstack(*hessians),
        ]  # fmt: skip
        self._pieces = sp.lambdify(state, pieces, "numpy", cse=True)
        self._kinematics = sp.lambdify(
            state, [self.turn, self.omega, self.omega.jacobian(sp.Matrix(self.qd))], "numpy"
        )
        self._moving_omega = sp.lambdify(
            state, moving(self.omega.jacobian(sp.Matrix(self.qd))), "numpy"
        )

    def accelerations(self, q: Array, qd: Array) -> Array:
        """Second derivatives of the coordinates."""
        M, J, y, Jd, Md, gradient, force, rows = (
            np.asarray(p, float) for p in self._pieces(*q, *qd)
        )
        y = y.ravel()
        size = len(y)
        momentum = M @ y
        stacked = rows.reshape(len(q), size, size)
        from_energy = gradient.T @ momentum + 0.5 * np.einsum("kij,i,j->k", stacked, y, y)
        bias = Jd.T @ momentum + J.T @ (Md @ y + M @ (Jd @ qd)) - from_energy + force.ravel()
        return np.asarray(np.linalg.solve(J.T @ M @ J, -bias), float)

    def angular(self, q: Array, qd: Array, qdd: Array) -> tuple[Array, Array, Array]:
        """Attitude, angular velocity and angular acceleration, the latter two in body axes."""
        turn, omega, jacobian = (np.asarray(p, float) for p in self._kinematics(*q, *qd))
        moving = np.asarray(self._moving_omega(*q, *qd), float)
        return turn, omega.ravel(), jacobian @ qdd + moving @ qd
