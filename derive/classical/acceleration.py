"""Acceleration hinge along any of its six (in the plane three) directions, cf. (5.74).

Rui, Wang, Zhang, ch. 5, (5.62) to (5.74), free all six directions and move the efforts of springs
and dampers to the loads of the two bodies.  Here the efforts stay in the hinge: along a free
direction the wrench at the outboard point is the given tau.  The offset d of the outboard from the
inboard point is kept: the inboard side also feels d x q.
"""

from __future__ import annotations

import sympy as sp

from ..language.derivation import Derivation, Equation, Quantity, vector
from ..language.notation import Matrix, Perp, Tilde, matrix_symbols
from . import hinge_relation
from .hinge_relation import HingeStatement
from .state import PLANAR, SPATIAL

SPATIAL_DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")
PLANAR_DIRECTIONS = ("x", "y", "rz")

_NOTES = (
    "alpha are the absolute accelerations of the outboard point along the free directions; where "
    "all translations (or all rotations) are free they, and tau_n, refer to the inertial axes.",
    "tau_n are efforts of the next hinge, which frees the same directions of its own axes A_n.",
)


def derivation(free: tuple[str, ...] = SPATIAL_DIRECTIONS, planar: bool = False) -> Derivation:
    """U_h of the hinge that leaves the directions `free` to given efforts.

    `free` names directions of the hinge axes in this order: x y z (translations), rx ry rz
    (rotations); in the plane x y rz.  Raises ValueError for none, unknown or repeated directions.
    """
    return hinge_relation.derivation(statement(free, planar))


def statement(free: tuple[str, ...] = SPATIAL_DIRECTIONS, planar: bool = False) -> HingeStatement:
    """Premises of the hinge with these free directions."""
    known = PLANAR_DIRECTIONS if planar else SPATIAL_DIRECTIONS
    if not free or len(set(free)) != len(free) or not set(free) <= set(known):
        raise ValueError(f"free directions are some of {', '.join(known)}, each once; not {free}")
    ordered = tuple(name for name in known if name in free)
    complete = ordered == known
    name = "planar" if planar else "spatial"
    suffix = "" if complete else "_" + "_".join(ordered)
    build = _planar_premises if planar else _spatial_premises
    inputs, premises, conditions = build(ordered)
    return HingeStatement(
        element=f"classical_acceleration_{name}{suffix}",
        title=f"acceleration hinge ({name}; free {' '.join(ordered)}), classical transfer matrix",
        state=PLANAR if planar else SPATIAL,
        free=vector("alpha", len(ordered)),
        inputs=inputs,
        premises=premises,
        conditions=conditions,
        source="(5.62) to (5.74)",
        equation="(5.74)",
        notes=_NOTES,
    )


Parts = tuple[tuple[Quantity, ...], tuple[Equation, ...], tuple[Equation, ...]]


def _spatial_premises(free: tuple[str, ...]) -> Parts:
    shifts, turns = _split(free, SPATIAL_DIRECTIONS, 3)
    alpha, tau = vector("alpha", len(free)), vector("tau_n", len(free))
    axes, next_axes = sp.MatrixSymbol("A", 3, 3), sp.MatrixSymbol("A_n", 3, 3)
    offset, next_offset = vector("d", 3), vector("d_n", 3)
    eta_v, eta_w = vector("eta_v", 3), vector("eta_w", 3)
    rdd_i, wd_i, m_i, q_i = SPATIAL.at("I")
    rdd_o, wd_o, m_o, q_o = SPATIAL.at("O")
    _, _, m_n, q_n = SPATIAL.at("N")
    carried = rdd_i - Tilde(offset) * wd_i + eta_v
    transmitted = m_i - Tilde(offset) * q_i
    next_moment = m_n - Tilde(next_offset) * q_n
    premises = (
        Equation("acceleration behind the hinge", rdd_o, _along(axes, carried, shifts, alpha, 0)),
        Equation(
            "angular acceleration behind the hinge", wd_o,
            _along(axes, wd_i + eta_w, turns, alpha, len(shifts)),
        ),
        Equation("moment transmitted", m_o, transmitted, "(5.63)", "the offset carries the force"),
        Equation("force transmitted", q_o, q_i, "(5.65)"),
    )  # fmt: skip
    conditions = (
        *_efforts("force", next_axes, q_n, shifts, tau, 0),
        *_efforts("moment", next_axes, next_moment, turns, tau, len(shifts)),
    )
    inputs = (
        Quantity(axes, "1", "hinge axes (columns) in inertial axes"),
        Quantity(offset, "m", "outboard from inboard point, inertial axes"),
        Quantity(eta_v, "m/s2", "relative acceleration at rest of the speeds, inertial axes"),
        Quantity(eta_w, "rad/s2", "relative angular acceleration at rest of the speeds"),
        Quantity(next_axes, "1", "axes (columns) of the next hinge in inertial axes"),
        Quantity(next_offset, "m", "offset of the next hinge, inertial axes"),
        Quantity(tau, "N, N*m", "efforts of the next hinge along its free directions"),
    )
    return _used(inputs, premises, conditions), premises, conditions


