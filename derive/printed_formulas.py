"""Formulas of Jing and Stephansson, chapter 2, against the derived ones: misprints, conventions.

Each entry of `PRINTED_FORMULAS` states a formula as the book prints it (in our symbols), what the
derivation of `newton_euler` gives, and a check that computes which of the two the mechanics
supports.  `as_markdown` renders the list for docs/theory.

Source: L. Jing, O. Stephansson, Fundamentals of Discrete Element Methods for Rock Engineering:
Theory and Applications, Developments in Geotechnical Engineering 85, Elsevier, Amsterdam 2007.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import sympy as sp

from . import newton_euler as ne
from . import printed_transcripts as printed
from .derivation import tilde
from .mass_distribution import POINT, MassDistribution, general
from .newton_euler import A0, OMEGA, OMEGADOT, V0, X0
from .notation import Matrix


@dataclass(frozen=True)
class PrintedFormula:
    """One printed formula and what became of it.

    `status` is "holds", "misprint" (the printed form is wrong) or "convention" (it holds only when
    read in the way `finding` says).  `check` is true when the computation bears the status out.
    """

    number: str
    subject: str
    status: str
    printed: str
    derived: str
    finding: str
    check: Callable[[], bool]


def same(left: sp.Basic, right: sp.Basic) -> bool:
    """Whether two columns or expressions agree identically (as polynomials)."""
    difference = sp.Matrix([left]) - sp.Matrix([right])
    return all(sp.expand(entry) == 0 for entry in difference)


def _field_misprint() -> bool:
    derived = ne.acceleration_field()
    corrected = printed.acceleration_field(OMEGADOT[0])
    return same(derived, corrected) and not same(derived, printed.acceleration_field(OMEGADOT[2]))


def _moments_of_element() -> bool:
    a = Matrix(sp.symbols("a_x a_y a_z"))
    return same(printed.moment(a, POINT), tilde(POINT) * a)


def _density() -> bool:
    """With f the force on dm, rho f grows with the square of the density, rho a only linearly."""
    rho, scale = sp.symbols("rho s", positive=True)
    inertial = rho * A0[0]
    force_on_element = rho * A0[0]
    printed_right = rho * force_on_element
    ratio_left = sp.simplify(inertial.subs(rho, scale * rho) / inertial)
    ratio_right = sp.simplify(printed_right.subs(rho, scale * rho) / printed_right)
    return bool(ratio_left == scale and ratio_right == scale**2)


def _mass_integrals() -> bool:
    """(2.22) holds with I = rho int ... dV, not with the volume integrals of (2.9) alone."""
    rho = sp.Symbol("rho", positive=True)
    body = general()
    entries = (*body.moments, *body.products)
    volume = [sp.Symbol(f"{entry}_V") for entry in entries]
    weighted = dict(zip(entries, (rho * v for v in volume), strict=True))
    derived = ne.euler_form().xreplace(weighted)
    form = printed.euler_general()
    return same(derived, form.xreplace(weighted)) and not same(
        derived, form.xreplace(dict(zip(entries, volume, strict=True)))
    )


def _general_form() -> bool:
    return same(ne.euler_form(), printed.euler_general())


def _tensor_sign() -> bool:
    """The printed (2.10) is no tensor, with negative products it is; (2.12) uses the latter."""
    angle, root = sp.symbols("phi lambda", real=True)
    turn = Matrix(sp.rot_ccw_axis3(angle))
    body = general()
    turned_point = turn * POINT
    square = turned_point.dot(turned_point)
    turned = MassDistribution(
        body.mass,
        turn * body.center,
        tuple(body.integral(Matrix([square - turned_point[i] ** 2]))[0] for i in range(3)),
        tuple(
            body.integral(Matrix([turned_point[i] * turned_point[j]]))[0]
            for i, j in ((0, 1), (0, 2), (1, 2))
        ),
    )

    def is_tensor(of: Callable[[MassDistribution], Matrix]) -> bool:
        return sp.simplify(of(turned) - turn * of(body) * turn.T) == sp.zeros(3, 3)

    characteristic = sp.det(root * sp.eye(3) - body.inertia)
    return (
        is_tensor(lambda b: b.inertia)
        and not is_tensor(printed.inertia_array)
        and same(characteristic, sp.det(printed.characteristic_array(body, root)))
        and not same(
            sp.det(root * sp.eye(3) - printed.inertia_array(body)),
            sp.det(printed.characteristic_array(body, root)),
        )
    )


def _moment_point() -> bool:
    """Moments about the inertial origin differ from those about o by X0 x force."""
    body = general()
    about_o = ne.euler_form(body)
    velocity = ne.rate(Matrix(X0 + POINT))
    about_inertial = ne.rate(body.integral(tilde(Matrix(X0 + POINT)) * velocity))
    shift = tilde(X0) * ne.inertial_force(body)
    return same(about_inertial, about_o + shift) and not same(about_inertial, about_o)


def _principal() -> bool:
    return same(ne.euler_form(ne.principal_axes(general())), printed.euler_principal())


def _special_origin() -> bool:
    body = general()
    central = ne.euler_form(ne.about_mass_center(body))
    fixed = ne.with_unaccelerated_origin(ne.euler_form(body))
    return same(central, printed.euler_reduced()) and same(fixed, printed.euler_reduced())


def _axes_not_in_body() -> bool:
    """Axes turning with W: T = (J omega)' + W x J omega, J' = (omega - W)~ J - J (omega - W)~.

    The printed form misses J (W x omega), which vanishes only for W parallel to omega.
    """
    body = ne.about_mass_center(general())
    turn = Matrix(sp.symbols("W_x W_y W_z", real=True))
    relative = tilde(OMEGA - turn)
    inertia, inertia_rate = body.inertia, relative * body.inertia - body.inertia * relative
    moment = inertia_rate * OMEGA + inertia * OMEGADOT + tilde(turn) * inertia * OMEGA
    missing = inertia * tilde(turn) * OMEGA
    form = printed.euler_reduced()
    agrees = same(moment, form + missing)
    parallel = dict(zip(turn, sp.Symbol("k") * OMEGA, strict=True))
    special = same(moment.subs(parallel), form)
    return agrees and special and not same(moment, form)


def _reduced_principal() -> bool:
    body = ne.principal_axes(ne.about_mass_center(general()))
    fixed = ne.with_unaccelerated_origin(ne.euler_form(ne.principal_axes(general())))
    form = printed.euler_reduced_principal()
    return same(ne.euler_form(body), form) and same(fixed, form)


def _parallel_axes() -> bool:
    """Axes both fixed in the body and parallel to inertial ones leave no angular velocity."""
    relative = ne.rate(POINT)
    return same(relative, tilde(OMEGA) * POINT) and not same(relative, sp.zeros(3, 1))


def _element_acceleration() -> bool:
    """d2X/dt2 = d2X0/dt2 + d2x/dt2; the printed right side has only the last term."""
    t = sp.Symbol("t")
    origin, local = sp.Function("X0")(t), sp.Function("x")(t)
    full = sp.diff(origin + local, t, 2)
    return same(full - local.diff(t, 2), origin.diff(t, 2)) and not same(full, local.diff(t, 2))


def _momentum_rate() -> bool:
    """d(int X x V dm)/dt = int X x A dm, because V x V = 0."""
    body = general()
    position = Matrix(X0 + POINT)
    velocity = ne.rate(position)
    left = ne.rate(body.integral(tilde(position) * velocity))
    return same(left, body.integral(tilde(position) * ne.acceleration_field()))


def _split_moment() -> bool:
    """(2.31) as printed has Z' for z in the second line; with z it is the split moment."""
    split = printed.split_moment(second_line=POINT[2])
    position = Matrix(printed.ORIGIN + POINT)
    whole = printed.moment(Matrix(printed.ORIGIN_DD + printed.LOCAL_DD), position)
    return same(whole, split) and not same(
        whole, printed.split_moment(second_line=printed.ORIGIN[2])
    )


