"""Fixed and smooth hinges between rigid and flexible bodies, planar and spatial.

The pairings differ only in the rotation of the sections at the hinge.  In the plane theta + Theta
eta is the angle of a section; in space psi + S (eta - eta_p) is the small rotation from its
predicted orientation, S the section rotation per mode in inertial axes.
"""

from __future__ import annotations

import sympy as sp

from ...definition.derivation import Derivation, Equation, Quantity, vector
from ...definition.notation import Matrix, Tilde, explicit
from . import hinge as flexible_hinge
from .hinge import FlexibleHinge, Pairing
from .state import PLANE, Space

SECTION_MEANING = "section rotation per mode at the {} side of the hinge"


def section_rotation(pair: Pairing, end: str) -> sp.MatrixExpr:
    """Rotation of the section at the end I or O of the hinge."""
    block_at, modes = (
        (pair.input_block, pair.inboard) if end == "I" else (pair.output_block, pair.outboard)
    )
    angle = block_at(pair.space.angle)
    if not modes:
        return angle
    slopes, eta = section_slopes(pair.space, modes, end), block_at("eta")
    if pair.space.planar:
        return angle + slopes * eta
    return angle + slopes * (eta - vector(f"eta_p{end}", modes))


def section_slopes(space: Space, modes: int, end: str) -> sp.MatrixSymbol:
    """Section rotation per mode at the end I or O of the hinge."""
    name = "Theta" if space.planar else "S"
    return sp.MatrixSymbol(f"{name}_{end}", space.rotation_count, modes)


def section_inputs(pair: Pairing) -> tuple[Quantity, ...]:
    """Section rotations per mode and, in space, the predicted modal coordinates."""
    quantities = []
    for end, modes, side in (("I", pair.inboard, "inboard"), ("O", pair.outboard, "outboard")):
        if not modes:
            continue
        axes = "" if pair.space.planar else ", inertial axes"
        slopes = section_slopes(pair.space, modes, end)
        quantities.append(Quantity(slopes, "1/m", SECTION_MEANING.format(side) + axes))
        if not pair.space.planar:
            eta = vector(f"eta_p{end}", modes)
            quantities.append(Quantity(eta, "m", f"predicted modal coordinates, {side} body"))
    return tuple(quantities)


def _transmission_equations(pair: Pairing) -> tuple[Equation, ...]:
    return (
        Equation("one point", pair.output_block("r"), pair.input_block("r")),
        Equation("moment transmitted", pair.output_block("m"), pair.input_block("m")),
        Equation("force transmitted", pair.output_block("q"), pair.input_block("q")),
    )


def fixed_hinge(
    pair: Pairing, element: str, source: str, equation: str, number: str = ""
) -> Derivation:
    """A weld: common point, constant relative orientation."""
    turns = pair.space.rotation_count
    name = "gamma" if pair.space.planar else "beta"
    meaning = (
        "angle of the outboard from the inboard section"
        if pair.space.planar
        else "inboard less outboard section at the predictor (0 where the weld is closed)"
    )
    weld = Equation(
        "one rotation",
        section_rotation(pair, "O"),
        section_rotation(pair, "I") + vector(name, turns),
        number,
    )
    premises = (*_transmission_equations(pair), weld)
    return flexible_hinge.derivation(
        FlexibleHinge(
            element=element,
            title=f"fixed hinge ({pair.space.name}), discrete-time classical matrix",
            pairing=pair,
            inputs=(*section_inputs(pair), Quantity(vector(name, turns), "rad", meaning)),
            premises=premises,
            relations=premises,
            source=source,
            equation=equation,
        )
    )


# --- smooth hinges ----------------------------------------------------------------------------


def smooth_hinge(
    pair: Pairing, element: str, source: str, equation: str, number: str = ""
) -> Derivation:
    """Planar pin, or ball: the rotation is free, the next hinge's moment is given."""
    turns = pair.space.rotation_count
    effort, angle = vector("tau_n", turns), pair.space.angle
    free = vector("x_turn", turns)
    free_rotation = Equation("free rotation", pair.output_block(angle), free, "", "an unknown")
    title = "smooth pin (planar)" if pair.space.planar else "smooth ball"
    state = pair.state_out
    moment_start = state.sizes[0] + state.sizes[1]
    rows = Matrix(
        turns, state.length, lambda i, j: _condition_entry(i, j, moment_start, state.length, effort)
    )
    return flexible_hinge.derivation(
        FlexibleHinge(
            element=element,
            title=f"{title}, discrete-time classical matrix",
            pairing=pair,
            inputs=(Quantity(effort, "N*m", "moment of the next hinge (0: smooth, or free tip)"),),
            premises=(*_transmission_equations(pair), free_rotation),
            relations=(*_transmission_equations(pair), free_rotation),
            source=source,
            equation=equation,
            free=free,
            next_rows=rows,
            conditions=(
                Equation("moment of the next hinge", vector("m_N", turns), effort, number),
            ),
            notes=(_NEXT_HINGE_NOTE,),
        )
    )


