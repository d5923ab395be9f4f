"""Spring hinges between rigid and flexible bodies: linear springs and dampers, torsion.

The springs rotate with the inboard section: their load is that of the predictor, rotated with it,
less Z = k + C c times the change of their elongation in the section's axes (law k nu + c nud with
the time map nud = C nu + D).  The inboard side is also loaded by d x q.
"""

from __future__ import annotations

import sympy as sp

from ...definition.derivation import Derivation, Equation, Quantity, Solve, vector
from ...definition.notation import Matrix, Perp, Tilde
from . import hinge as flexible_hinge
from .body_options import rows_of
from .hinge import FlexibleHinge, Pairing, section_inputs, section_rotation, section_slopes

MAP_C = sp.MatrixSymbol("C", 1, 1)
C = MAP_C[0, 0]


def planar_spring(pair: Pairing, element: str, source: str, equation: str) -> Derivation:
    """Two linear springs and a torsion spring m = -(k_1 x + k_3 x^3 + c_r xd).

    x = phi - phi_0.
    """
    d_s, q_s = vector("d_s", 2), vector("q_s", 2)
    turn = section_rotation(pair, "I") - vector("theta_s", 1)
    r_i, m_i, q_i = (pair.input_block(name) for name in "rmq")
    r_o, m_o, q_o = (pair.output_block(name) for name in "rmq")
    elongation_change = r_o - r_i - d_s
    angle = section_rotation(pair, "O") - section_rotation(pair, "I")
    impedance = _impedance("t", 2)
    lever = Equation(
        "moment at both ends",
        m_o,
        m_i - Perp(d_s).T * q_i + Perp(q_s).T * elongation_change,
        "(8.111)",
        "the inboard end also feels d x q",
    )
    force_balance = Equation("force at both ends", q_o, q_i, "(8.106), (8.107)")
    return flexible_hinge.derivation(
        FlexibleHinge(
            element=element,
            title="spring hinge (planar, nonlinear torsion spring), discrete-time classical matrix",
            pairing=pair,
            inputs=(*section_inputs(pair), *_planar_inputs()),
            premises=(
                Equation(
                    "linear springs",
                    q_o,
                    q_s + Perp(q_s) * turn - impedance * (elongation_change - Perp(d_s) * turn),
                    "(8.106), (8.107)",
                ),
                Equation("angle between the sections", vector("phi", 1), angle),
                Equation(
                    "torsion spring", m_o, _torsion_moment(vector("phi", 1)), "(8.108), (8.109)"
                ),
                force_balance,
                lever,
            ),
            carry=_elimination_matrices(pair),
            source=source,
            equation=equation,
            definitions=(
                *_planar_law_equations(),
                *_compliance_equations(2, 1),
                *_carried_row_equations(pair),
            ),
            notes=_NOTES,
        )
    )


_NOTES = (
    "Where the springs carry nothing and have no length at the predictor (q_s = 0, d_s = 0) this "
    "is the relation of the book, which neglects d x q and the rotation of the springs.",
)


def _planar_inputs() -> tuple[Quantity, ...]:
    return (
        Quantity(sp.MatrixSymbol("k_t", 2, 2), "N/m", "stiffness, inertial axes at the predictor"),
        Quantity(sp.MatrixSymbol("c_t", 2, 2), "N*s/m", "damping, inertial axes at the predictor"),
        Quantity(vector("k_1", 1), "N*m/rad", "torsional stiffness"),
        Quantity(vector("k_3", 1), "N*m/rad3", "cubic torsional stiffness"),
        Quantity(vector("c_r", 1), "N*m*s/rad", "torsional damping"),
        Quantity(MAP_C, "1/s", "time map, yd = C y + D"),
        Quantity(vector("D_phi", 1), "rad/s", "D of the angle between the sections"),
        Quantity(vector("phi_0", 1), "rad", "angle at which the torsion spring is at rest"),
        Quantity(vector("phi_s", 1), "rad", "predicted angle between the sections"),
        Quantity(vector("theta_s", 1), "rad", "predicted angle of the inboard section"),
        Quantity(vector("d_s", 2), "m", "predicted outboard from inboard point, inertial axes"),
        Quantity(vector("q_s", 2), "N", "force of springs and dampers at the predictor"),
    )


def _impedance(name: str, size: int) -> sp.MatrixExpr:
    """k + C c of linear springs and dampers."""
    return sp.MatrixSymbol(f"k_{name}", size, size) + C * sp.MatrixSymbol(f"c_{name}", size, size)