def _planar_premises(free: tuple[str, ...]) -> Parts:
    shifts, turns = _split(free, PLANAR_DIRECTIONS, 2)
    alpha, tau = vector("alpha", len(free)), vector("tau_n", len(free))
    axes, next_axes = sp.MatrixSymbol("A", 2, 2), sp.MatrixSymbol("A_n", 2, 2)
    offset, next_offset = vector("d", 2), vector("d_n", 2)
    eta_v, eta_w = vector("eta_v", 2), sp.MatrixSymbol("eta_w", 1, 1)
    rdd_i, wd_i, m_i, q_i = PLANAR.at("I")
    rdd_o, wd_o, m_o, q_o = PLANAR.at("O")
    _, _, m_n, q_n = PLANAR.at("N")
    carried = rdd_i + wd_i[0, 0] * Perp(offset) + eta_v
    turned = Matrix([[alpha[len(shifts), 0]]]) if turns else wd_i + eta_w
    premises = (
        Equation("acceleration behind the hinge", rdd_o, _along(axes, carried, shifts, alpha, 0)),
        Equation("angular acceleration behind the hinge", wd_o, turned),
        Equation("moment transmitted", m_o, m_i - Perp(offset).T * q_i, "(5.63)"),
        Equation("force transmitted", q_o, q_i, "(5.65)"),
    )
    conditions = _efforts("force", next_axes, q_n, shifts, tau, 0)
    if turns:
        effort = Matrix([[tau[len(shifts), 0]]])
        next_moment = m_n - Perp(next_offset).T * q_n
        conditions += (Equation("next hinge's moment", next_moment, effort, "(5.67)"),)
    inputs = (
        Quantity(axes, "1", "hinge axes (columns) in inertial axes"),
        Quantity(offset, "m", "outboard from inboard point, inertial axes"),
        Quantity(eta_v, "m/s2", "relative acceleration at rest of the speeds, inertial axes"),
        Quantity(eta_w, "rad/s2", "relative angular acceleration at rest of the speeds"),
        Quantity(next_axes, "1", "axes (columns) of the next hinge in inertial axes"),
        Quantity(next_offset, "m", "offset of the next hinge, inertial axes"),
        Quantity(tau, "N, N*m", "efforts of the next hinge along its free directions"),
    )
    return _used(inputs, premises, conditions), premises, conditions


def _split(
    free: tuple[str, ...], known: tuple[str, ...], shifts: int
) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Indices of the free translations and of the free rotations among the hinge axes."""
    indices = [known.index(name) for name in free]
    return tuple(i for i in indices if i < shifts), tuple(
        i - shifts for i in indices if i >= shifts
    )


def _along(
    axes: sp.MatrixSymbol,
    carried: sp.MatExpr,
    free: tuple[int, ...],
    alpha: sp.MatrixSymbol,
    at: int,
) -> sp.MatrixExpr:
    """`carried` along the fixed directions, alpha along the free ones."""
    size = int(axes.rows)
    if not free:
        return carried
    if len(free) == size:
        return Matrix([alpha[at + i, 0] for i in range(size)])
    held = sp.diag(*(int(i not in free) for i in range(size)))
    chosen = sp.zeros(size, 1)
    for position, index in enumerate(free):
        chosen[index, 0] = alpha[at + position, 0]
    return axes * Matrix(held) * axes.T * carried + axes * Matrix(chosen)


def _efforts(
    kind: str,
    axes: sp.MatrixSymbol,
    load: sp.MatrixExpr,
    free: tuple[int, ...],
    tau: sp.MatrixSymbol,
    at: int,
) -> tuple[Equation, ...]:
    """Condition on the next hinge's load: its components along the free directions are tau."""
    if not free:
        return ()
    efforts = Matrix([tau[at + i, 0] for i in range(len(free))])
    number = "(5.66)" if kind == "force" else "(5.67)"
    if len(free) == int(axes.rows):
        return (Equation(f"next hinge's {kind}", load, efforts, number),)
    chosen = Matrix(len(free), int(axes.rows), lambda i, j: int(j == free[i]))
    return (Equation(f"next hinge's {kind}", chosen * axes.T * load, efforts, number),)  # fmt: skip


def _used(
    inputs: tuple[Quantity, ...], premises: tuple[Equation, ...], conditions: tuple[Equation, ...]
) -> tuple[Quantity, ...]:
    """Inputs that some equation mentions (full sets of directions need no axes)."""
    mentioned: set[sp.MatrixSymbol] = set()
    for equation in (*premises, *conditions):
        mentioned |= matrix_symbols(equation.left) | matrix_symbols(equation.right)
    return tuple(quantity for quantity in inputs if quantity.symbol in mentioned)
