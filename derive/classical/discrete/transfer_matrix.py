"""Transfer matrix and modal rows of a body from its linearised residual."""

from __future__ import annotations

import sympy as sp

from ...definition.derivation import Equation, vector
from ...definition.notation import Matrix
from .body_options import BodyStatement
from .mass_moments import ETA
from .state import Space, constant_rows, row_block, rows_of


def transfer_equations(statement: BodyStatement) -> tuple[Equation, ...]:
    """Definitions of U and W from Z and F."""
    space, modes = statement.space, statement.modes
    state = space.state(modes)
    n, size, shifts, turns = (
        state.length,
        space.rigid_count + modes,
        space.translation_count,
        space.rotation_count,
    )
    balance, step = sp.MatrixSymbol("b", size, n), sp.MatrixSymbol("Y", size, n)
    lever, shift = vector("rho", shifts), sp.MatrixSymbol("rho_z", shifts, n)
    force, moment = sp.MatrixSymbol("Q_O", shifts, n), sp.MatrixSymbol("M_O", turns, n)
    q_p, impedance = vector("q_p", shifts), sp.MatrixSymbol("Z", size, size)
    turn, last = row_block(step, shifts, turns), rows_of(state, "1")
    end_equations = _end_equations(statement)
    end_displacement = space.rotate(lever, turn)
    if modes:
        end_displacement = end_displacement + sp.MatrixSymbol("P", shifts, modes) * row_block(
            step, space.rigid_count, modes
        )
    moment_rows = (
        rows_of(state, "m")
        - row_block(balance, shifts, turns)
        - space.moment(lever, force)
        - space.change_moment(shift, q_p)
    )
    blocks = [
        [rows_of(state, "r") + shift + constant_rows(lever, state)],
        [rows_of(state, space.angle)],
        [moment],
        [force],
        *([[rows_of(state, "eta")]] if modes else []),
        [last],
    ]
    definitions = [
        Equation(
            "step from the predictor", step, _predictor_step(space, modes), "", "y - y_p = Y z_I"
        ),
        Equation(
            "inertia and elasticity",
            balance,
            impedance * step + vector("F", size) * last,
            "",
            "rows of the frame and of the modes on z_I",
        ),
        *end_equations,
        Equation("change of the output end", shift, end_displacement, "", "of r_O - r_I"),
        Equation(
            "force at the output end", force, rows_of(state, "q") - row_block(balance, 0, shifts)
        ),
        Equation("moment at the output end", moment, moment_rows),
        Equation(
            "transfer matrix",
            sp.MatrixSymbol("U", n, n),
            sp.BlockMatrix(blocks),
            statement.equation,
        ),
    ]
    if modes:
        definitions.append(_modal_row_equation(space, modes))
    return tuple(definitions)


def _predictor_step(space: Space, modes: int) -> Matrix:
    """Y: y - y_p in terms of z_I; the spatial angle is already an increment."""
    state = space.state(modes)
    names = [("r", vector("r_p", space.translation_count)), (space.angle, None)]
    if space.planar:
        names[1] = ("theta", vector("theta_p", 1))
    if modes:
        names.append(("eta", vector(ETA, modes)))
    blocks = []
    for name, predicted in names:
        block_rows = sp.Matrix(rows_of(state, name))
        if predicted is not None:
            block_rows[:, state.length - 1] = -predicted.as_explicit()
        blocks.append(block_rows)
    return Matrix(sp.Matrix.vstack(*blocks))


_LEVER_NAME = "output end from the input end"


def _end_equations(statement: BodyStatement) -> tuple[Equation, ...]:
    """Lever rho and shapes P, S_O, S_I of the ends in inertial axes."""
    space, modes = statement.space, statement.modes
    rotation = sp.MatrixSymbol("R", space.translation_count, space.translation_count)
    lever = vector("rho", space.translation_count)
    if not modes:
        return (Equation(_LEVER_NAME, lever, rotation * vector("r_e", space.translation_count)),)
    end_at_rest, shapes = _output_end_shapes(statement)
    shape_symbol = sp.MatrixSymbol("P", space.translation_count, modes)
    equations = [
        Equation(_LEVER_NAME, lever, rotation * (end_at_rest + shapes * vector(ETA, modes))),
        Equation("shapes at the output end", shape_symbol, rotation * shapes),
    ]
    for name in ("O", "I"):
        rotation_symbol = sp.MatrixSymbol(f"Theta_{name}", space.rotation_count, modes)
        inertial_rotation = rotation_symbol if space.planar else rotation * rotation_symbol
        meaning = "output" if name == "O" else "input"
        equations.append(
            Equation(
                f"section rotation at the {meaning} end",
                sp.MatrixSymbol(f"S_{name}", space.rotation_count, modes), inertial_rotation,
            )
        )  # fmt: skip
    return tuple(equations)


def _output_end_shapes(statement: BodyStatement) -> tuple[sp.Basic, sp.Basic]:
    """Position at rest and shapes of the output end, frame axes."""
    space, modes = statement.space, statement.modes
    if statement.kind == "beam" and space.planar:
        length, deflection = sp.MatrixSymbol("L", 1, 1), sp.MatrixSymbol("phi_O", 1, modes)
        return (
            Matrix([length[0, 0], 0]),
            Matrix(2, modes, lambda i, j: deflection[0, j] if i else sp.Integer(0)),
        )
    return vector("r_e", space.translation_count), sp.MatrixSymbol(
        "Phi_O", space.translation_count, modes
    )


def _modal_row_equation(space: Space, modes: int) -> Equation:
    """Modal balance with q_O, m_O of z_I; loads rotate relative to the frame by its rotation."""
    state = space.state(modes)
    n, size, turns = state.length, space.rigid_count + modes, space.rotation_count
    step = sp.MatrixSymbol("Y", size, n)
    frame_rotation = row_block(step, space.translation_count, turns)
    shapes = sp.MatrixSymbol("P", space.translation_count, modes)
    at_output, at_input = (sp.MatrixSymbol(f"S_{end}", turns, modes) for end in "OI")
    q_p = vector("q_p", space.translation_count)
    modal_load = row_block(sp.MatrixSymbol("b", size, n), space.rigid_count, modes) + shapes.T * (
        sp.MatrixSymbol("Q_O", space.translation_count, n) - space.rotate(q_p, frame_rotation)
    )
    output_moment, input_moment = sp.MatrixSymbol("M_O", turns, n), rows_of(state, "m")
    if space.planar:
        modal_load = modal_load + at_output.T * output_moment - at_input.T * input_moment
    else:
        m_p, m_pi = vector("m_p", 3), vector("m_pI", 3)
        modal_load = (
            modal_load
            + at_output.T * (output_moment - space.rotate(m_p, frame_rotation))
            - at_input.T * (input_moment - space.rotate(m_pi, frame_rotation))
            + sp.MatrixSymbol("K_g", modes, modes) * row_block(step, space.rigid_count, modes)
        )
    return Equation(
        "modal rows",
        sp.MatrixSymbol("W", modes, n),
        modal_load,
        "",
        "equations of vibration on z_I",
    )
