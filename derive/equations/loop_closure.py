"""Closed loops: rows of a cut hinge, and their multipliers in the sweep.

A hinge is cut if another hinge already supports its outboard body B: it is attached to its inboard
body A with the kernels of any hinge, and ends at a massless frame C.  The relative motion of the
frames C and B (at the hinge's end) has six directions; W splits them (`complement`) into the
hinge's own speeds and the constrained rows, which close the loop.

With d from C to B in axes of C, all quantities are invariant under a common motion of A and B, even
while d is not zero:

    gap    [d; 2 sin(angle / 2) n]
    slip   [d'; w_r],  w_r = w_B - w_C
    drift  [d''; w_r'], the derivatives of components in axes of C

Rows carry multipliers x through the sweep (Vereshchagin, Engng. Cybern. 6 (1974) 1343-1349).  With
f = S a + e + K x between any two elements, and the rows summed up so far c = K^T a - L x + l, all
of it the stationary point of  1/2 a^T S a + e^T a + x^T K^T a - 1/2 x^T L x + x^T l,  a column of K
is carried across a hinge like e, and leaves

    y_j = -H^T K_j - C_j,  z_j = D^-1 y_j,  L_ij += y_i . z_j,  l_j -= z_j . (tau - H^T e)

where C is the part of a row in the hinge's own speeds.  On the body where both ends of row r are
outboard, it is closed:

    x_r = (K_r^T a + l_r - sum_p L_rp x_p) / L_rr
    S += K_r K_r^T / L_rr,  e += K_r l_r / L_rr
    K_p -= K_r L_rp / L_rr,  l_p -= l_r L_rp / L_rr,  L_pq -= L_rp L_rq / L_rr
"""

from __future__ import annotations

import sympy as sp

from ..definition.derivation import Derivation, Equation, Quantity, Triangular, axial, tilde
from ..definition.notation import column, part, stack, symbol
from .hinge import DIRECTIONS
from .ldl_elimination import divide_rows
from .riccati_sweep import SHIFT, R

SOURCES = (
    "Vereshchagin, Engng. Cybern. 6 (1974) 1343-1349 (multipliers in the sweep)",
    "Featherstone, Rigid Body Dynamics Algorithms, Springer 2008, ch. 8 (closed loops)",
)

#: Least value of 1 + trace of a rotation, which vanishes for half a turn.
_HALF_TURN = sp.Rational(1, 10**12)

ROTATION = Quantity(symbol("R_C", 3, 3), "", "rotation, axes of C to axes of B")
END = Quantity(symbol("r_e", 3), "m", "end of B at the hinge, from P, axes of B")
LEVER = Quantity(symbol("r_A", 3), "m", "the end of B from P of A, axes of A")
OFFSET = Quantity(symbol("d", 3), "m", "that end from the origin of C, axes of C")
VELOCITY_ERROR = Quantity(
    symbol("slip", 6), "", "rate of d and relative angular velocity, axes of C"
)
RELATIVE = Quantity(symbol("relative", 6), "", "motion of the end of B relative to C")
INBOARD_ROW = Quantity(symbol("J_A", 6), "", "row by the acceleration of A, at its P")
OUTBOARD_ROW = Quantity(symbol("J_B", 6), "", "row by the acceleration of B, at its P")
BIAS = Quantity(symbol("l", 6), "", "known parts of the rows")


def relative_pose() -> Derivation:
    """Position of the end of B, from C and from A."""
    a_c, x_c = symbol("A_C", 3, 3), symbol("x_C", 3)
    a_b, x_b = symbol("A_B", 3, 3), symbol("x_B", 3)
    return Derivation(
        "loops",
        "the two sides of a cut hinge",
        (
            Quantity(a_c, "", "rotation, axes of C to inertial axes"),
            Quantity(x_c, "m", "origin of C, inertial axes"),
            Quantity(a_b, "", "rotation, axes of B to inertial axes"),
            Quantity(x_b, "m", "P of B, inertial axes"),
            END, R, SHIFT,
        ),
        (ROTATION, LEVER, OFFSET),
        (
            Equation("rotation from C to B", ROTATION.symbol, a_b.T * a_c),
            Equation("d", OFFSET.symbol, a_c.T * (x_b - x_c + a_b * END.symbol)),
            Equation("end from P of A", LEVER.symbol, SHIFT.symbol + R.symbol * OFFSET.symbol),
        ),
        sources=SOURCES,
    )  # fmt: skip


