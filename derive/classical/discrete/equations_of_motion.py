"""Equations of motion of a flexible body in its floating frame, from its kinetic energy.

With v, w of the frame's origin and axes (frame axes), the modal rates etad and the moments

    m,  c = int r,  J = int (r.r 1 - r r^T),  C = int phi,  G_k = int r x phi_k,
    M_kl = int phi_k . phi_l

of the deformed body, T = 1/2 m v.v + v.(w x c + C etad) + 1/2 w.J w + w.G etad + 1/2 etad.M etad.
Lagrange's equations in the quasi-velocities v, w (Boltzmann, Hamel) are, with p = dT/dv, h = dT/dw,

    dp/dt + w x p = force,   dh/dt + w x h + v x p = moment about o,   d/dt dT/detad - dT/deta = ...

c, J and G depend on eta.  They stay symbols here, with known derivatives by eta, to keep equations
and tangents short.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import sympy as sp

Vector: TypeAlias = sp.MatrixBase
#: Symbol -> its derivatives by the modal coordinates.
Gradient: TypeAlias = Mapping[sp.Symbol, Sequence[sp.Expr]]


@dataclass(frozen=True)
class Moments:
    """Moments of the deformed body in frame axes: c (3), J (3 x 3), C and G (3 x n), M (n x n).

    `gradient` holds the derivatives by eta of every symbol in c, J, G and in `gradient` itself.
    """

    mass: sp.Expr
    first: Vector
    second: Vector
    shift: Vector
    spin: Vector
    modal: Vector
    gradient: Gradient


@dataclass(frozen=True)
class Motion:
    """Symbols of the motion in frame axes: three entries per vector, some zero in the plane."""

    a: Vector
    w: Vector
    wd: Vector
    eta: Vector
    etad: Vector
    etadd: Vector


@dataclass(frozen=True)
class Equations:
    """Rows (force, moment about o, modes) and their derivatives, each p + n high, frame axes.

    `mass` by [a; wd; etadd], `rates` by [w; etad] (its first columns, by v, are zero), `shape` by
    eta.  Rows and columns of zero directions (out of the plane) are left out.
    """

    rows: Vector
    mass: Vector
    rates: Vector
    shape: Vector


def equations_of_motion(moments: Moments, motion: Motion, elastic: Vector) -> Equations:
    """Rows of inertia plus `elastic` (n x 1: the forces of strain and damping).

    Raises ValueError if the velocity of the origin itself does not drop out.
    """
    n = motion.eta.rows
    v = sp.Matrix([sp.Dummy(f"v_{k}") if s != 0 else 0 for k, s in enumerate(motion.a)])
    energy = kinetic_energy(moments, v, motion)
    momentum, spin = _gradient(energy, v), _gradient(energy, motion.w)
    modal = _gradient(energy, motion.etad)

    def by_eta(expression: sp.Expr, k: int) -> sp.Expr:
        return total_derivative(expression, motion.eta, moments.gradient, k)

    def rate(expression: sp.Expr) -> sp.Expr:
        relative = motion.a - motion.w.cross(v)
        symbol_rates = zip((*v, *motion.w, *motion.etad), (*relative, *motion.wd, *motion.etadd),
                     strict=True)  # fmt: skip
        explicit_rate = sum(expression.diff(s) * r for s, r in symbol_rates if s != 0)
        return explicit_rate + sum(by_eta(expression, k) * motion.etad[k] for k in range(n))

    force = momentum.applyfunc(rate) + motion.w.cross(momentum)
    moment = spin.applyfunc(rate) + motion.w.cross(spin) + v.cross(momentum)
    shapes = sp.Matrix(n, 1, lambda k, _: rate(modal[k]) - by_eta(energy, k))
    frame = [*_existing_entries(force, motion.a), *_existing_entries(moment, motion.w)]
    rows = sp.Matrix([*frame, *(shapes + elastic)]).applyfunc(sp.expand)
    if rows.free_symbols & v.free_symbols:
        raise ValueError("the velocity of the frame's origin does not drop out of its equations")
    return _with_derivatives(rows, moments.gradient, motion)


def kinetic_energy(moments: Moments, v: Vector, motion: Motion) -> sp.Expr:
    """T for the frame's velocity v, w and the modal rates."""
    w, etad = motion.w, motion.etad
    relative_velocity = w.cross(moments.first) + moments.shift * etad
    total = moments.mass * v.dot(v) / 2 + v.dot(relative_velocity) + w.dot(moments.second * w) / 2
    if etad.rows:
        total += w.dot(moments.spin * etad) + etad.dot(moments.modal * etad) / 2
    return sp.expand(total)


def total_derivative(expression: sp.Expr, eta: Vector, gradient: Gradient, k: int) -> sp.Expr:
    """Derivative by eta_k, through the symbols whose gradients are given."""
    implicit_terms = [
        expression.diff(s) * slopes[k] for s, slopes in gradient.items() if slopes[k] != 0
    ]
    return expression.diff(eta[k]) + sp.Add(*implicit_terms)


def _with_derivatives(rows: Vector, gradient: Gradient, motion: Motion) -> Equations:
    accelerations = [*_existing_entries(motion.a), *_existing_entries(motion.wd), *motion.etadd]
    speeds = [*_existing_entries(motion.w), *motion.etad]
    zero_columns = sp.zeros(rows.rows, len(_existing_entries(motion.a)))
    return Equations(
        rows,
        rows.jacobian(accelerations),
        zero_columns.row_join(rows.jacobian(speeds)) if speeds else zero_columns,
        sp.Matrix(
            rows.rows, motion.eta.rows,
            lambda i, k: total_derivative(rows[i], motion.eta, gradient, k),
        ),
    )  # fmt: skip


def _gradient(energy: sp.Expr, symbols: Vector) -> Vector:
    return symbols.applyfunc(lambda s: energy.diff(s) if s != 0 else sp.Integer(0))


def _existing_entries(values: Vector, pattern: Vector | None = None) -> list[sp.Expr]:
    """Entries along non-zero directions."""
    pattern = values if pattern is None else pattern
    return [value for value, s in zip(values, pattern, strict=True) if s != 0]
