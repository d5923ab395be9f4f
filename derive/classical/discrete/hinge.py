"""Discrete-time matrices of hinges next to flexible bodies, by elimination.

Outboard of a hinge the state is z_O = E z_I + G x, where x contains the free unknowns: the hinge's
own free directions and the modal coordinates of the outboard beam.  They follow from V z_O = 0: the
modal rows W of the outboard body and, for a smooth hinge, the next hinge's condition L on the load
at the far end of that body, L U z_O = 0.  So

    U_h = E - G (V G)^-1 V E.

A flexible inboard body only changes the columns of E (section rotation of the inboard end), a
flexible outboard body the rows of V.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from ...definition.derivation import Derivation, Equation, Quantity, Solve, vector
from ...definition.notation import Matrix, Tilde, explicit, solve_linear
from ..state_vector import StateVector, append_affine_row
from .body_options import BOOK, PLANE, Space

#: Bodies connected by a hinge, inboard first.
PAIRINGS = ("rigid_rigid", "rigid_beam", "beam_beam", "beam_rigid")


@dataclass(frozen=True)
class Pairing:
    """A hinge between two bodies with these numbers of modes; 0 means rigid."""

    space: Space
    inboard: int
    outboard: int

    @property
    def state_in(self) -> StateVector:
        """State at the hinge's input end: coordinates of the inboard body."""
        return self.space.state(self.inboard)

    @property
    def state_out(self) -> StateVector:
        """State at its output end: coordinates of the outboard body."""
        return self.space.state(self.outboard)

    def input_block(self, name: str) -> sp.MatrixSymbol:
        """Block of the state at the input end."""
        return _block(self.state_in, name, "I")

    def output_block(self, name: str) -> sp.MatrixSymbol:
        """Block of the state at the output end."""
        return _block(self.state_out, name, "O")

    @property
    def description(self) -> str:
        """Description of the pairing."""
        kinds = ["a flexible body" if n else "a rigid body" for n in (self.inboard, self.outboard)]
        return f"{kinds[0]} inboard, {kinds[1]} outboard"


def named_pairing(space: Space, name: str, modes: int) -> Pairing:
    """Pairing with this name; every beam has `modes` modes."""
    inboard, outboard = (modes * int(side == "beam") for side in name.split("_"))
    return Pairing(space, inboard, outboard)


def _block(state: StateVector, name: str, end: str) -> sp.MatrixSymbol:
    return vector(f"{name}_{end}", state.sizes[state.names.index(name)])


@dataclass(frozen=True)
class FlexibleHinge:
    """Premises of one hinge.

    `relations` give the blocks at O from those at I and the free unknowns, linearly (or `carry`
    gives E and G); `free` are the hinge's own unknowns; `next_rows` L are rows on the state at the
    far end N of the outboard body.
    """

    element: str
    title: str
    pairing: Pairing
    inputs: tuple[Quantity, ...]
    premises: tuple[Equation, ...]
    source: str
    equation: str
    relations: tuple[Equation, ...] = ()
    carry: tuple[sp.Basic, Matrix] | None = None
    free: sp.MatrixSymbol | None = None
    next_rows: Matrix | None = None
    conditions: tuple[Equation, ...] = ()
    definitions: tuple[Equation, ...] = ()
    notes: tuple[str, ...] = ()


def derivation(hinge: FlexibleHinge) -> Derivation:
    """U_h of z_O = U_h z_I."""
    pair = hinge.pairing
    n_in, n_out = pair.state_in.length, pair.state_out.length
    return Derivation(
        element=f"classical_{hinge.element}",
        title=hinge.title,
        inputs=(*_body_inputs(hinge), *hinge.inputs),
        outputs=(
            Quantity(
                sp.MatrixSymbol("U_h", n_out, n_in), pair.state_out.unit, "matrix, z_O = U_h z_I"
            ),
        ),
        definitions=(*hinge.definitions, *_elimination_equations(hinge)),
        premises=(*hinge.premises, *_vibration_premise(hinge), *hinge.conditions),
        sources=(f"{BOOK}, {hinge.source}",),
        notes=(f"{pair.description.capitalize()}. {_STATE_NOTE}", *hinge.notes),
    )


_STATE_NOTE = (
    "Same states, predictor and linear time map as the bodies' matrices "
    "(classical_beam_planar_discrete, classical_beam_spatial_discrete)."
)