def _first_moments() -> bool:
    body = general()
    left = body.integral(printed.moment(printed.ORIGIN_DD, POINT))
    return same(left, body.mass * printed.moment(printed.ORIGIN_DD, body.center))


def _moment_about_origin() -> bool:
    """T_O = int f x (X0 + r): less X0 x force it is the moment about o, with (2.28) and (2.32a)."""
    f = Matrix(sp.symbols("f_x f_y f_z"))
    position = Matrix(printed.ORIGIN + POINT)
    left = printed.moment(f, position)
    return same(left, printed.moment(f, printed.ORIGIN) + printed.moment(f, POINT))


def _relative_form() -> bool:
    body = general()
    return same(ne.relative_momentum_form(body), ne.euler_form(body))


def _missing_gyroscopic_term() -> bool:
    """In body axes x, y, z are constant: (2.34) gives zero, and dh/dt there misses omega x h."""
    body = general()
    second_rates = ne.component_rate(ne.component_rate(POINT))
    as_printed = body.integral(tilde(POINT) * second_rates)
    momentum = ne.relative_momentum(body)
    in_body = Matrix(body.mass * tilde(body.center) * A0 + ne.component_rate(momentum))
    missing = tilde(OMEGA) * momentum
    return (
        same(as_printed, sp.zeros(3, 1))
        and same(in_body + missing, ne.euler_form(body))
        and not same(in_body, ne.euler_form(body))
    )