def _torsion_moment(angle: sp.MatrixSymbol) -> Matrix:
    """-(k_1 x + k_3 x^3 + c_r xd) with x = angle - phi_0 and the time map of the angle."""
    x = angle[0, 0] - vector("phi_0", 1)[0, 0]
    k_1, k_3, c_r = (vector(name, 1)[0, 0] for name in ("k_1", "k_3", "c_r"))
    rate = C * angle[0, 0] + vector("D_phi", 1)[0, 0]
    return Matrix([-(k_1 * x + k_3 * x**3 + c_r * rate)])


def _planar_law_equations() -> tuple[Equation, ...]:
    predicted, angle = vector("phi_s", 1), sp.Symbol("phi")
    moment = _torsion_moment(predicted)
    slope = -moment[0, 0].xreplace({predicted[0, 0]: angle}).diff(angle)
    return (
        Equation("moment of the torsion spring", vector("m_s", 1), moment, "(8.108)"),
        Equation("its derivative", sp.MatrixSymbol("Z_r", 1, 1),
                 Matrix([slope.xreplace({angle: predicted[0, 0]})]), "(8.110)"),
        Equation("impedance of the springs", sp.MatrixSymbol("Z_t", 2, 2), _impedance("t", 2)),
    )  # fmt: skip


def _compliance_equations(shifts: int, turns: int) -> tuple[Equation, ...]:
    return tuple(
        Equation(
            "compliance", sp.MatrixSymbol(f"Y_{name}", size, size),
            Solve(sp.MatrixSymbol(f"Z_{name}", size, size), sp.Identity(size)),
        )
        for name, size in (("t", shifts), ("r", turns))
    )  # fmt: skip


def spatial_spring(pair: Pairing, element: str, source: str, equation: str) -> Derivation:
    """Linear and torsional springs with any tangent, linearised at the predictor."""
    d_s, q_s, m_s = vector("d_s", 3), vector("q_s", 3), vector("m_s", 3)
    turn, outboard_rotation = section_rotation(pair, "I"), section_rotation(pair, "O")
    r_i, m_i, q_i = (pair.input_block(name) for name in "rmq")
    r_o, m_o, q_o = (pair.output_block(name) for name in "rmq")
    elongation_change = r_o - r_i - d_s
    impedance, stiffness = _impedance("t", 3), _impedance("r", 3)
    lever = Equation(
        "moment at both ends", m_o, m_i - Tilde(d_s) * q_i + Tilde(q_s) * elongation_change, "",
        "the inboard end also feels d x q",
    )  # fmt: skip
    force_balance = Equation("force at both ends", q_o, q_i, "(8.212)")
    return flexible_hinge.derivation(
        FlexibleHinge(
            element=element,
            title="elastic hinge (spatial), discrete-time classical matrix",
            pairing=pair,
            inputs=(*section_inputs(pair), *_spatial_inputs()),
            premises=(
                Equation(
                    "linear springs",
                    q_o,
                    q_s - Tilde(q_s) * turn - impedance * (elongation_change + Tilde(d_s) * turn),
                    "(8.213)",
                ),
                Equation(
                    "torsion springs",
                    m_o,
                    m_s - Tilde(m_s) * turn - stiffness * (outboard_rotation - turn),
                    "(8.215)",
                ),
                force_balance,
                lever,
            ),
            carry=_elimination_matrices(pair),
            source=source,
            equation=equation,
            definitions=(
                *_spatial_law_equations(),
                *_compliance_equations(3, 3),
                *_carried_row_equations(pair),
            ),
            notes=_NOTES,
        )
    )


def _spatial_inputs() -> tuple[Quantity, ...]:
    return (
        Quantity(sp.MatrixSymbol("k_t", 3, 3), "N/m", "stiffness, inertial axes at the predictor"),
        Quantity(sp.MatrixSymbol("c_t", 3, 3), "N*s/m", "damping, inertial axes at the predictor"),
        Quantity(
            sp.MatrixSymbol("k_r", 3, 3), "N*m/rad",
            "tangent of the torsion springs by the outboard section's rotation, inertial axes",
        ),
        Quantity(sp.MatrixSymbol("c_r", 3, 3), "N*m*s/rad", "torsional damping, inertial axes"),
        Quantity(MAP_C, "1/s", "time map, yd = C y + D"),
        Quantity(vector("d_s", 3), "m", "predicted outboard from inboard point, inertial axes"),
        Quantity(vector("q_s", 3), "N", "force of springs and dampers at the predictor"),
        Quantity(vector("m_s", 3), "N*m", "moment of springs and dampers at the predictor"),
    )  # fmt: skip


