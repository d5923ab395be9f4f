"""Riccati sweep as matrix equations: add a body, pass a hinge, condense, recover.

Between any two elements force and acceleration satisfy f = S a + e (Riccati form of the transfer
relation, a = [linear; angular], f = [force; moment]).  The backward pass from the tips to the root
gives S and e; the forward pass gives every acceleration.  In the accelerations used here S is the
articulated-body inertia.

The equations are stated in deviations from a *bias motion*, the motion with prescribed hinge
accelerations s (zero for free coordinates): delta a = a - a_bias.  Then velocity terms appear once,
in the bias motion, and e starts from the inertia force of the bias motion.

Frames: a body's axes are the outboard axes of its inboard hinge (origin at its input end P).  The
inboard point Q of a hinge is given in its parent by Rt (Q axes to parent axes) and ro.
"""

from __future__ import annotations

import sympy as sp

from ..definition.derivation import Derivation, Equation, Quantity, Solve, tilde
from ..definition.notation import column, diagonal, part, stack, symbol
from .hinge import HingeMotion

#: Least ratio of a pivot to the mean inertia of the body that it moves.
PIVOT_FLOOR = sp.Rational(1, 10**14)

SOURCES = (
    "Rui, Bestle, Wang, Zhang, Rui, He, Multibody Syst. Dyn. 49 (2020) 337-354 (Riccati form)",
    "Rui, Wang, Zhang, ch. 5, (5.20)-(5.27) (elements)",
)


def free_speeds(nu: int) -> str:
    """Text such as "2 free speeds" for titles."""
    return f"{nu or 'no'} free speed{'' if nu == 1 else 's'}"


# --- quantities shared by the steps -----------------------------------------------------------

RT = Quantity(symbol("Rt", 3, 3), "", "rotation, inboard hinge axes to parent axes")
RO = Quantity(symbol("ro", 3), "m", "inboard point Q in the parent, parent axes")
PARENT_MOTION = Quantity(
    symbol("motion_I", 9), "", "bias motion of the parent: w, wd, rdd of its P, parent axes"
)
MOTION = Quantity(symbol("motion", 9), "", "bias motion of the body: w, wd, rdd of its P, own axes")
R = Quantity(symbol("Rc", 3, 3), "", "rotation, body axes to parent axes")
SHIFT = Quantity(symbol("r", 3), "m", "P of the body from P of the parent, parent axes")
S = Quantity(symbol("S", 6, 6), "", "f = S a + e of everything outboard, at P", symmetric=True)
E = Quantity(symbol("e", 6), "N, N*m", "force part of f = S a + e, at P")
PARENT_S = Quantity(
    symbol("S_I", 6, 6), "", "contribution to the parent's S", symmetric=True, accumulate=True
)
PARENT_E = Quantity(symbol("e_I", 6), "N, N*m", "contribution to the parent's e", accumulate=True)
PARENT_DELTA = Quantity(symbol("delta_I", 6), "", "deviation of the parent's acceleration")
DELTA = Quantity(symbol("delta", 6), "", "deviation of the body's acceleration, at P")


FLOOR = Quantity(
    symbol("floor", 2), "kg, kg*m2", "least inertia along and about an axis that is not rounding"
)


def gains(nu: int) -> tuple[Quantity, Quantity]:
    """G and g of a hinge: udot = g - G a_Q."""
    return (
        Quantity(symbol("G", nu, 6), "", "udot = g - G a_Q"),
        Quantity(symbol("g", nu), "", "udot = g - G a_Q"),
    )


def _bias_equations(
    rotation: sp.Basic,
    position: sp.Basic,
    v: sp.Basic,
    w: sp.Basic,
    c: sp.Basic,
    imposed: sp.Basic | None,
) -> tuple[Equation, ...]:
    """Bias motion of the outboard body from that of its parent."""
    w_i, wd_i, a_i = (part(PARENT_MOTION.symbol, k) for k in (0, 3, 6))
    carrier = symbol("K", 3, 3)
    spin_q = symbol("w_Q", 3)
    local = symbol("c_s", 6)
    lever = RO.symbol if _is_zero(position) else RO.symbol + RT.symbol * position
    acceleration = imposed if imposed is not None and _is_zero(c) else c
    if acceleration is c and imposed is not None:
        acceleration = c + imposed
    equations = [
        Equation("rotation to the parent", R.symbol, RT.symbol * rotation),
        Equation("lever in the parent", SHIFT.symbol, lever),
        Equation("carrier's K = wd~ + w~ w~", carrier, tilde(wd_i) + tilde(w_i) * tilde(w_i)),
        Equation("carrier's angular velocity in body axes", spin_q, R.symbol.T * w_i),
        Equation("hinge's own acceleration", local, acceleration),
    ]
    angular = R.symbol.T * wd_i + part(local, 3)
    if not _is_zero(w):
        angular = angular + tilde(part(spin_q, 0)) * w
    linear = R.symbol.T * (a_i + carrier * SHIFT.symbol) + part(local, 0)
    if not _is_zero(v):
        linear = linear + 2 * tilde(part(spin_q, 0)) * v
    motion = stack(spin_q + w, angular, linear)
    equations.append(Equation("bias motion", MOTION.symbol, motion))
    return tuple(equations)