def gap() -> Derivation:
    """Position and orientation error between the end of B and C."""
    closed_axes, error, relative = symbol("R_e", 3, 3), symbol("gap", 6), symbol("R_rel", 3, 3)
    trace = relative[0, 0] + relative[1, 1] + relative[2, 2]
    half = sp.sqrt(sp.Max(1 + trace, _HALF_TURN))
    angle_error = sp.ImmutableDenseMatrix([2 * entry / half for entry in axial(relative)])
    return Derivation(
        "loops", "position gap of a cut hinge",
        (
            Quantity(closed_axes, "", "rotation, axes of C to axes of B where the loop is closed"),
            ROTATION,
            OFFSET,
        ),
        (Quantity(error, "m, rad", "position gap, axes of C"),),
        (
            Equation(
                "rotation of the end of B relative to C", relative, ROTATION.symbol.T * closed_axes
            ),
            Equation("gap", error, stack(column(OFFSET.symbol), angle_error)),
        ),
        sources=SOURCES,
    )  # fmt: skip


def slip() -> Derivation:
    """Velocity of the end of B relative to C."""
    v_c, w_c, v_b, w_b = (symbol(name, 3) for name in ("v_C", "w_C", "v_B", "w_B"))
    end = v_b + tilde(column(w_b)) * END.symbol
    linear = ROTATION.symbol.T * end - v_c - tilde(column(w_c)) * OFFSET.symbol
    angular = ROTATION.symbol.T * w_b - w_c
    return Derivation(
        "loops",
        "velocity error of a cut hinge",
        (
            ROTATION, END, OFFSET,
            Quantity(v_c, "m/s", "velocity of C, own axes"),
            Quantity(w_c, "rad/s", "angular velocity of C, own axes"),
            Quantity(v_b, "m/s", "velocity of P of B, own axes"),
            Quantity(w_b, "rad/s", "angular velocity of B, own axes"),
        ),
        (VELOCITY_ERROR,),
        (Equation("slip", VELOCITY_ERROR.symbol, stack(linear, angular)),),
        sources=SOURCES,
    )  # fmt: skip


def drift() -> Derivation:
    """Rate of the slip in the bias motion, in which C has its own speeds."""
    of_c, of_b = (
        Quantity(symbol(f"motion_{name}", 9), "", f"bias motion of {name}: w, wd, rdd, own axes")
        for name in "CB"
    )
    result = Quantity(
        symbol("drift", 6), "", "rate of the velocity error in the bias motion, axes of C"
    )
    w_c, wd_c, rdd_c = (part(of_c.symbol, k) for k in (0, 3, 6))
    w_b, wd_b, rdd_b = (part(of_b.symbol, k) for k in (0, 3, 6))
    end = rdd_b + tilde(wd_b) * END.symbol + tilde(w_b) * (tilde(w_b) * END.symbol)
    carried = rdd_c + tilde(wd_c) * OFFSET.symbol + tilde(w_c) * (tilde(w_c) * OFFSET.symbol)
    linear = ROTATION.symbol.T * end - carried - 2 * (tilde(w_c) * part(VELOCITY_ERROR.symbol, 0))
    angular = ROTATION.symbol.T * wd_b - wd_c - tilde(w_c) * part(VELOCITY_ERROR.symbol, 3)
    return Derivation(
        "loops",
        "drift of a cut hinge",
        (ROTATION, END, OFFSET, VELOCITY_ERROR, of_c, of_b),
        (result,),
        (Equation("drift", result.symbol, stack(linear, angular)),),
        sources=SOURCES,
    )


def required_acceleration() -> Derivation:
    """relative = rate gap: acceleration of the end of B that closes its gap within a step.

    1 / rate converts accelerations to changes of coordinates (M. Arnold, O. Brüls, Multibody
    Syst. Dyn. 18 (2007) 185-202).
    """
    gap = Quantity(symbol("gap", 6), "", "position gap, axes of C")
    rate = Quantity(symbol("rate", 1), "1/s^2", "accelerations by changes of coordinates")
    value = _scale_vector(rate.symbol[0, 0], gap.symbol)
    return Derivation(
        "loops",
        "accelerations that remove a position gap in a step",
        (gap, rate),
        (RELATIVE,),
        (Equation("rate gap", RELATIVE.symbol, value),),
        sources=SOURCES,
    )