def _spatial_law_equations() -> tuple[Equation, ...]:
    return tuple(
        Equation(
            "impedance of the springs", sp.MatrixSymbol(f"Z_{name}", 3, 3), _impedance(name, 3)
        )
        for name in "tr"
    )


# --- the springs' relations solved for the outboard side ------------------------------------------


def _carried_row_equations(pair: Pairing) -> tuple[Equation, ...]:
    """Rows on z_I: rotations of both sections, change of the elongation, moment."""
    space, state = pair.space, pair.state_in
    d_s, q_s, m_s = (
        vector("d_s", space.translation_count),
        vector("q_s", space.translation_count),
        vector("m_s", space.rotation_count),
    )
    unit_row = rows_of(state, "1")
    turn, change, moment, outboard_angle = _row_symbols(pair)
    elastic_force = rows_of(state, "q") - q_s * unit_row - space.rotate(q_s, turn)
    elastic_moment = moment - m_s * unit_row
    if not space.planar:
        elastic_moment = elastic_moment - space.rotate(m_s, turn)
    predicted_angle = (
        (vector("theta_s", 1) + vector("phi_s", 1)) * unit_row if space.planar else None
    )
    outboard_rotation = (
        turn - sp.MatrixSymbol("Y_r", space.rotation_count, space.rotation_count) * elastic_moment
    )
    return (
        Equation(
            "rotation of the inboard section", turn, _section_rotation_rows(pair), "", "on z_I"
        ),
        Equation(
            "change of the elongation",
            change,
            space.rotate(d_s, turn)
            - sp.MatrixSymbol("Y_t", space.translation_count, space.translation_count)
            * elastic_force,
        ),
        Equation(
            "moment on the outboard side",
            moment,
            rows_of(state, "m")
            - space.moment(d_s, rows_of(state, "q"))
            - space.change_moment(change, q_s),
        ),
        Equation(
            "outboard section",
            outboard_angle,
            outboard_rotation if predicted_angle is None else outboard_rotation + predicted_angle,
            "",
            "its angle" if space.planar else "its rotation",
        ),
    )


def _row_symbols(pair: Pairing) -> tuple[sp.MatrixSymbol, ...]:
    space, n = pair.space, pair.state_in.length
    sizes = {
        "s_z": space.rotation_count,
        "d_z": space.translation_count,
        "m_z": space.rotation_count,
        "o_z": space.rotation_count,
    }
    return tuple(sp.MatrixSymbol(name, size, n) for name, size in sizes.items())


def _section_rotation_rows(pair: Pairing) -> Matrix:
    """Section rotation at the input end less the predicted one, as rows on z_I."""
    space, state, modes = pair.space, pair.state_in, pair.inboard
    rows = sp.Matrix(rows_of(state, space.angle))
    constant_column = state.length - 1
    if space.planar:
        rows[0, constant_column] = -vector("theta_s", 1)[0, 0]
    if modes:
        slopes = section_slopes(space, modes, "I").as_explicit()
        rows[:, constant_column - modes : constant_column] = slopes
        if not space.planar:
            rows[:, constant_column] = -slopes * vector("eta_pI", modes).as_explicit()
    return Matrix(rows)


def _elimination_matrices(pair: Pairing) -> tuple[sp.Basic, Matrix]:
    """E and G, by blocks of the state on the outboard side of the hinge."""
    space, state, modes = pair.space, pair.state_in, pair.outboard
    _, change, moment, angle = _row_symbols(pair)
    outboard_rotation: sp.Basic = angle
    size, n = pair.state_out.length, state.length
    free = sp.zeros(size, modes)
    if modes:
        slopes = section_slopes(space, modes, "O")
        if not space.planar:
            outboard_rotation = outboard_rotation + slopes * vector("eta_pO", modes) * rows_of(
                state, "1"
            )
        free[space.translation_count : space.rigid_count, :] = -slopes.as_explicit()
        free[size - 1 - modes : size - 1, :] = sp.eye(modes)
    blocks: list[sp.Basic] = [
        rows_of(state, "r") + vector("d_s", space.translation_count) * rows_of(state, "1") + change,
        outboard_rotation,
        moment,
        rows_of(state, "q"),
    ]
    if modes:
        blocks.append(sp.ZeroMatrix(modes, n))
    blocks.append(rows_of(state, "1"))
    return sp.BlockMatrix([[block] for block in blocks]), Matrix(free)