def _is_zero(value: sp.Basic) -> bool:
    """Whether all entries of an explicit matrix are zero."""
    return isinstance(value, sp.MatrixBase) and value.is_zero_matrix is True


def forward(motion: HingeMotion, inputs: tuple[Quantity, ...]) -> Derivation:
    """Hinge kinematics and bias motion in one kernel; s are the prescribed accelerations."""
    nu = motion.nu
    s = Quantity(symbol("s", nu), "", "prescribed part of udot (zero where free)")
    h = motion.in_arrays(motion.subspace)
    rates = symbol("qdot", motion.rates.rows)
    equations = _bias_equations(
        motion.in_arrays(motion.rotation),
        motion.in_arrays(motion.position),
        motion.in_arrays(motion.velocity),
        motion.in_arrays(motion.spin),
        motion.in_arrays(motion.bias),
        h * s.symbol if nu else None,
    )
    return Derivation(
        motion.hinge.name,
        f"bias motion outboard of the {motion.hinge.title}",
        (RT, RO, *inputs, s, PARENT_MOTION),
        (R, SHIFT, MOTION, Quantity(rates, "", "coordinate rates")),
        (*equations, Equation("coordinate rates", rates, motion.in_arrays(motion.rates))),
        sources=SOURCES,
    )


def forward_generic(nu: int) -> Derivation:
    """Bias motion from the outputs of any hinge kernel (R, d, H, v, w, c)."""
    rotation, d, h = symbol("R", 3, 3), symbol("d", 3), symbol("H", 6, nu)
    v, w, c, s = symbol("v", 3), symbol("w", 3), symbol("c", 6), symbol("s", nu)
    equations = _bias_equations(rotation, d, column(v), column(w), c, h * s if nu else None)
    hinge = tuple(Quantity(x) for x in (rotation, d, h, v, w, c, s))
    return Derivation(
        f"generic{nu}",
        f"bias motion outboard of a hinge with {nu} speeds",
        (RT, RO, *hinge, PARENT_MOTION),
        (R, SHIFT, MOTION),
        equations,
        sources=SOURCES,
    )


def transport(force: sp.MatrixSymbol) -> sp.BlockMatrix:
    """X^T f: load at P carried to P of the parent, parent axes."""
    push = R.symbol * part(force, 0)
    return stack(push, R.symbol * part(force, 3) + tilde(column(SHIFT.symbol)) * push)


def congruence(name: str) -> tuple[tuple[Equation, ...], sp.BlockMatrix]:
    """X^T S X by blocks: rotate to parent axes, then shift to the parent's P."""
    reduced = symbol(name, 6, 6)
    a, b, c = (
        sp.ImmutableDenseMatrix(3, 3, lambda i, j, k=k, m=m: reduced[i + k, j + m])
        for k, m in ((0, 0), (0, 3), (3, 3))
    )
    turned_a, turned_b, turned_c = symbol("A", 3, 3), symbol("B", 3, 3), symbol("C", 3, 3)
    lever = tilde(column(SHIFT.symbol))
    moved_b = symbol("B_I", 3, 3)
    equations = (
        Equation(
            "force-acceleration block, parent axes",
            turned_a,
            R.symbol * a * R.symbol.T,
            symmetric=True,
        ),
        Equation("mixed block, parent axes", turned_b, R.symbol * b * R.symbol.T),
        Equation(
            "moment-rotation block, parent axes",
            turned_c,
            R.symbol * c * R.symbol.T,
            symmetric=True,
        ),
        Equation("mixed block at the parent's P", moved_b, turned_b - turned_a * lever),
    )
    corner = turned_c + lever * moved_b - turned_b.T * lever
    return equations, sp.BlockMatrix([[turned_a, moved_b], [moved_b.T, corner]])


def outboard_deviation() -> sp.BlockMatrix:
    """X delta_I: deviation of the body for udot = 0, own axes."""
    a, alpha = part(PARENT_DELTA.symbol, 0), part(PARENT_DELTA.symbol, 3)
    linear = R.symbol.T * (a - tilde(column(SHIFT.symbol)) * alpha)
    return stack(linear, R.symbol.T * alpha)


def unit_directions(subspace: sp.MatrixBase) -> dict[int, int]:
    """{row: column} for every column of H that is a unit vector."""
    columns = {}
    for j in range(subspace.cols):
        direction = list(subspace[:, j])
        if direction.count(0) == 5 and direction.count(1) == 1:
            columns[direction.index(1)] = j
    return columns


