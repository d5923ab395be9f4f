"""Discrete-time transfer matrices of rigid and flexible bodies, planar and spatial.

One residual (`equations_of_motion`) and one linear time map yd = C y + D, ydd = A y + B, expanded
once at a predictor: Z = A M + C dR/dyd + dR/dy.  The frame's rows give the loads at the output end,
geometry gives its position, and the modal coordinates are the same at both ends: z_O = U z_I.  The
modal rows are no part of U.  In terms of z_I they are W z_I = 0, which the hinge before the body
needs.
"""

from __future__ import annotations

import sympy as sp

from ...definition.derivation import Derivation, Equation, Quantity, tilde, vector
from ...definition.notation import Matrix
from .body_options import (
    BOOK,
    TANGENT_OPERATOR,
    A,
    BodyStatement,
    C,
    Space,
    body_inputs,
    constant_rows,
    rotate_plane_column,
    row_block,
    rows_of,
)
from .body_residual import planar_premises, spatial_premises
from .equations_of_motion import Equations, Motion, equations_of_motion
from .mass_moments import ETA, BodyMoments, SymbolTable, planar_moments, spatial_moments

# --- linearised residual --------------------------------------------------------------------------


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
    turn = row_block(step, shifts, turns)
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
    definitions = [
        Equation(
            "step from the predictor", step, _predictor_step(space, modes), "", "y - y_p = Y z_I"
        ),
        Equation(
            "inertia and elasticity",
            balance,
            impedance * step + vector("F", size) * rows_of(state, "1"),
            "",
            "rows of the frame and of the modes on z_I",
        ),
        *_end_equations(statement),
        Equation("change of the output end", shift, end_displacement, "", "of r_O - r_I"),
        Equation(
            "force at the output end", force, rows_of(state, "q") - row_block(balance, 0, shifts)
        ),
        Equation("moment at the output end", moment, moment_rows),
        Equation(
            "transfer matrix",
            sp.MatrixSymbol("U", n, n),
            _transfer_matrix(statement, shift + constant_rows(lever, state), moment, force),
            statement.equation,
        ),
    ]
    if modes:
        definitions.append(_modal_row_equation(space, modes))
    return tuple(definitions)


def _transfer_matrix(
    statement: BodyStatement, displacement: sp.Basic, moment: sp.Basic, force: sp.Basic
) -> sp.BlockMatrix:
    """U from the rows of r_O - r_I and of the loads at the output end, all on z_I."""
    space, state = statement.space, statement.space.state(statement.modes)
    modal_rows = [[rows_of(state, "eta")]] if statement.modes else []
    return sp.BlockMatrix(
        [
            [rows_of(state, "r") + displacement],
            [rows_of(state, space.angle)],
            [moment],
            [force],
            *modal_rows,
            [rows_of(state, "1")],
        ]
    )


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


# --- matrices -------------------------------------------------------------------------------------


def derivation(statement: BodyStatement) -> Derivation:
    """U (z_O = U z_I) and, with modes, W (W z_I = 0) of the body."""
    space, modes = statement.space, statement.modes
    letters = SymbolTable()
    build = planar_moments if space.planar else spatial_moments
    extra = () if space.planar else (statement.planes,)
    body = build(modes, letters, statement.kind, *extra)
    motion = _motion_symbols(space, modes, letters)
    body_equations = equations_of_motion(body.moments, motion, _elastic_forces(body, motion))
    n = space.length(modes)
    outputs = [Quantity(sp.MatrixSymbol("U", n, n), space.state(modes).unit, "matrix, z_O = U z_I")]
    if modes:
        outputs.append(Quantity(sp.MatrixSymbol("W", modes, n), "N", "modal rows, W z_I = 0"))
    return Derivation(
        element=f"classical_{statement.element}",
        title=statement.title,
        inputs=(*body.inputs, *body_inputs(statement)),
        outputs=tuple(outputs),
        definitions=(
            *_kinematic_equations(space, modes),
            *body.definitions,
            *_linearised_equations(space, modes, body_equations, letters),
            *transfer_equations(statement),
        ),
        premises=(planar_premises if space.planar else spatial_premises)(statement, body),
        sources=(f"{BOOK}, {statement.source}",),
        notes=(*_NOTES, *statement.notes),
    )


_NOTES = (
    "State [r; angle; m; q; eta; 1] (mstmm.derive.classical.discrete.body_options) in inertial "
    "axes; the frame's origin is the input end, where every shape vanishes.",
    "A, C (numbers) and B, D (vectors) are the linear time map; r_p, angle and eta_p the "
    "predictor; q_p and m_p the loads there. Terms of second order in the step from it are "
    "dropped.",
    "det U = 1 at every motion; its product with the hinge before it is symplectic only where Z is "
    "symmetric (at rest).",
)


# --- the residual and its linear form ---------------------------------------------------------


def _motion_symbols(space: Space, modes: int, letters: SymbolTable) -> Motion:
    def three(name: str, size: int, offset: int) -> sp.Matrix:
        return sp.Matrix(
            [*[0] * offset, *letters.entries_of(vector(name, size)), *[0] * (3 - offset - size)]
        )

    def modal(name: str) -> sp.Matrix:
        return letters.entries_of(vector(name, modes)) if modes else sp.zeros(0, 1)

    turning = 3 - space.rotation_count
    return Motion(
        three("a", space.translation_count, 0), three("w", space.rotation_count, turning),
        three("wd", space.rotation_count, turning), modal(ETA), modal("etad"), modal("etadd"),
    )  # fmt: skip


