"""Transfer matrix and modal rows of a body from its linearised residual."""

from __future__ import annotations

import sympy as sp

from ...language.derivation import Equation, vector
from ...language.notation import Matrix
from .moments import ETA
from .state import Space, constant, part, rows_of
from .statement import BodyStatement


def transfer(statement: BodyStatement) -> tuple[Equation, ...]:
    """Definitions of U and W from Z and F."""
    space, modes = statement.space, statement.modes
    state = space.state(modes)
    n, size, shifts, turns = state.length, space.rigid + modes, space.shifts, space.turns
    balance, step = sp.MatrixSymbol("b", size, n), sp.MatrixSymbol("Y", size, n)
    lever, shift = vector("rho", shifts), sp.MatrixSymbol("rho_z", shifts, n)
    force, moment = sp.MatrixSymbol("Q_O", shifts, n), sp.MatrixSymbol("M_O", turns, n)
    q_p, impedance = vector("q_p", shifts), sp.MatrixSymbol("Z", size, size)
    turn, last = part(step, shifts, turns), rows_of(state, "1")
    ends = _ends(statement)
    moved = space.turned(lever, turn)
    if modes:
        moved = moved + sp.MatrixSymbol("P", shifts, modes) * part(step, space.rigid, modes)
    moment_rows = (
        rows_of(state, "m")
        - part(balance, shifts, turns)
        - space.moment(lever, force)
        - space.change_moment(shift, q_p)
    )
    blocks = [
        [rows_of(state, "r") + shift + constant(lever, state)],
        [rows_of(state, space.angle)],
        [moment],
        [force],
        *([[rows_of(state, "eta")]] if modes else []),
        [last],
    ]
    definitions = [
        Equation("step from the predictor", step, _step(space, modes), "", "y - y_p = Y z_I"),
        Equation(
            "inertia and elasticity", balance, impedance * step + vector("F", size) * last,
            "", "rows of the frame and of the modes on z_I",
        ),
        *ends,
        Equation("change of the output end", shift, moved, "", "of r_O - r_I"),
        Equation("force at the output end", force, rows_of(state, "q") - part(balance, 0, shifts)),
        Equation("moment at the output end", moment, moment_rows),
        Equation("transfer matrix", sp.MatrixSymbol("U", n, n), sp.BlockMatrix(blocks),
                 statement.equation),
    ]  # fmt: skip
    if modes:
        definitions.append(_modal_rows(space, modes))
    return tuple(definitions)


def _step(space: Space, modes: int) -> Matrix:
    """Y: y - y_p in terms of z_I; the spatial angle is a step already."""
    state = space.state(modes)
    names = [("r", vector("r_p", space.shifts)), (space.angle, None)]
    if space.planar:
        names[1] = ("theta", vector("theta_p", 1))
    if modes:
        names.append(("eta", vector(ETA, modes)))
    blocks = []
    for name, at in names:
        picked = sp.Matrix(rows_of(state, name))
        if at is not None:
            picked[:, state.length - 1] = -at.as_explicit()
        blocks.append(picked)
    return Matrix(sp.Matrix.vstack(*blocks))


_LEVER = "output end from the input end"


def _ends(statement: BodyStatement) -> tuple[Equation, ...]:
    """Lever rho and shapes P, S_O, S_I of the ends in inertial axes."""
    space, modes = statement.space, statement.modes
    rotation = sp.MatrixSymbol("R", space.shifts, space.shifts)
    lever = vector("rho", space.shifts)
    if not modes:
        return (Equation(_LEVER, lever, rotation * vector("r_e", space.shifts)),)
    at, shapes = _output_end(statement)
    moved = sp.MatrixSymbol("P", space.shifts, modes)
    found = [
        Equation(_LEVER, lever, rotation * (at + shapes * vector(ETA, modes))),
        Equation("shapes at the output end", moved, rotation * shapes),
    ]
    for name in ("O", "I"):
        turn = sp.MatrixSymbol(f"Theta_{name}", space.turns, modes)
        shown = turn if space.planar else rotation * turn
        meaning = "output" if name == "O" else "input"
        found.append(
            Equation(
                f"section rotation at the {meaning} end",
                sp.MatrixSymbol(f"S_{name}", space.turns, modes), shown,
            )
        )  # fmt: skip
    return tuple(found)


def _output_end(statement: BodyStatement) -> tuple[sp.Basic, sp.Basic]:
    """Place at rest and shapes of the output end, frame axes."""
    space, modes = statement.space, statement.modes
    if statement.kind == "beam" and space.planar:
        length, deflection = sp.MatrixSymbol("L", 1, 1), sp.MatrixSymbol("phi_O", 1, modes)
        return (
            Matrix([length[0, 0], 0]),
            Matrix(2, modes, lambda i, j: deflection[0, j] if i else sp.Integer(0)),
        )
    return vector("r_e", space.shifts), sp.MatrixSymbol("Phi_O", space.shifts, modes)


def _modal_rows(space: Space, modes: int) -> Equation:
    """Modal balance with q_O, m_O of z_I; the loads turn against the frame by its own turn."""
    state = space.state(modes)
    n, size, turns = state.length, space.rigid + modes, space.turns
    step = sp.MatrixSymbol("Y", size, n)
    turn = part(step, space.shifts, turns)
    shapes = sp.MatrixSymbol("P", space.shifts, modes)
    at_output, at_input = (sp.MatrixSymbol(f"S_{end}", turns, modes) for end in "OI")
    q_p = vector("q_p", space.shifts)
    total = (
        part(sp.MatrixSymbol("b", size, n), space.rigid, modes)
        + shapes.T * (sp.MatrixSymbol("Q_O", space.shifts, n) - space.turned(q_p, turn))
    )  # fmt: skip
    outer, inner = sp.MatrixSymbol("M_O", turns, n), rows_of(state, "m")
    if space.planar:
        total = total + at_output.T * outer - at_input.T * inner
    else:
        m_p, m_pi = vector("m_p", 3), vector("m_pI", 3)
        total = (
            total
            + at_output.T * (outer - space.turned(m_p, turn))
            - at_input.T * (inner - space.turned(m_pi, turn))
            + sp.MatrixSymbol("K_g", modes, modes) * part(step, space.rigid, modes)
        )
    return Equation(
        "modal rows", sp.MatrixSymbol("W", modes, n), total, "", "equations of vibration on z_I"
    )
