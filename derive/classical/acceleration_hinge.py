"""Acceleration hinge with any free directions (of six, in the plane three), cf. (5.74).

Rui, Wang, Zhang, ch. 5, (5.62) to (5.74), release all six directions and move the efforts of
springs and dampers to the loads of the two bodies.  Here the efforts stay in the hinge: along a
free direction the wrench at the outboard point is the given tau.  The offset d of the outboard from
the inboard point is kept: the inboard side is also loaded by d x q.
"""

from __future__ import annotations

import sympy as sp

from ..definition.derivation import Derivation, Equation, Quantity, vector
from ..definition.notation import Matrix, Perp, Tilde, matrix_symbols
from . import hinge_relation
from .hinge_relation import HingeStatement
from .state_vector import PLANAR, SPATIAL

SPATIAL_DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")
PLANAR_DIRECTIONS = ("x", "y", "rz")

_NOTES = (
    "alpha are the absolute accelerations of the outboard point along the free directions; where "
    "all translations (or all rotations) are free they, and tau_n, refer to the inertial axes.",
    "tau_n are efforts of the next hinge, which frees the same directions of its own axes A_n.",
)


def derivation(free: tuple[str, ...] = SPATIAL_DIRECTIONS, planar: bool = False) -> Derivation:
    """U_h of a hinge with given efforts along the directions `free`.

    `free` names directions of the hinge axes in this order: x y z (translations), rx ry rz
    (rotations); in the plane x y rz.  Raises ValueError for none, unknown or repeated directions.
    """
    return hinge_relation.derivation(statement(free, planar))


def statement(free: tuple[str, ...] = SPATIAL_DIRECTIONS, planar: bool = False) -> HingeStatement:
    """Premises of the hinge with these free directions."""
    directions = PLANAR_DIRECTIONS if planar else SPATIAL_DIRECTIONS
    if not free or len(set(free)) != len(free) or not set(free) <= set(directions):
        raise ValueError(
            f"free directions: expected some of {', '.join(directions)}, each once, found {free}"
        )
    free_directions = tuple(name for name in directions if name in free)
    is_complete = free_directions == directions
    name = "planar" if planar else "spatial"
    suffix = "" if is_complete else "_" + "_".join(free_directions)
    build = _planar_premises if planar else _spatial_premises
    inputs, premises, conditions = build(free_directions)
    return HingeStatement(
        element=f"classical_acceleration_{name}{suffix}",
        title=f"acceleration hinge ({name}; free {' '.join(free_directions)}), classical transfer "
        f"matrix",
        state=PLANAR if planar else SPATIAL,
        free=vector("alpha", len(free_directions)),
        inputs=inputs,
        premises=premises,
        conditions=conditions,
        source="(5.62) to (5.74)",
        equation="(5.74)",
        notes=_NOTES,
    )


Parts = tuple[tuple[Quantity, ...], tuple[Equation, ...], tuple[Equation, ...]]


def _spatial_premises(free: tuple[str, ...]) -> Parts:
    translations, rotations = _split_directions(free, SPATIAL_DIRECTIONS, 3)
    alpha, tau = vector("alpha", len(free)), vector("tau_n", len(free))
    axes, next_axes = sp.MatrixSymbol("A", 3, 3), sp.MatrixSymbol("A_n", 3, 3)
    offset, next_offset = vector("d", 3), vector("d_n", 3)
    eta_v, eta_w = vector("eta_v", 3), vector("eta_w", 3)
    rdd_i, wd_i, m_i, q_i = SPATIAL.end_blocks("I")
    rdd_o, wd_o, m_o, q_o = SPATIAL.end_blocks("O")
    _, _, m_n, q_n = SPATIAL.end_blocks("N")
    carried_acceleration = rdd_i - Tilde(offset) * wd_i + eta_v
    transmitted_moment = m_i - Tilde(offset) * q_i
    next_moment = m_n - Tilde(next_offset) * q_n
    premises = (
        Equation(
            "acceleration outboard of the hinge",
            rdd_o,
            _combine_directions(axes, carried_acceleration, translations, alpha, 0),
        ),
        Equation(
            "angular acceleration outboard of the hinge",
            wd_o,
            _combine_directions(axes, wd_i + eta_w, rotations, alpha, len(translations)),
        ),
        Equation(
            "moment transmitted", m_o, transmitted_moment, "(5.63)", "the offset carries the force"
        ),
        Equation("force transmitted", q_o, q_i, "(5.65)"),
    )
    conditions = (
        *_effort_conditions("force", next_axes, q_n, translations, tau, 0),
        *_effort_conditions("moment", next_axes, next_moment, rotations, tau, len(translations)),
    )
    symbols = (axes, offset, eta_v, eta_w, next_axes, next_offset, tau)
    return _parts(symbols, premises, conditions)


