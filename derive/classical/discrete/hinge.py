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
from ...definition.notation import Matrix, solve_linear
from ..state_vector import StateVector, append_affine_row
from .state import BOOK, Space

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
