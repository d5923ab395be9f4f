"""Checks behind `formulas`: each computes whether a printed formula agrees."""

from __future__ import annotations

from collections.abc import Callable

import sympy as sp

from mstmm.derive.definition.derivation import tilde
from mstmm.derive.definition.notation import Matrix
from mstmm.derive.equations import newton_euler as ne
from mstmm.derive.equations.newton_euler import (
    A0,
    OMEGA,
    OMEGADOT,
    POINT,
    V0,
    X0,
    MassDistribution,
    general,
)
from tests.support.book_formulas import transcripts as printed


def are_identical(left: sp.Basic, right: sp.Basic) -> bool:
    """Whether two columns or expressions agree identically (as polynomials)."""
    difference = sp.Matrix([left]) - sp.Matrix([right])
    return all(sp.expand(entry) == 0 for entry in difference)


def field_misprint() -> bool:
    """(2.18): the last rate of the y component is that of omega_x."""
    derived = ne.acceleration_field()
    corrected = printed.acceleration_field(OMEGADOT[0])
    return are_identical(derived, corrected) and not are_identical(
        derived, printed.acceleration_field(OMEGADOT[2])
    )


def moments_of_element() -> bool:
    """(2.20) is r x a."""
    a = Matrix(sp.symbols("a_x a_y a_z"))
    return are_identical(printed.moment(a, POINT), tilde(POINT) * a)


def density() -> bool:
    """With f the force on dm, rho f grows with the square of the density, rho a only linearly."""
    rho, scale = sp.symbols("rho s", positive=True)
    inertial = rho * A0[0]
    force_on_element = rho * A0[0]
    printed_right = rho * force_on_element
    ratio_left = sp.simplify(inertial.subs(rho, scale * rho) / inertial)
    ratio_right = sp.simplify(printed_right.subs(rho, scale * rho) / printed_right)
    return bool(ratio_left == scale and ratio_right == scale**2)


def mass_integrals() -> bool:
    """(2.22) holds with I = rho int ... dV, not with the volume integrals of (2.9) alone."""
    rho = sp.Symbol("rho", positive=True)
    body = general()
    entries = (*body.moments, *body.products)
    volume = [sp.Symbol(f"{entry}_V") for entry in entries]
    weighted = dict(zip(entries, (rho * v for v in volume), strict=True))
    derived = ne.euler_form().xreplace(weighted)
    form = printed.euler_general()
    return are_identical(derived, form.xreplace(weighted)) and not are_identical(
        derived, form.xreplace(dict(zip(entries, volume, strict=True)))
    )


def general_form() -> bool:
    """(2.22) as printed is the integrated form."""
    return are_identical(ne.euler_form(), printed.euler_general())


def tensor_sign() -> bool:
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
        and are_identical(characteristic, sp.det(printed.characteristic_array(body, root)))
        and not are_identical(
            sp.det(root * sp.eye(3) - printed.inertia_array(body)),
            sp.det(printed.characteristic_array(body, root)),
        )
    )


def moment_point() -> bool:
    """Moments about the inertial origin differ from those about o by X0 x force."""
    body = general()
    about_o = ne.euler_form(body)
    velocity = ne.rate(Matrix(X0 + POINT))
    about_inertial = ne.rate(body.integral(tilde(Matrix(X0 + POINT)) * velocity))
    shift = tilde(X0) * ne.inertial_force(body)
    return are_identical(about_inertial, about_o + shift) and not are_identical(
        about_inertial, about_o
    )


def principal() -> bool:
    """(2.24): no products of inertia."""
    return are_identical(ne.euler_form(ne.principal_axes(general())), printed.euler_principal())


def special_origin() -> bool:
    """(2.25): mass centre at the origin, or an origin without acceleration."""
    body = general()
    central = ne.euler_form(ne.about_mass_center(body))
    fixed = ne.with_unaccelerated_origin(ne.euler_form(body))
    return are_identical(central, printed.euler_reduced()) and are_identical(
        fixed, printed.euler_reduced()
    )


def axes_not_in_body() -> bool:
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
    agrees = are_identical(moment, form + missing)
    parallel = dict(zip(turn, sp.Symbol("k") * OMEGA, strict=True))
    special = are_identical(moment.subs(parallel), form)
    return agrees and special and not are_identical(moment, form)