def condense(
    nu: int,
    subspace: sp.MatrixBase | None = None,
    inputs: tuple[Quantity, ...] = (),
    name: str | None = None,
) -> Derivation:
    """S and e carried across a hinge to the parent, and the gains G, g of the forward pass.

    D = H^T S H + J,  G = D^-1 H^T S,  g = D^-1 (tau - H^T e)
    S_Q = S - S H G,  e_Q = e + S H g   (then transported by X)

    With an explicit `subspace` (no rotor inertia J) rows of S_Q along unit directions of H vanish
    identically and are not computed, and the same rows of e_Q are the efforts tau.
    """
    tau = Quantity(symbol("tau", nu), "N, N*m", "efforts on the free coordinates")
    h = Quantity(symbol("H", 6, nu), "", "motion subspace of the free coordinates")
    rotor = Quantity(symbol("J", nu), "kg*m2 or kg", "rotor inertia reflected to the speeds")
    reduced, load = symbol("S_Q", 6, 6), symbol("e_Q", 6)
    if not nu:
        equations = [Equation("S_Q = S", reduced, S.symbol), Equation("e_Q = e", load, E.symbol)]
    elif subspace is None:
        equations = _elimination(tau, h.symbol, {}, rotor.symbol)
    else:
        explicit = sp.ImmutableDenseMatrix(subspace)
        equations = _elimination(tau, explicit, unit_directions(subspace), None)
    steps, transported = congruence("S_Q")
    return Derivation(
        name or f"generic{nu}",
        f"S and e carried across a hinge with {free_speeds(nu)}",
        (R, SHIFT, *((h, rotor) if subspace is None else inputs), FLOOR, S, E, tau),
        (*gains(nu), PARENT_S, PARENT_E),
        (
            *equations,
            *steps,
            Equation("X^T S_Q X", PARENT_S.symbol, transported),
            Equation("X^T e_Q", PARENT_E.symbol, transport(load)),
        ),
        sources=SOURCES,
    )


def _elimination(
    tau: Quantity, h: sp.Basic, units: dict[int, int], rotor: sp.MatrixSymbol | None
) -> list[Equation]:
    """G, g, S_Q and e_Q; `units` are the unit directions {row: column} of an explicit H."""
    nu = tau.symbol.rows
    gain, offset = (one.symbol for one in gains(nu))
    push, pivot = symbol("U", 6, nu), symbol("D", nu, nu)
    inertia = h.T * push
    if rotor is not None:
        inertia = inertia + sp.ImmutableDenseMatrix(sp.diag(*column(rotor)))
    right_side = tau.symbol - h.T * E.symbol
    reduced, load, full_load = symbol("S_Q", 6, 6), symbol("e_Q", 6), symbol("e_full", 6)
    zeros = tuple((i, j) for i in range(6) for j in range(6) if i in units or j in units)
    return [
        Equation("U = S H", push, S.symbol * h),
        Equation("D = H^T U + J", pivot, inertia),
        Equation("G = D^-1 U^T", gain, Solve(pivot, push.T, symmetric=True)),
        Equation("g = D^-1 (tau - H^T e)", offset, Solve(pivot, right_side, symmetric=True)),
        Equation("S_Q = S - U G", reduced, S.symbol - push * gain, zeros=zeros, symmetric=True),
        Equation("e_Q = e + U g", full_load, E.symbol + push * offset),
        Equation("e_Q", load, replace_rows(full_load, tau.symbol, units)),
    ]


def replace_rows(
    full: sp.MatrixSymbol, tau: sp.MatrixSymbol, units: dict[int, int]
) -> sp.ImmutableDenseMatrix:
    """Load with the efforts tau in the rows along unit directions."""
    return sp.ImmutableDenseMatrix(
        [tau[units[i], 0] if i in units else full[i, 0] for i in range(6)]
    )


def pivot_guards(
    nu: int,
    subspace: sp.MatrixBase | None = None,
    floor: sp.Basic = FLOOR.symbol,
    pivots: sp.MatrixBase | None = None,
    whole: sp.Basic = S.symbol,
) -> tuple[tuple[sp.Basic, int, str], ...]:
    """Guards of the diagonal of D relative to the body's own inertia.

    The composite inertia is no suitable scale: across the plane of a long planar chain it grows
    with the cube of its length, while the in-plane pivots stay constant.  It is used only for a
    body without own inertia (`whole`, by its diagonal).  `pivots` is the diagonal of D where D
    itself is no quantity.
    """
    pivots = diagonal(symbol("D", nu, nu)) if pivots is None else pivots
    h = symbol("H", 6, nu) if subspace is None else sp.ImmutableDenseMatrix(subspace)
    guards = []
    for i in range(nu):
        translation = sum(h[k, i] ** 2 for k in range(3))
        about = sum(h[k, i] ** 2 for k in range(3, 6))
        least = translation * _own_or_composite(floor[0, 0], whole, 0)
        least += about * _own_or_composite(floor[1, 0], whole, 3)
        text = f"speed {i + 1} of {nu} moves no inertia: its acceleration is undetermined"
        guards.append((pivots[i, 0] > least, 1, text))
    return tuple(guards)