def _planar_premises(free: tuple[str, ...]) -> Parts:
    translations, rotations = _split_directions(free, PLANAR_DIRECTIONS, 2)
    alpha, tau = vector("alpha", len(free)), vector("tau_n", len(free))
    axes, next_axes = sp.MatrixSymbol("A", 2, 2), sp.MatrixSymbol("A_n", 2, 2)
    offset, next_offset = vector("d", 2), vector("d_n", 2)
    eta_v, eta_w = vector("eta_v", 2), sp.MatrixSymbol("eta_w", 1, 1)
    rdd_i, wd_i, m_i, q_i = PLANAR.end_blocks("I")
    rdd_o, wd_o, m_o, q_o = PLANAR.end_blocks("O")
    _, _, m_n, q_n = PLANAR.end_blocks("N")
    carried_acceleration = rdd_i + wd_i[0, 0] * Perp(offset) + eta_v
    outboard_rotation = Matrix([[alpha[len(translations), 0]]]) if rotations else wd_i + eta_w
    premises = (
        Equation(
            "acceleration outboard of the hinge",
            rdd_o,
            _combine_directions(axes, carried_acceleration, translations, alpha, 0),
        ),
        Equation("angular acceleration outboard of the hinge", wd_o, outboard_rotation),
        Equation("moment transmitted", m_o, m_i - Perp(offset).T * q_i, "(5.63)"),
        Equation("force transmitted", q_o, q_i, "(5.65)"),
    )
    conditions = _effort_conditions("force", next_axes, q_n, translations, tau, 0)
    if rotations:
        effort = Matrix([[tau[len(translations), 0]]])
        next_moment = m_n - Perp(next_offset).T * q_n
        conditions += (Equation("next hinge's moment", next_moment, effort, "(5.67)"),)
    symbols = (axes, offset, eta_v, eta_w, next_axes, next_offset, tau)
    return _parts(symbols, premises, conditions)


_INPUTS = (
    ("1", "hinge axes (columns) in inertial axes"),
    ("m", "outboard from inboard point, inertial axes"),
    ("m/s2", "relative acceleration at rest of the speeds, inertial axes"),
    ("rad/s2", "relative angular acceleration at rest of the speeds"),
    ("1", "axes (columns) of the next hinge in inertial axes"),
    ("m", "offset of the next hinge, inertial axes"),
    ("N, N*m", "efforts of the next hinge along its free directions"),
)


def _parts(
    symbols: tuple[sp.MatrixSymbol, ...],
    premises: tuple[Equation, ...],
    conditions: tuple[Equation, ...],
) -> Parts:
    """Inputs (complete sets of directions need no axes), premises and conditions.

    `symbols` are those of `_INPUTS`.
    """
    used_symbols: set[sp.MatrixSymbol] = set()
    for equation in (*premises, *conditions):
        used_symbols |= matrix_symbols(equation.left) | matrix_symbols(equation.right)
    inputs = tuple(
        Quantity(symbol, unit, meaning)
        for symbol, (unit, meaning) in zip(symbols, _INPUTS, strict=True)
        if symbol in used_symbols
    )
    return inputs, premises, conditions


def _split_directions(
    free: tuple[str, ...], known: tuple[str, ...], shifts: int
) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Indices of the free translations and of the free rotations among the hinge axes."""
    indices = [known.index(name) for name in free]
    return tuple(i for i in indices if i < shifts), tuple(
        i - shifts for i in indices if i >= shifts
    )


def _combine_directions(
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
    fixed_mask = sp.diag(*(int(i not in free) for i in range(size)))
    free_part = sp.zeros(size, 1)
    for position, index in enumerate(free):
        free_part[index, 0] = alpha[at + position, 0]
    return axes * Matrix(fixed_mask) * axes.T * carried + axes * Matrix(free_part)


def _effort_conditions(
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
    selection = Matrix(len(free), int(axes.rows), lambda i, j: int(j == free[i]))
    return (Equation(f"next hinge's {kind}", selection * axes.T * load, efforts, number),)