def row() -> Derivation:
    """Row of one direction, by the accelerations of A and of B.

    A row is a load of C on B as well, and its reaction on A where B is; so its columns are loads,
    carried to P of either.
    """
    direction = Quantity(symbol("w", 6), "", "the direction: a row of W")
    force, moment = part(direction.symbol, 0), part(direction.symbol, 3)
    outboard = _carried_load(ROTATION.symbol, END.symbol, force, moment)
    inboard = _carried_load(R.symbol, LEVER.symbol, -force, -moment)
    return Derivation(
        "loops",
        "row of a direction of a cut hinge",
        (direction, ROTATION, END, R, LEVER),
        (INBOARD_ROW, OUTBOARD_ROW),
        (
            Equation("J_A", INBOARD_ROW.symbol, sp.ImmutableDenseMatrix(inboard)),
            Equation("J_B", OUTBOARD_ROW.symbol, sp.ImmutableDenseMatrix(outboard)),
        ),
        sources=SOURCES,
    )


def known_parts() -> Derivation:
    """Known parts of all six directions."""
    return Derivation(
        "loops",
        "known parts of the rows of a cut hinge",
        (DIRECTIONS, RELATIVE),
        (BIAS,),
        (Equation("l", BIAS.symbol, DIRECTIONS.symbol * RELATIVE.symbol),),
        sources=SOURCES,
    )


def _carried_load(
    rotation: sp.MatrixSymbol, lever: sp.MatrixSymbol, force: sp.MatrixBase, moment: sp.MatrixBase
) -> list[sp.Expr]:
    """Entries of a load in other axes, about another point."""
    force_entries = [sum(rotation[i, j] * force[j, 0] for j in range(3)) for i in range(3)]
    about = tilde(column(lever)) * sp.ImmutableDenseMatrix(force_entries)
    return [
        *force_entries,
        *(sum(rotation[i, j] * moment[j, 0] for j in range(3)) + about[i, 0] for i in range(3)),
    ]


def row_acceleration() -> Derivation:
    """l + J_A delta_A + J_B delta_B: acceleration along a row in the computed motion."""
    of_a, of_b = (
        Quantity(symbol(f"delta_{name}", 6), "", f"deviation of the acceleration of {name}")
        for name in "AB"
    )
    of_row = Quantity(symbol("l", 1), "", "known part of the row")
    result = Quantity(symbol("c", 1), "", "acceleration along the direction")
    value = of_row.symbol + INBOARD_ROW.symbol.T * of_a.symbol + OUTBOARD_ROW.symbol.T * of_b.symbol
    return Derivation(
        "loops",
        "acceleration along a direction of a cut hinge",
        (INBOARD_ROW, OUTBOARD_ROW, of_row, of_a, of_b),
        (result,),
        (Equation("c", result.symbol, value),),
        sources=SOURCES,
    )


def apply_effort() -> Derivation:
    """e -= J tau: load of an effort on a body."""
    direction = Quantity(symbol("J", 6), "", "load of a unit effort")
    effort = Quantity(symbol("tau", 1), "N, N*m", "effort")
    load = Quantity(symbol("e", 6), "N, N*m", "force part of f = S a + e", accumulate=True)
    value = sp.ImmutableDenseMatrix(
        [-direction.symbol[i, 0] * effort.symbol[0, 0] for i in range(6)]
    )
    return Derivation(
        "loops", "load of an effort", (direction, effort), (load,),
        (Equation("e -= J tau", load.symbol, value),), sources=SOURCES,
    )  # fmt: skip


# --- multipliers through the sweep ----------------------------------------------------------------

COLUMN = Quantity(symbol("K", 6), "", "column of the row, at P of its current body")
KNOWN_PART = Quantity(symbol("l", 1), "", "part of the row independent of multipliers and motion")
PIVOT = Quantity(symbol("L", 1), "", "the row's own entry of L")
INVERSE = Quantity(symbol("inverse", 1), "", "1 / L_rr, zero where no motion affects the row")
COUPLING = Quantity(symbol("L_p", 1), "", "entry of L of the eliminated row and another")
MULTIPLIER = Quantity(symbol("x", 1), "N, N*m", "multiplier")


def _accumulating(name: str, rows: int = 1, meaning: str = "") -> Quantity:
    return Quantity(symbol(name, rows), "", meaning, accumulate=True)


def pivot_inverse() -> Derivation:
    """1 / L_rr of the closing row r.

    A pivot below `floor` counts as rounding: the row has no free motion left, and its
    multiplier is zero.
    """
    floor = Quantity(symbol("floor", 1), "", "largest pivot that is rounding")
    pivot = PIVOT.symbol[0, 0]
    reciprocal = sp.Piecewise((1 / pivot, pivot > floor.symbol[0, 0]), (0, True))
    return Derivation(
        "loops", "pivot of an eliminated row", (PIVOT, floor), (INVERSE,),
        (Equation("1 / L_rr", INVERSE.symbol, sp.ImmutableDenseMatrix([reciprocal])),),
        sources=SOURCES,
    )  # fmt: skip