def reduced_principal() -> bool:
    """(2.26): both at once, for both kinds of origin."""
    body = ne.principal_axes(ne.about_mass_center(general()))
    fixed = ne.with_unaccelerated_origin(ne.euler_form(ne.principal_axes(general())))
    form = printed.euler_reduced_principal()
    return are_identical(ne.euler_form(body), form) and are_identical(fixed, form)


def parallel_axes() -> bool:
    """Axes both fixed in the body and parallel to inertial ones leave no angular velocity."""
    relative = ne.rate(POINT)
    return are_identical(relative, tilde(OMEGA) * POINT) and not are_identical(
        relative, sp.zeros(3, 1)
    )


def element_acceleration() -> bool:
    """d2X/dt2 = d2X0/dt2 + d2x/dt2; the printed right side has only the last term."""
    t = sp.Symbol("t")
    origin, local = sp.Function("X0")(t), sp.Function("x")(t)
    full = sp.diff(origin + local, t, 2)
    return are_identical(full - local.diff(t, 2), origin.diff(t, 2)) and not are_identical(
        full, local.diff(t, 2)
    )


def momentum_rate() -> bool:
    """d(int X x V dm)/dt = int X x A dm, because V x V = 0."""
    body = general()
    position = Matrix(X0 + POINT)
    velocity = ne.rate(position)
    left = ne.rate(body.integral(tilde(position) * velocity))
    return are_identical(left, body.integral(tilde(position) * ne.acceleration_field()))


def split_moment() -> bool:
    """(2.31) as printed has Z' for z in the second line; with z it is the split moment."""
    split = printed.split_moment(second_line=POINT[2])
    position = Matrix(printed.ORIGIN + POINT)
    whole = printed.moment(Matrix(printed.ORIGIN_DD + printed.LOCAL_DD), position)
    return are_identical(whole, split) and not are_identical(
        whole, printed.split_moment(second_line=printed.ORIGIN[2])
    )


def first_moments() -> bool:
    """(2.32a): the origin's acceleration comes out of the integrals."""
    body = general()
    left = body.integral(printed.moment(printed.ORIGIN_DD, POINT))
    return are_identical(left, body.mass * printed.moment(printed.ORIGIN_DD, body.center))


def moment_about_origin() -> bool:
    """T_O = int f x (X0 + r): less X0 x force it is the moment about o, with (2.28) and (2.32a)."""
    f = Matrix(sp.symbols("f_x f_y f_z"))
    position = Matrix(printed.ORIGIN + POINT)
    left = printed.moment(f, position)
    return are_identical(left, printed.moment(f, printed.ORIGIN) + printed.moment(f, POINT))


def relative_form() -> bool:
    """(2.35) with the inertial rate of h is the integrated form."""
    body = general()
    return are_identical(ne.relative_momentum_form(body), ne.euler_form(body))


def missing_gyroscopic_term() -> bool:
    """In body axes x, y, z are constant: (2.34) gives zero, and dh/dt there misses omega x h."""
    body = general()
    second_rates = ne.component_rate(ne.component_rate(POINT))
    as_printed = body.integral(tilde(POINT) * second_rates)
    momentum = ne.relative_momentum(body)
    in_body = Matrix(body.mass * tilde(body.center) * A0 + ne.component_rate(momentum))
    missing = tilde(OMEGA) * momentum
    return (
        are_identical(as_printed, sp.zeros(3, 1))
        and are_identical(in_body + missing, ne.euler_form(body))
        and not are_identical(in_body, ne.euler_form(body))
    )


def needs_angular_velocity() -> bool:
    """h holds omega and the second moments of the mass: neither can be left out."""
    body = general()
    momentum = ne.relative_momentum(body)
    return are_identical(momentum, body.inertia * OMEGA) and momentum.free_symbols >= {
        *OMEGA,
        *body.moments,
    }


def reduced_momentum() -> bool:
    """(2.36) for a central and for a fixed origin."""
    body = general()
    momentum = ne.relative_momentum(body)
    fixed = ne.with_unaccelerated_origin(ne.euler_form(body))
    central = ne.about_mass_center(body)
    return are_identical(ne.rate(momentum), fixed) and are_identical(
        ne.rate(ne.relative_momentum(central)), ne.euler_form(central)
    )


def no_velocity_of_origin() -> bool:
    """Neither form contains the position or the velocity of the origin."""
    return not ne.euler_form().has(*V0) and not ne.angular_momentum_form().has(*V0, *X0)