def _own_or_composite(body_floor: sp.Expr, composite: sp.Basic, first: int) -> sp.Expr:
    """Limit from the body's own inertia, or from the composite inertia if that is zero."""
    return sp.Piecewise((body_floor, body_floor > 0), (inertia_floor(composite)[first // 3], True))


def inertia_floor(mass: sp.Basic) -> sp.ImmutableDenseMatrix:
    """Share of the mean mass and mean moment of inertia of a mass matrix (6 x 6)."""
    return sp.ImmutableDenseMatrix(
        [PIVOT_FLOOR * sum(mass[first + k, first + k] for k in range(3)) / 3 for first in (0, 3)]
    )


def back_substitute(
    nu: int,
    subspace: sp.MatrixBase | None = None,
    inputs: tuple[Quantity, ...] = (),
    name: str | None = None,
) -> Derivation:
    """udot = g - G X delta_I and the deviation X delta_I + H udot of the body."""
    gain, offset = gains(nu)
    h_given = Quantity(symbol("H", 6, nu), "", "motion subspace of the free coordinates")
    h = sp.ImmutableDenseMatrix(subspace) if subspace is not None else h_given.symbol
    rates = Quantity(symbol("udot", nu), "", "accelerations of the free coordinates")
    carried = symbol("delta_Q", 6)
    equations = [Equation("X delta_I", carried, outboard_deviation())]
    if nu:
        equations += [
            Equation("udot = g - G X delta_I", rates.symbol, offset.symbol - gain.symbol * carried),
            Equation("deviation of the body", DELTA.symbol, carried + h * rates.symbol),
        ]
    else:
        equations.append(Equation("deviation of the body", DELTA.symbol, carried))
    extra_inputs = inputs if subspace is not None else (h_given,)
    return Derivation(
        name or f"generic{nu}",
        f"accelerations recovered across a hinge with {free_speeds(nu)}",
        (R, SHIFT, *extra_inputs, gain, offset, PARENT_DELTA),
        (rates, DELTA),
        tuple(equations),
        sources=SOURCES,
    )


def effort(nu: int) -> Derivation:
    """tau = H^T f: efforts of the load f at P on a hinge's coordinates."""
    h = Quantity(symbol("H", 6, nu), "", "motion subspace")
    force = Quantity(symbol("f", 6), "N, N*m", "load of the inboard on the outboard side at P")
    tau = Quantity(symbol("tau", nu), "N, N*m", "efforts along the speeds")
    return Derivation(
        f"generic{nu}",
        f"efforts of a hinge with {nu} speeds",
        (h, force),
        (tau,),
        (Equation("tau = H^T f", tau.symbol, h.symbol.T * force.symbol),),
    )


def required_load(nu: int) -> Derivation:
    """e = S H udot: load at P that the accelerations of a hinge require."""
    h = Quantity(symbol("H", 6, nu), "", "motion subspace")
    rates = Quantity(symbol("udot", nu), "", "accelerations of the coordinates")
    inertia = Quantity(S.symbol, "", "inertia of everything outboard, at P", symmetric=True)
    return Derivation(
        f"generic{nu}",
        f"load of the bodies accelerated by a hinge with {nu} speeds",
        (inertia, h, rates),
        (E,),
        (Equation("e = S H udot", E.symbol, S.symbol * (h.symbol * rates.symbol)),),
    )


def project(nu: int) -> Derivation:
    """udot = (H^T H)^-1 H^T (delta - X delta_I): hinge accelerations from known motions."""
    h = Quantity(symbol("H", 6, nu), "", "motion subspace")
    rates = Quantity(symbol("udot", nu), "", "accelerations of the coordinates")
    carried, gap, gram = symbol("delta_Q", 6), symbol("gap", 6), symbol("HH", nu, nu)
    return Derivation(
        f"generic{nu}",
        f"accelerations of a hinge with {nu} speeds from those of its bodies",
        (R, SHIFT, h, DELTA, PARENT_DELTA),
        (rates,),
        (
            Equation("X delta_I", carried, outboard_deviation()),
            Equation("relative deviation", gap, DELTA.symbol - carried),
            Equation("H^T H", gram, h.symbol.T * h.symbol),
            Equation("udot", rates.symbol, Solve(gram, h.symbol.T * gap, symmetric=True)),
        ),
    )
