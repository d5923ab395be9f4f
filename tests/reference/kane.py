"""Kane's equations of small chains by SymPy: udot from `sympy.physics.mechanics.KanesMethod`.

Chains of pin, prismatic, screw, cylindrical, universal and planar hinges; gravity, springs and
dampers of the laws.  T. R. Kane, D. A. Levinson, Dynamics: Theory and Applications, 1985.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import sympy as sp
import sympy.physics.mechanics as me

from .algebra import triad
from .jets import Array
from .laws import per_speed
from .tree import Hinge, Tree, read


@dataclass
class _Model:
    """What KanesMethod takes, gathered hinge by hinge."""

    inertial: me.ReferenceFrame
    origin: me.Point
    frames: dict[int, me.ReferenceFrame] = field(default_factory=dict)
    points: dict[int, me.Point] = field(default_factory=dict)
    bodies: list[me.RigidBody] = field(default_factory=list)
    loads: list[tuple[Any, Any]] = field(default_factory=list)


def accelerations(scene: Mapping[str, Any] | Tree) -> Callable[[Array, Array], Array]:
    """Function (q, u) -> udot of a small scene."""
    tree = read(scene)
    q = sp.Matrix(me.dynamicsymbols(f"q:{tree.nq}"))
    u = sp.Matrix(me.dynamicsymbols(f"u:{tree.nu}"))
    model = _Model(me.ReferenceFrame("N"), me.Point("O"))
    model.origin.set_vel(model.inertial, 0)
    model.frames[-1], model.points[-1] = model.inertial, model.origin
    for number in tree.order:
        _hinge(tree, tree.hinges[number], model, q, u)
    method = me.KanesMethod(
        model.inertial, list(q), list(u), kd_eqs=[b - a.diff() for a, b in zip(q, u, strict=True)]
    )
    method.kanes_equations(model.bodies, model.loads)
    plain = [sp.Symbol(f"x{i}") for i in range(2 * tree.nq)]
    swap = dict(zip([*q, *u], plain, strict=True))
    replaced = [m.xreplace(swap) for m in (method.mass_matrix, method.forcing)]
    function = sp.lambdify(plain, replaced, "numpy", cse=True)

    def solve(q_now: Array, u_now: Array) -> Array:
        matrix, right = function(*q_now, *u_now)
        return np.asarray(np.linalg.solve(matrix, right)[:, 0])

    return solve


def _exact(value: Any) -> sp.Expr:
    """Whole numbers stay whole, so that aligned scenes stay small."""
    v = float(value)
    return sp.Integer(int(v)) if v == int(v) else sp.Float(v, 17)


def _vector(frame: me.ReferenceFrame, v: Any) -> me.Vector:
    x, y, z = (_exact(c) for c in v)
    return x * frame.x + y * frame.y + z * frame.z


def _rotated_frame(name: str, frame: me.ReferenceFrame, matrix: Array) -> me.ReferenceFrame:
    """Frame whose axes are the columns of `matrix` in `frame`."""
    out = me.ReferenceFrame(name)
    out.orient_explicit(frame, sp.Matrix(3, 3, [_exact(v) for v in matrix.ravel()]))
    out.set_ang_vel(frame, 0)
    return out


def _hinge_motion(hinge: Hinge, frame: me.ReferenceFrame, q: Any, u: Any) -> tuple[Any, Any, Any]:
    """Frame of P and displacement of P from Q with its rate, in the hinge frame."""
    kind, axis = hinge.type, _vector(frame, hinge.axis)
    own, still = me.ReferenceFrame(f"P{hinge.name}"), me.Vector(0)
    if kind == "prismatic":
        own.orient_axis(frame, frame.x, 0)
        own.set_ang_vel(frame, 0)
        return own, q[0] * axis, u[0] * axis
    if kind in ("pin", "screw"):
        own.orient_axis(frame, axis, q[0])
        own.set_ang_vel(frame, u[0] * axis)
        pitch = _exact(hinge.pitch)
        return (
            (own, still, still)
            if kind == "pin"
            else (own, pitch * q[0] * axis, pitch * u[0] * axis)
        )
    if kind == "cylindrical":
        own.orient_axis(frame, axis, q[1])
        own.set_ang_vel(frame, u[1] * axis)
        return own, q[0] * axis, u[0] * axis
    if kind == "universal":
        middle = me.ReferenceFrame(f"M{hinge.name}")
        middle.orient_axis(frame, axis, q[0])
        middle.set_ang_vel(frame, u[0] * axis)
        second = _vector(middle, hinge.axis2)
        own.orient_axis(middle, second, q[1])
        own.set_ang_vel(middle, u[1] * second)
        return own, still, still
    if kind == "planar":
        e1, e2, n = (_vector(frame, column) for column in triad(hinge.axis, hinge.axis2).T)
        own.orient_axis(frame, n, q[2])
        own.set_ang_vel(frame, u[2] * n)
        return own, q[0] * e1 + q[1] * e2, u[0] * e1 + u[1] * e2
    raise ValueError(f"no Kane model of hinge type {kind!r}")


def _hinge(tree: Tree, hinge: Hinge, model: _Model, q: Any, u: Any) -> None:
    own_q, own_u = list(q[hinge.q, 0]), list(u[hinge.u, 0])
    inner, name = model.frames[hinge.parent], hinge.name
    frame = _rotated_frame(f"Q{name}", inner, hinge.Ro)
    at_q = model.points[hinge.parent].locatenew(f"Q{name}", _vector(inner, hinge.ro))
    at_q.v2pt_theory(model.points[hinge.parent], model.inertial, inner)
    outer, gap, rate = _hinge_motion(hinge, frame, own_q, own_u)
    at_p = at_q.locatenew(f"P{name}", gap)
    spin = inner.ang_vel_in(model.inertial)
    at_p.set_vel(model.inertial, at_q.vel(model.inertial) + spin.cross(gap) + rate)
    body = tree.bodies[hinge.child]
    axes = _rotated_frame(f"B{name}", outer, hinge.Rp.T)
    start = at_p.locatenew(f"I{name}", _vector(axes, -hinge.rp))
    center = at_p.locatenew(f"C{name}", _vector(axes, body.center - hinge.rp))
    for point in (start, center):
        point.v2pt_theory(at_p, model.inertial, axes)
    i = body.inertia
    entries = (i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[1, 2], i[0, 2])
    dyadic = me.inertia(axes, *map(_exact, entries))
    mass = _exact(body.mass)
    model.bodies.append(me.RigidBody(body.name, center, axes, mass, (dyadic, center)))
    model.loads.append((center, _vector(model.inertial, body.mass * tree.gravity)))
    model.frames[hinge.child], model.points[hinge.child] = axes, start
    _law(hinge, model, (frame, outer, inner), (at_q, at_p), own_q, own_u)


def _law(
    hinge: Hinge, model: _Model, frames: tuple[Any, Any, Any], points: Any, q: Any, u: Any
) -> None:
    """Springs and dampers as equal and opposite loads on both sides, at P."""
    frame, outer, inner = frames
    count = len(u)
    k, rest, c = (per_speed(hinge.law.get(key), count) for key in ("stiffness", "rest", "damping"))
    tau = [-k[i] * (q[i] - rest[i]) - c[i] * u[i] for i in range(count)]
    axis = _vector(frame, hinge.axis)
    if hinge.type in ("prismatic", "cylindrical"):
        opposite = model.points[hinge.parent].locatenew(f"R{hinge.name}", points[1].pos_from(
            model.points[hinge.parent]))  # fmt: skip
        spin = inner.ang_vel_in(model.inertial)
        gap = points[1].pos_from(points[0])
        opposite.set_vel(model.inertial, points[0].vel(model.inertial) + spin.cross(gap))
        model.loads += [(points[1], tau[0] * axis), (opposite, -tau[0] * axis)]
    torque = {
        "pin": lambda: tau[0] * axis,
        "screw": lambda: tau[0] * axis,
        "cylindrical": lambda: tau[1] * axis,
    }.get(hinge.type)
    if torque is not None:
        model.loads += [(outer, torque()), (inner, -torque())]
    elif hinge.type != "prismatic" and any(tau):
        raise ValueError(f"no Kane model of a law on hinge type {hinge.type!r}")