def _elastic_forces(body: BodyMoments, motion: Motion) -> sp.Matrix:
    if body.stiffness is None or body.damping is None:
        return sp.zeros(0, 1)
    return body.stiffness * motion.eta + body.damping * motion.etad


def _kinematic_equations(space: Space, modes: int) -> tuple[Equation, ...]:
    """Motion at the predictor, in frame axes."""
    rotation = sp.MatrixSymbol("R", space.translation_count, space.translation_count)
    equations_ = [Equation("frame axes at the predictor", rotation, _frame_axes(space))]
    w, wd = vector("w", space.rotation_count), vector("wd", space.rotation_count)
    if space.planar:
        theta = vector("theta_p", 1)
        equations_ += [
            Equation("angular velocity", w, C * theta + vector("D_theta", 1)),
            Equation("angular acceleration", wd, A * theta + vector("B_theta", 1)),
        ]
    else:
        equations_ += [
            Equation("angular velocity", w, vector("D_w", 3)),
            Equation("angular acceleration", wd, vector("B_w", 3)),
        ]
    size = space.translation_count
    specific_acceleration = A * vector("r_p", size) + vector("B_r", size) - vector("g", size)
    equations_.append(
        Equation(
            "acceleration less gravity, frame axes",
            vector("a", size),
            rotation.T * specific_acceleration,
        )
    )
    if modes:
        eta, etad, etadd = (vector(name, modes) for name in (ETA, "etad", "etadd"))
        equations_ += [
            Equation("modal speeds", etad, C * eta + vector("D_eta", modes)),
            Equation("modal accelerations", etadd, A * eta + vector("B_eta", modes)),
        ]
    return tuple(equations_)


def _frame_axes(space: Space) -> sp.Basic:
    if not space.planar:
        return sp.MatrixSymbol("R_p", 3, 3)
    theta = vector("theta_p", 1)[0, 0]
    cosine, sine = sp.cos(theta), sp.sin(theta)
    return Matrix([[cosine, -sine], [sine, cosine]])


def _linearised_equations(
    space: Space, modes: int, solved: Equations, letters: SymbolTable
) -> tuple[Equation, ...]:
    """Residual at the predictor and Z = A M + C dR/dyd + dR/dy, in inertial axes."""
    size = space.rigid_count + modes
    mass, rates, shape = (sp.MatrixSymbol(name, size, size) for name in ("M", "N_b", "L_b"))
    rows, impedance = vector("F_b", size), sp.MatrixSymbol("Z", size, size)
    rotation_rows, axes = sp.eye(size), sp.eye(size)
    if not space.planar:
        rotation_rows[3:6, 3:6] = TANGENT_OPERATOR.as_explicit()
    rotation = sp.MatrixSymbol("R", space.translation_count, space.translation_count).as_explicit()
    axes[: space.translation_count, : space.translation_count] = rotation
    if not space.planar:
        axes[3:6, 3:6] = rotation
    x, t = sp.MatrixSymbol("X", size, size), Matrix(rotation_rows)
    dynamic = A * mass + C * rates
    return (
        Equation("residual, frame axes", rows, letters.to_matrix_entries(solved.rows)),
        Equation("mass matrix", mass, letters.to_matrix_entries(solved.mass), "", "d F_b / d ydd"),
        Equation(
            "by the speeds", rates, letters.to_matrix_entries(solved.rates), "", "d F_b / d yd"
        ),
        Equation(
            "by the coordinates",
            shape,
            _coordinate_derivative(space, modes, solved, letters),
            "",
            "d F_b / d y; the rotation of the frame changes a and the rows themselves",
        ),
        Equation("frame axes of rows and columns", x, Matrix(axes)),
        Equation(
            "one Newton step",
            impedance,
            x * ((dynamic * t if not space.planar else dynamic) + shape) * x.T,
            "",
            "Z = A M + C dR/dyd + dR/dy, inertial axes",
        ),
        Equation(
            "residual at the predictor", vector("F", size), x * rows - _external_loads(space, modes)
        ),
    )


def _coordinate_derivative(
    space: Space, modes: int, solved: Equations, letters: SymbolTable
) -> Matrix:
    """Derivative columns of r (zero), of the frame's rotation, and of eta."""
    size, shifts, turns = space.rigid_count + modes, space.translation_count, space.rotation_count
    a, mass, rows = vector("a", shifts), sp.MatrixSymbol("M", size, size), vector("F_b", size)
    by_a = Matrix(size, shifts, lambda i, j: mass[i, j])
    force = Matrix(shifts, 1, lambda i, _: rows[i, 0])
    acceleration_part = -by_a * rotate_plane_column(a) if space.planar else by_a * tilde(a)
    rotation_part = sp.zeros(size, turns)
    if space.planar:
        rotation_part[:2, :] = rotate_plane_column(force)
    else:
        moment = Matrix(3, 1, lambda i, _: rows[3 + i, 0])
        rotation_part[:3, :], rotation_part[3:6, :] = -tilde(force), -tilde(moment)
    columns = [
        sp.zeros(size, shifts),
        sp.Matrix(acceleration_part) + rotation_part,
        letters.to_matrix_entries(solved.shape),
    ]
    return Matrix(sp.Matrix.hstack(*(c for c in columns if c.cols)))


def _external_loads(space: Space, modes: int) -> Matrix:
    blocks = [("f_r", space.translation_count), ("f_m", space.rotation_count), ("f_eta", modes)]
    return Matrix([vector(name, k)[i, 0] for name, k in blocks if k for i in range(k)])