def eliminate_row() -> Derivation:
    """Close row r on the body where its ends meet."""
    mass = Quantity(symbol("S", 6, 6), "", "S of the body", symmetric=True, accumulate=True)
    load = _accumulating("e", 6, "e of the body")
    k, inverse, scaled = COLUMN.symbol, INVERSE.symbol[0, 0], symbol("K_d", 6)
    return Derivation(
        "loops",
        "a row eliminated where its ends meet",
        (INVERSE, COLUMN, KNOWN_PART),
        (mass, load),
        (
            Equation("K_r / L_rr", scaled, _scale_vector(inverse, k)),
            Equation("S += K_r K_r^T / L_rr", mass.symbol, scaled * k.T, symmetric=True),
            Equation(
                "e += K_r l_r / L_rr", load.symbol, _scale_vector(KNOWN_PART.symbol[0, 0], scaled)
            ),
        ),
        sources=SOURCES,
    )


def _scale_vector(factor: sp.Expr, vector: sp.MatrixSymbol) -> sp.ImmutableDenseMatrix:
    return sp.ImmutableDenseMatrix([factor * vector[i, 0] for i in range(int(vector.rows))])


def update_column() -> Derivation:
    """Column of an open row p after row r is closed."""
    column_p = _accumulating("K_p", 6, "column of row p")
    share = -INVERSE.symbol[0, 0] * COUPLING.symbol[0, 0]
    return Derivation(
        "loops", "column of a remaining row while another is eliminated",
        (INVERSE, COLUMN, COUPLING), (column_p,),
        (Equation("K_p -= K_r L_rp / L_rr", column_p.symbol, _scale_vector(share, COLUMN.symbol)),),
        sources=SOURCES,
    )  # fmt: skip


def _part_of_closed_row(number: Quantity) -> sp.ImmutableDenseMatrix:
    """-L_rp / L_rr times a number: what the elimination of row r adds."""
    value = -INVERSE.symbol[0, 0] * COUPLING.symbol[0, 0] * number.symbol[0, 0]
    return sp.ImmutableDenseMatrix([value])


def update_known_part() -> Derivation:
    """Known part of an open row p after row r is closed."""
    known_p = _accumulating("l_p", 1, "known part of row p")
    return Derivation(
        "loops", "known part of a remaining row while another is eliminated",
        (INVERSE, KNOWN_PART, COUPLING), (known_p,),
        (Equation("l_p -= l_r L_rp / L_rr", known_p.symbol, _part_of_closed_row(KNOWN_PART)),),
        sources=SOURCES,
    )  # fmt: skip


def update_coupling() -> Derivation:
    """Entry of L of two open rows after row r is closed."""
    second = Quantity(symbol("L_q", 1), "", "entry of L of the eliminated row and the second")
    entry = _accumulating("L_pq", 1, "entry of L of both")
    return Derivation(
        "loops", "two remaining rows while another is eliminated", (INVERSE, COUPLING, second),
        (entry,),
        (Equation("L_pq -= L_rp L_rq / L_rr", entry.symbol, _part_of_closed_row(second)),),
        sources=SOURCES,
    )  # fmt: skip


def multiplier() -> Derivation:
    """x_r at the ground, whose deviation is zero, without the rows that were open then."""
    return Derivation(
        "loops", "multiplier of a row", (INVERSE, KNOWN_PART), (MULTIPLIER,),
        (Equation("x_r", MULTIPLIER.symbol, INVERSE.symbol * KNOWN_PART.symbol),), sources=SOURCES,
    )  # fmt: skip


def multiplier_of_motion() -> Derivation:
    """Contribution of the body where the row closes."""
    delta = Quantity(symbol("delta", 6), "", "deviation of the acceleration of the body")
    result = _accumulating("x", 1, "multiplier of row r")
    return Derivation(
        "loops", "contribution of a motion to a multiplier", (INVERSE, COLUMN, delta), (result,),
        (Equation(
            "x_r += K_r^T a / L_rr", result.symbol,
            INVERSE.symbol * (COLUMN.symbol.T * delta.symbol),
        ),),
        sources=SOURCES,
    )  # fmt: skip


def multiplier_of_row() -> Derivation:
    """Contribution of a row p that was open then."""
    multiplier_p = Quantity(symbol("x_p", 1), "N, N*m", "multiplier of row p")
    result = _accumulating("x", 1, "multiplier of row r")
    return Derivation(
        "loops", "contribution of another row to a multiplier", (INVERSE, COUPLING, multiplier_p),
        (result,),
        (Equation("x_r -= L_rp x_p / L_rr", result.symbol, _part_of_closed_row(multiplier_p)),),
        sources=SOURCES,
    )  # fmt: skip