def _body_inputs(hinge: FlexibleHinge) -> tuple[Quantity, ...]:
    """Matrices of the outboard body that the hinge needs."""
    n, quantities = hinge.pairing.state_out.length, []
    if hinge.next_rows is not None:
        unit = hinge.pairing.state_out.unit
        quantities.append(Quantity(sp.MatrixSymbol("U", n, n), unit, "matrix of the outboard body"))
    if hinge.pairing.outboard:
        rows = sp.MatrixSymbol("W", hinge.pairing.outboard, n)
        quantities.append(Quantity(rows, "N", "modal rows of the outboard body"))
    return tuple(quantities)


def _vibration_premise(hinge: FlexibleHinge) -> tuple[Equation, ...]:
    """W z_O = 0, as a premise."""
    pair = hinge.pairing
    if not pair.outboard:
        return ()
    n = pair.state_out.length
    blocks = [[symbol] for symbol in pair.state_out.end_blocks("O")]
    state = sp.BlockMatrix([*blocks, [Matrix([[1]])]])
    rows = sp.MatrixSymbol("W", pair.outboard, n)
    return (
        Equation(
            "equations of vibration of the outboard body", rows * state,
            sp.ZeroMatrix(pair.outboard, 1),
        ),
    )  # fmt: skip


def _elimination_equations(hinge: FlexibleHinge) -> tuple[Equation, ...]:
    pair = hinge.pairing
    n_in, n_out = pair.state_in.length, pair.state_out.length
    carry, free = hinge.carry or elimination_matrices(hinge)
    transfer_symbol = sp.MatrixSymbol("U_h", n_out, n_in)
    if not free.cols:
        return (Equation("transfer matrix", transfer_symbol, carry, hinge.equation),)
    e, g = sp.MatrixSymbol("E", n_out, n_in), sp.MatrixSymbol("G", n_out, free.cols)
    rows, gain = (sp.MatrixSymbol("V", free.cols, n_out), sp.MatrixSymbol("K", free.cols, n_in))
    return (
        Equation("carried state", e, carry, "", "z_O at x = 0"),
        Equation("free unknowns", g, free, "", "d z_O / d x, x = [own freedom; eta_O]"),
        Equation("conditions", rows, _condition_rows(hinge), "", "V z_O = 0"),
        Equation("gain", gain, Solve(rows * g, rows * e), "", "x = -K z_I"),
        Equation("transfer matrix", transfer_symbol, e - g * gain, hinge.equation),
    )


def _condition_rows(hinge: FlexibleHinge) -> sp.Basic:
    n = hinge.pairing.state_out.length
    blocks: list[sp.Basic] = []
    if hinge.next_rows is not None:
        blocks.append(hinge.next_rows * sp.MatrixSymbol("U", n, n))
    if hinge.pairing.outboard:
        blocks.append(sp.MatrixSymbol("W", hinge.pairing.outboard, n))
    return blocks[0] if len(blocks) == 1 else sp.BlockMatrix([[block] for block in blocks])


def elimination_matrices(hinge: FlexibleHinge) -> tuple[Matrix, Matrix]:
    """E and G of z_O = E z_I + G x, solved from the relations."""
    pair = hinge.pairing
    unknowns: Sequence[sp.MatrixSymbol] = pair.state_out.end_blocks("O")
    free_unknowns = (hinge.free,) if hinge.free is not None else ()
    inner = pair.state_in.length - 1
    relations = hinge.relations
    if pair.outboard:
        coordinates = vector("x_eta", pair.outboard)
        relations = (*relations, Equation("", pair.output_block("eta"), coordinates))
        free_unknowns = (*free_unknowns, coordinates)
    rows = solve_linear(relations, unknowns, (*pair.state_in.end_blocks("I"), *free_unknowns))
    count = sum(int(symbol.rows) for symbol in free_unknowns)
    carried_state = rows[:, :inner].row_join(rows[:, inner + count :])
    free_columns = rows[:, inner : inner + count]
    return append_affine_row(Matrix(carried_state)), Matrix(
        sp.Matrix(free_columns).col_join(sp.zeros(1, count))
    )


# --- fixed and smooth hinges ----------------------------------------------------------------------
# The pairings differ only in the rotation of the sections at the hinge.  In the plane theta + Theta
# eta is the angle of a section; in space psi + S (eta - eta_p) is the small rotation from its
# predicted orientation, S the section rotation per mode in inertial axes.

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
    return derivation(
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
    return derivation(
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
    return derivation(
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