_NEXT_HINGE_NOTE = (
    "The outboard body's far end N carries a hinge of the same kind, or is free; any other next "
    "hinge needs the Riccati sweep."
)


def _condition_entry(i: int, j: int, first: int, length: int, effort: sp.MatrixSymbol) -> sp.Expr:
    if j == length - 1:
        return -effort[i, 0]
    return sp.Integer(j == first + i)


def pin_hinge(
    pair: Pairing, element: str, source: str, equation: str, number: str = ""
) -> Derivation:
    """Pin in space: one free angle; the next pin's axis rotates with its section."""
    axis, free = vector("a", 3), vector("x_turn", 1)
    rotation_equation = Equation(
        "rotation about the axis only", section_rotation(pair, "O"),
        section_rotation(pair, "I") + axis * free + vector("beta", 3),
    )  # fmt: skip
    inputs, condition, rows = _next_pin_condition(pair, number)
    return flexible_hinge.derivation(
        FlexibleHinge(
            element=element,
            title="smooth pin in space, discrete-time classical matrix",
            pairing=pair,
            inputs=(
                *section_inputs(pair),
                Quantity(axis, "1", "axis, unit vector, inertial axes"),
                Quantity(
                    vector("beta", 3), "rad",
                    "inboard less outboard section at the predictor, across the axis",
                ),
                *inputs,
            ),
            premises=(*_transmission_equations(pair), rotation_equation),
            relations=(*_transmission_equations(pair), rotation_equation),
            source=source,
            equation=equation,
            free=free,
            next_rows=rows,
            conditions=(condition,),
            notes=(
                _NEXT_HINGE_NOTE,
                "The condition is that of the next axis as it rotates with its section, "
                "a_n + s x a_n, to first order.",
            ),
        )
    )  # fmt: skip


def _next_pin_condition(
    pair: Pairing, number: str
) -> tuple[tuple[Quantity, ...], Equation, Matrix]:
    """a_n . m + (s_N x a_n) . m_n = tau_n, s_N the rotation of the section at the next pin."""
    axis, carried_moment, effort = vector("a_n", 3), vector("m_n", 3), vector("tau_n", 1)
    inputs = [
        Quantity(axis, "1", "axis of the next pin, unit vector, inertial axes"),
        Quantity(carried_moment, "N*m", "moment carried by the next pin at the predictor"),
        Quantity(effort, "N*m", "effort of the next pin (0: smooth)"),
    ]
    modes = pair.outboard
    turn: sp.MatrixExpr = vector("psi_N", 3)
    lever = Tilde(axis) * carried_moment
    constant = -effort[0, 0]
    blocks = [sp.zeros(1, 3), explicit(lever).T, explicit(axis).T, sp.zeros(1, 3)]
    if modes:
        slopes, eta = sp.MatrixSymbol("S_N", 3, modes), vector("eta_pO", modes)
        inputs.append(
            Quantity(slopes, "1/m", "section rotation per mode at the next pin, inertial axes")
        )
        turn = turn + slopes * (vector("eta_N", modes) - eta)
        modal_row = explicit(lever).T * explicit(slopes)
        blocks.append(modal_row)
        constant -= (modal_row * explicit(eta))[0, 0]
    rows = Matrix(sp.Matrix.hstack(*map(sp.Matrix, blocks), sp.Matrix([[constant]])))
    condition = Equation(
        "moment about the next axis", axis.T * vector("m_N", 3) + lever.T * turn, effort, number
    )
    return tuple(inputs), condition, rows


__all__ = [
    "PLANE",
    "fixed_hinge",
    "pin_hinge",
    "section_inputs",
    "section_rotation",
    "section_slopes",
    "smooth_hinge",
]