def rotor_row_residual() -> Derivation:
    """l += s - x / J: residual of a rotor's row s = x / J at known s and x."""
    soft = Quantity(symbol("softness", 1), "", "1 / J of the rotor on the row")
    acceleration = Quantity(symbol("s", 1), "", "acceleration of its speed")
    known = _accumulating("l", 1, "known part of the row")
    value = acceleration.symbol[0, 0] - soft.symbol[0, 0] * MULTIPLIER.symbol[0, 0]
    return Derivation(
        "loops", "the row of a rotor with a multiplier", (soft, acceleration, MULTIPLIER), (known,),
        (Equation("l += s - x / J", known.symbol, sp.ImmutableDenseMatrix([value])),),
        sources=SOURCES,
    )  # fmt: skip


def apply_multiplier() -> Derivation:
    """e += K x: load of known multipliers."""
    load = _accumulating("e", 6, "e of the body")
    return Derivation(
        "loops", "load of a multiplier", (COLUMN, MULTIPLIER), (load,),
        (Equation("e += K x", load.symbol, _scale_vector(MULTIPLIER.symbol[0, 0], COLUMN.symbol)),),
        sources=SOURCES,
    )  # fmt: skip


# --- across a hinge -------------------------------------------------------------------------------


def _speed_quantity(name: str, nu: int, meaning: str) -> Quantity:
    return Quantity(symbol(name, nu), "", meaning)


def divide(nu: int) -> Derivation:
    """z = D^-1 y of a column."""
    factor = Quantity(symbol("F", nu, nu), "", "D = L diag(d) L^T: L, and 1 / d on the diagonal")
    y, z = _speed_quantity("y", nu, "-H^T K - C"), _speed_quantity("z", nu, "D^-1 y")
    below = symbol("z_L", nu)
    return Derivation(
        f"generic{nu}",
        f"a column's rows divided by D, across a hinge with {nu} speeds",
        (factor, y),
        (z,),
        (
            Equation("L^-1 y", below, Triangular(factor.symbol, y.symbol)),
            Equation(
                "D^-1 y", z.symbol,
                Triangular(factor.symbol, divide_rows(below, factor.symbol), transposed=True),
            ),
        ),
        sources=SOURCES,
    )  # fmt: skip


def couple(nu: int) -> Derivation:
    """L_ij += y_i . z_j."""
    y, z = _speed_quantity("y", nu, "of one row"), _speed_quantity("z", nu, "of the other")
    entry = _accumulating("L_ij", 1, "entry of L of both")
    return Derivation(
        f"generic{nu}", f"two columns coupled by a hinge with {nu} speeds", (y, z), (entry,),
        (Equation("L_ij += y_i . z_j", entry.symbol, y.symbol.T * z.symbol),), sources=SOURCES,
    )  # fmt: skip


def add_known_part(nu: int) -> Derivation:
    """l_j -= z_j . (tau - H^T e)."""
    y, z = _speed_quantity("y", nu, "tau - H^T e"), _speed_quantity("z", nu, "of the row")
    known = _accumulating("l", 1, "known part of the row")
    return Derivation(
        f"generic{nu}", f"contribution of a hinge with {nu} speeds to a row", (y, z), (known,),
        (Equation("l_j -= z_j . y", known.symbol, -(y.symbol.T * z.symbol)),), sources=SOURCES,
    )  # fmt: skip


def add_multiplier_effort(nu: int) -> Derivation:
    """tau - H^T e with the multiplier of a row: udot = D^-1 (y_0 + sum y_j x_j) - G a."""
    y = _speed_quantity("y", nu, "of the row")
    total = _accumulating("y_0", nu, "tau - H^T e")
    return Derivation(
        f"generic{nu}", f"contribution of a multiplier to a hinge with {nu} speeds",
        (y, MULTIPLIER), (total,),
        (Equation(
            "y_0 += y_j x_j", total.symbol, _scale_vector(MULTIPLIER.symbol[0, 0], y.symbol)
        ),),
        sources=SOURCES,
    )  # fmt: skip


#: Steps that do not depend on the number of hinge speeds.
STEPS = (
    relative_pose, gap, slip, drift, required_acceleration, row, known_parts, row_acceleration,
    apply_effort, pivot_inverse, eliminate_row, update_column, update_known_part, update_coupling,
    multiplier, multiplier_of_motion, multiplier_of_row, rotor_row_residual, apply_multiplier,
)  # fmt: skip
#: Steps for hinges with at least one speed.
OF_SPEEDS = (divide, couple, add_known_part, add_multiplier_effort)