def _needs_angular_velocity() -> bool:
    """h holds omega and the second moments of the mass: neither can be left out."""
    body = general()
    momentum = ne.relative_momentum(body)
    return same(momentum, body.inertia * OMEGA) and momentum.free_symbols >= {*OMEGA, *body.moments}


def _reduced_momentum() -> bool:
    body = general()
    momentum = ne.relative_momentum(body)
    fixed = ne.with_unaccelerated_origin(ne.euler_form(body))
    central = ne.about_mass_center(body)
    return same(ne.rate(momentum), fixed) and same(
        ne.rate(ne.relative_momentum(central)), ne.euler_form(central)
    )


def _no_velocity_of_origin() -> bool:
    return not ne.euler_form().has(*V0) and not ne.angular_momentum_form().has(*V0, *X0)


PRINTED_FORMULAS: tuple[PrintedFormula, ...] = (
    PrintedFormula(
        "(2.9)", "moments and products of inertia", "convention",
        "Ixx = int (y^2 + z^2) dV, Ixy = int x y dV",
        "Ixx = int (y^2 + z^2) dm, Ixy = int x y dm",
        "(2.8) keeps the density outside the integrals; (2.22) mixes Ixx with the mass M, so there "
        "the integrals have to be taken over the mass (a factor rho for a uniform body).",
        _mass_integrals,
    ),
    PrintedFormula(
        "(2.10)", "inertia tensor", "misprint",
        "off-diagonal entries +Ixy, +Ixz, +Iyz", "off-diagonal entries -Ixy, -Ixz, -Iyz",
        "With products defined as +int x y dm the printed array does not transform as a tensor; it "
        "also contradicts the characteristic equation (2.12), which has the right signs.",
        _tensor_sign,
    ),
    PrintedFormula(
        "(2.18), also (2.4)", "acceleration field, y component", "misprint",
        "... + z (omega_y omega_z - domega_z)", "... + z (omega_y omega_z - domega_x)",
        "The last rate has the wrong index; the x and z components are right.",
        _field_misprint,
    ),
    PrintedFormula(
        "(2.20)", "moment of the inertial force of dm", "holds",
        "(a_z y - a_y z, a_x z - a_z x, a_y x - a_x y) dm", "(r x a) dm", "", _moments_of_element,
    ),
    PrintedFormula(
        "(2.21), (2.29) to (2.33)", "moment of the forces over the volume", "convention",
        "int rho (f_z y - f_y z) dV", "int (f_z y - f_y z) dV with f dV = force on dV",
        "(2.19) and (2.28) let f be the force on dm; under rho dV it has to be the force per unit "
        "mass, else the two sides scale differently with the density.",
        _density,
    ),
    PrintedFormula(
        "(2.22)", "Euler's equations, arbitrary origin", "holds",
        "M (a0z yc - a0y zc) + Ixx domega_x + (Izz - Iyy) omega_y omega_z + ... = Tx",
        "M r_c x a0 + J domega + omega x J omega = T",
        "All three lines agree term by term, with products of inertia as +int x y dm, a0 the "
        "acceleration of the body-fixed origin in body axes, and T the moment about that origin.",
        _general_form,
    ),
    PrintedFormula(
        "(2.23)", "moment of the applied forces", "convention",
        "Tx = sum (fZ Y - fY Z) in the inertial frame", "T_o = R^T (T_O - X0 x sum f)",
        "The sum is the moment about the inertial origin in inertial axes; (2.22) needs the moment "
        "about the body's origin in body axes. Applied couples have to be added.",
        _moment_point,
    ),
    PrintedFormula(
        "(2.24)", "principal axes at o", "holds", "(2.22) without products of inertia",
        "the same", "", _principal,
    ),
    PrintedFormula(
        "(2.25)", "origin at the mass centre, or fixed", "holds",
        "(2.22) without the terms in M", "the same",
        "A fixed origin must be a point of the body; then a0 = 0. The inertia is the one about o.",
        _special_origin,
    ),
    PrintedFormula(
        "(2.25) (b)", "axes at the mass centre that need not be fixed in the body", "convention",
        "(2.25) unchanged", "one more term J (W x omega), W the angular velocity of the axes",
        "The term vanishes for axes fixed in the body and for axes that do not turn (with the "
        "inertia evaluated afresh at every instant), in general for W parallel to omega; for any "
        "other axes the printed form is wrong.",
        _axes_not_in_body,
    ),
    PrintedFormula(
        "(2.26)", "principal axes, origin central or fixed", "holds",
        "Ix domega_x + (Iz - Iy) omega_y omega_z = Tx and cyclic", "the same", "",
        _reduced_principal,
    ),
    PrintedFormula(
        "(2.27)", "X = X0 + x in parallel frames", "convention",
        "body-embedded axes parallel to the inertial ones",
        "axes that move with o and do not turn (x, y, z of a body point vary)",
        "Axes fixed in a turning body do not stay parallel: dr/dt = omega x r. Everything up to "
        "(2.36) holds for axes that keep their direction.",
        _parallel_axes,
    ),
    PrintedFormula(
        "(2.28), second line", "acceleration of dm", "misprint",
        "d2X/dt2 = d2x/dt2", "d2X/dt2 = d2X0/dt2 + d2x/dt2",
        "The lower-case x drops the acceleration of the origin, which (2.31) then uses.",
        _element_acceleration,
    ),
    PrintedFormula(
        "(2.29), (2.30)", "rate of angular momentum about the inertial origin", "holds",
        "int X x A dm = d/dt int X x V dm", "the same", "", _momentum_rate,
    ),
    PrintedFormula(
        "(2.31)", "split of the moment, second line", "misprint",
        "int (ddx z' - ddz x) dm", "int (ddx z - ddz x) dm",
        "A prime too many on z in the middle integral; the other lines and terms are right.",
        _split_moment,
    ),
    PrintedFormula(
        "(2.32a)", "first moments", "holds",
        "int ddZ0 y dm = M ddZ0 yc and the like", "the same", "",
        _first_moments,
    ),
    PrintedFormula(
        "(2.32b)", "split of the applied moment", "holds",
        "T_X = int [fz (Y0 + y) - fy (Z0 + z)]", "X0 x sum f + moment about o", "",
        _moment_about_origin,
    ),
    PrintedFormula(
        "(2.33), (2.35)", "moment about o by relative angular momentum", "holds",
        "T = M r_c x ddX0 + dh/dt", "the same, dh/dt the inertial rate",
        "Agrees with (2.22) identically once dh/dt is the inertial rate: in body axes the rate of "
        "the components of h plus omega x h.",
        _relative_form,
    ),
    PrintedFormula(
        "(2.34), text after (2.35)", "h evaluated in the body-embedded frame", "convention",
        "dh_x/dt = int (ddz y - ddy z) dm in the body frame", "dh/dt = J domega + omega x J omega",
        "In body axes x, y, z are constants, so the printed integrals vanish; and the rate of the "
        "components of h = J omega in body axes alone lacks omega x h.",
        _missing_gyroscopic_term,
    ),
    PrintedFormula(
        "text after (2.35)", "no inertia or angular velocity needed", "convention",
        "T = M r_c x ddX0 + dh/dt needs neither", "h = J omega",
        "True only if the positions of all mass elements are themselves integrated in axes that do "
        "not turn; for a rigid body h holds the angular velocity and the second moments.",
        _needs_angular_velocity,
    ),
    PrintedFormula(
        "(2.36)", "central or fixed origin", "holds", "T = dh/dt", "the same",
        "With the inertial rate of h, and a fixed origin being a point of the body.",
        _reduced_momentum,
    ),
    PrintedFormula(
        "(2.22) against (2.27) to (2.36)", "both forms", "holds",
        "two derivations of the same moment", "equal identically",
        "Neither contains the position or the velocity of the origin.",
        lambda: _relative_form() and _no_velocity_of_origin(),
    ),
)  # fmt: skip


def as_markdown() -> str:
    """The list as a Markdown table, in the book's order."""
    head = ("equation", "subject", "verdict", "printed", "derived", "remark")
    rows = [
        (f.number, f.subject, f.status, _code(f.printed), _code(f.derived), f.finding)
        for f in PRINTED_FORMULAS
    ]
    lines = [" | ".join(row) for row in (head, ("---",) * len(head), *rows)]
    return "".join(f"| {line} |\n" for line in lines)


def _code(text: str) -> str:
    return f"`{text}`" if any(sign in text for sign in "=+^") else text
