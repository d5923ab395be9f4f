"""Checks behind `formulas` of section 2.7.3: elastodynamics by finite elements."""

from __future__ import annotations

import sympy as sp

from mstmm.derive.definition.notation import Matrix


def modal_rows() -> bool:
    """The second row of (2.81), (2.82): Lagrange's equations give M_ff, and M_rf does not fit."""
    t = sp.Symbol("t")
    moved = [sp.Function(name)(t) for name in ("u_r", "u_f1", "u_f2")]
    rates = sp.Matrix([u.diff(t) for u in moved])
    mass = sp.Matrix(3, 3, lambda i, j: sp.Symbol(f"m_{min(i, j)}{max(i, j)}"))
    k = sp.Matrix(2, 2, lambda i, j: sp.Symbol(f"k_{min(i, j)}{max(i, j)}"))
    u_f = sp.Matrix(moved[1:])
    energy = (rates.T * mass * rates)[0] / 2 - (u_f.T * k * u_f)[0] / 2
    rows = sp.Matrix([energy.diff(u.diff(t)).diff(t) - energy.diff(u) for u in moved[1:]])
    second = rates.diff(t)
    stated = mass[1:, :1] * second[:1, :] + mass[1:, 1:] * second[1:, :] + k * u_f
    fits: bool = (rows - stated).applyfunc(sp.expand) == sp.zeros(2, 1)
    return fits and mass[:1, 1:].shape != mass[1:, 1:].shape


def _shapes(b: sp.Expr, c: sp.Expr, x: sp.Expr, y: sp.Expr) -> list[sp.Expr]:
    """(2.84), (2.85) as printed."""
    rows = [(b - x) * (c - y), (b + x) * (c - y), (b + x) * (c + y), (b - x) * (c + y)]
    return [row / (4 * b * c) for row in rows]


_B, _C, _X, _Y = sp.symbols("b c x y", positive=True)
_CORNERS = ((-1, -1), (1, -1), (1, 1), (-1, 1))


def half_edges() -> bool:
    """(2.84), (2.85) are 1 at their own node and 0 at the others for edges 2b, 2c, not b, c."""

    def at_nodes(b: sp.Expr, c: sp.Expr) -> sp.Matrix:
        return sp.Matrix(
            [[sp.simplify(n) for n in _shapes(_B, _C, i * b, j * c)] for i, j in _CORNERS]
        )

    own = at_nodes(_B, _C) == sp.eye(4)
    return bool(own and at_nodes(_B / 2, _C / 2) != sp.eye(4))


def finite_rotation() -> bool:
    """S U with the U of (2.86) is R + A(theta) x identically, and the shapes sum up to one."""
    theta, r_x, r_y = sp.symbols("theta R_x R_y", real=True)
    turn = Matrix([[sp.cos(theta), -sp.sin(theta)], [sp.sin(theta), sp.cos(theta)]])
    origin, shapes = Matrix([r_x, r_y]), _shapes(_B, _C, _X, _Y)
    nodes = [origin + turn * Matrix([i * _B, j * _C]) for i, j in _CORNERS]
    found = sum((n * node for n, node in zip(shapes, nodes, strict=True)), sp.zeros(2, 1))
    rigid = origin + turn * Matrix([_X, _Y])
    agrees: bool = (found - rigid).applyfunc(sp.simplify) == sp.zeros(2, 1)
    return agrees and sp.simplify(sum(shapes)) == 1
