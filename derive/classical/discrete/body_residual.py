"""Nonlinear premises of rigid and flexible bodies, for pages and for checks.

The balances are written in vectors, as by Newton and Euler; the matrices are derived from the
energy (`equations_of_motion`), so that their agreement is an independent check.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import sympy as sp

from ...definition.derivation import Equation, vector
from ...definition.notation import Matrix, Perp, Tilde
from .mass_moments import ETA, BodyMoments

if TYPE_CHECKING:
    from .body_options import BodyStatement

A, C = sp.MatrixSymbol("A", 1, 1)[0, 0], sp.MatrixSymbol("C", 1, 1)[0, 0]
HALF = sp.Rational(1, 2)
_MASS = sp.MatrixSymbol("m", 1, 1)[0, 0]


def planar_premises(statement: BodyStatement, body: BodyMoments) -> tuple[Equation, ...]:
    """Premises of a planar body; (8.66) to (8.68) for a beam."""
    modes = statement.modes
    r_i, q_i, m_i = vector("r_I", 2), vector("q_I", 2), vector("m_I", 1)
    r_o, q_o, m_o = vector("r_O", 2), vector("q_O", 2), vector("m_O", 1)
    theta = vector("theta_I", 1)
    axes, a, c = sp.MatrixSymbol("R", 2, 2), vector("a", 2), vector("c", 2)
    w, wd = sp.MatrixSymbol("w", 1, 1), sp.MatrixSymbol("wd", 1, 1)
    rate, inertia = w[0, 0], sp.MatrixSymbol("J", 1, 1)
    cosine, sine = sp.cos(theta[0, 0]), sp.sin(theta[0, 0])
    linear = _MASS * a + wd[0, 0] * Perp(c) - rate**2 * c
    angular = Perp(c).T * a + inertia * wd
    if modes:
        eta, etad, etadd = _modal_symbols(modes)
        shift, slope, spin = sp.MatrixSymbol("S_t", 2, modes), *_coupling_symbols(modes)
        linear = linear + shift * etadd + 2 * rate * Perp(shift * etad)
        angular = angular + spin * etadd + rate * (slope * etad)
    end_position = _planar_end(statement)
    premises = [
        *_time_map_equations("r", 2), *_time_map_equations("theta", 1, True),
        *(_time_map_equations("eta", modes) if modes else ()),
        Equation("frame axes", axes, Matrix([[cosine, -sine], [sine, cosine]])),
        Equation("acceleration less gravity, frame axes", a,
                 axes.T * (vector("rdd", 2) - vector("g", 2))),
        *_moment_definitions(body, modes), *_beam_shape_equations(statement),
        Equation(
            "balance of forces", axes * linear, q_i - q_o + vector("f_r", 2),
            _equation_number(statement, 0),
        ),
        Equation(
            "balance of moments, about the input end", angular,
            m_i - m_o - Perp(r_o - r_i).T * q_o + vector("f_m", 1), _equation_number(statement, 1),
        ),
    ]  # fmt: skip
    if modes:
        end_rotations = [sp.MatrixSymbol(f"Theta_{end}", 1, modes) for end in "IO"]
        inertial = (
            shift.T * a + spin.T * wd + sp.MatrixSymbol("M_f", modes, modes) * etadd
            - HALF * rate**2 * slope.T
        )  # fmt: skip
        if statement.kind == "elastic":
            inertial = inertial - 2 * rate * (_skew_matrix("G_f", modes) * etad)
        shapes = sp.MatrixSymbol("Phi_O", 2, modes)
        loads = end_rotations[0].T * m_i - shapes.T * (axes.T * q_o) - end_rotations[1].T * m_o
        premises += [
            Equation("inertia of the modes", vector("i_f", modes), inertial),
            Equation("loads on the modes", vector("l_f", modes), loads + vector("f_eta", modes)),
            _balance_of_modes(statement),
            Equation("one set of modal coordinates", vector("eta_O", modes), eta),
        ]
    premises += [
        Equation("output end", r_o, r_i + axes * end_position, "", "position of the section"),
        Equation("one floating frame", vector("theta_O", 1), theta),
    ]
    return tuple(premises)


def spatial_premises(statement: BodyStatement, body: BodyMoments) -> tuple[Equation, ...]:
    """Premises of a spatial body, to first order in psi; (8.152) to (8.164) for a beam."""
    modes = statement.modes
    r_i, q_i, m_i = (vector(f"{name}_I", 3) for name in "rqm")
    r_o, q_o, m_o = vector("r_O", 3), vector("q_O", 3), vector("m_O", 3)
    psi, predicted = vector("psi_I", 3), sp.MatrixSymbol("R_p", 3, 3)
    frame_rotation = sp.MatrixSymbol("T", 3, 3) * predicted.T * psi
    axes = sp.MatrixSymbol("R", 3, 3)
    a, c, w, wd = (vector(name, 3) for name in ("a", "c", "w", "wd"))
    inertia = sp.MatrixSymbol("J", 3, 3)
    linear = _MASS * a + Tilde(wd) * c + Tilde(w) * (Tilde(w) * c)
    angular = Tilde(c) * a + inertia * wd + Tilde(w) * (inertia * w)
    premises = [
        *_time_map_equations("r", 3), *(_time_map_equations("eta", modes) if modes else ()),
        Equation(
            "frame axes", axes, predicted + Tilde(psi) * predicted, "", "to first order in psi"
        ),
        Equation("angular velocity, frame axes", w, C * frame_rotation + vector("D_w", 3)),
        Equation("angular acceleration", wd, A * frame_rotation + vector("B_w", 3)),
        Equation("acceleration less gravity, frame axes", a,
                 axes.T * (vector("rdd", 3) - vector("g", 3))),
        *_moment_definitions(body, modes), *_shape_moment_equations(statement),
    ]  # fmt: skip
    if modes:
        eta, etad, etadd = _modal_symbols(modes)
        shift, spin = sp.MatrixSymbol("S_t", 3, modes), sp.MatrixSymbol("G", 3, modes)
        slope, rate = sp.MatrixSymbol("J_e", 6, modes), sp.MatrixSymbol("Jd", 3, 3)
        linear = linear + shift * etadd + 2 * (Tilde(w) * (shift * etad))
        angular = angular + spin * etadd + rate * w + Tilde(w) * (spin * etad)
        premises += _moment_rates(body, modes, slope, etad)
    premises += [
        Equation(
            "balance of forces", axes * linear, q_i - q_o + vector("f_r", 3),
            _equation_number(statement, 0),
        ),
        Equation(
            "balance of moments, about the input end", axes * angular,
            m_i - m_o - Tilde(r_o - r_i) * q_o + vector("f_m", 3), _equation_number(statement, 1),
        ),
    ]  # fmt: skip
    end_position: sp.Basic = vector("r_e", 3)
    if modes:
        premises += [
            *_spatial_modes(statement), _balance_of_modes(statement),
            Equation("one set of modal coordinates", vector("eta_O", modes), eta),
        ]  # fmt: skip
        end_position = end_position + sp.MatrixSymbol("Phi_O", 3, modes) * eta
    premises += [
        Equation(
            "output end", r_o, r_i + axes * end_position, "", "position of the section; r_e at rest"
        ),
        Equation("one floating frame", vector("psi_O", 3), psi),
    ]
    return tuple(premises)


def _spatial_modes(statement: BodyStatement) -> tuple[Equation, ...]:
    modes = statement.modes
    axes, a, w, wd = sp.MatrixSymbol("R", 3, 3), *(vector(name, 3) for name in ("a", "w", "wd"))
    eta, _, etadd = _modal_symbols(modes)
    x, y, z = (w[i, 0] for i in range(3))
    squares = vector("w_2", 6)
    products = Matrix([x**2, 2 * x * y, 2 * x * z, y**2, 2 * y * z, z**2])
    spin, spin_rate = sp.MatrixSymbol("G", 3, modes), sp.MatrixSymbol("Gd", 3, modes)
    slope, shift = sp.MatrixSymbol("J_e", 6, modes), sp.MatrixSymbol("S_t", 3, modes)
    mass = sp.MatrixSymbol("M_f", modes, modes)
    inertial = (
        shift.T * a
        + spin.T * wd
        + mass * etadd
        + 2 * (spin_rate.T * w)
        - HALF * (slope.T * squares)
    )
    shapes, outer, inner = (
        sp.MatrixSymbol(name, 3, modes) for name in ("Phi_O", "Theta_O", "Theta_I")
    )
    loads = (
        vector("f_eta", modes) + inner.T * (axes.T * vector("m_I", 3))
        - shapes.T * (axes.T * vector("q_O", 3)) - outer.T * (axes.T * vector("m_O", 3))
        - sp.MatrixSymbol("K_g", modes, modes) * (eta - vector(ETA, modes))
    )  # fmt: skip
    return (
        Equation("products of the angular velocity", squares, products),
        Equation("inertia of the modes", vector("i_f", modes), inertial),
        Equation("loads on the modes", vector("l_f", modes), loads),
    )


# --- pieces -----------------------------------------------------------------------------------

_EQUATION_NUMBERS = {
    ("planar", "beam"): ("(8.66)", "(8.68)", "(8.67), (8.91)"),
    ("spatial", "beam"): ("(8.149)", "(8.154)", "(8.152), (8.153), (8.188)"),
    ("planar", "elastic"): ("(8.35)", "(8.37)", "(8.24), (8.33), (8.34)"),
    ("spatial", "elastic"): ("(8.60)", "(8.62)", "(8.24), (8.57) to (8.59)"),
}


def _equation_number(statement: BodyStatement, position: int) -> str:
    return _EQUATION_NUMBERS.get((statement.space.name, statement.kind), ("", "", ""))[position]


def _modal_symbols(modes: int) -> tuple[sp.MatrixSymbol, sp.MatrixSymbol, sp.MatrixSymbol]:
    return vector("eta_I", modes), vector("etad", modes), vector("etadd", modes)


def _coupling_symbols(modes: int) -> tuple[sp.MatrixSymbol, sp.MatrixSymbol]:
    return sp.MatrixSymbol("J_e", 1, modes), sp.MatrixSymbol("G", 1, modes)


def _balance_of_modes(statement: BodyStatement) -> Equation:
    modes = statement.modes
    eta, etad, _ = _modal_symbols(modes)
    stiffness, damping = (sp.MatrixSymbol(name, modes, modes) for name in ("K_f", "D_f"))
    inertial, loads = vector("i_f", modes), vector("l_f", modes)
    balance = inertial + stiffness * eta + damping * etad
    return Equation("balance of the modes", balance, loads, _equation_number(statement, 2))


def _time_map_equations(name: str, size: int, angle: bool = False) -> tuple[Equation, ...]:
    """Second and first derivative of a coordinate of the input end."""
    coordinate, derivative_name = (
        vector(f"{name}_I", size),
        {"r": "rdd", "theta": "wd", "eta": "etadd"}[name],
    )
    acceleration_map = Equation(
        f"time map of {name}",
        vector(derivative_name, size),
        A * coordinate + vector(f"B_{name}", size),
        "",
        "ydd = A y + B",
    )
    if name == "r":
        return (acceleration_map,)
    speed_map = vector("w" if angle else "etad", size)
    return (
        acceleration_map,
        Equation(
            f"time map of {name}",
            speed_map,
            C * coordinate + vector(f"D_{name}", size),
            "",
            "yd = C y + D",
        ),
    )


def _moment_definitions(body: BodyMoments, modes: int) -> tuple[Equation, ...]:
    """Moments of the deformed body, at the coordinates of the input end."""
    if not modes:
        return body.definitions
    predicted, current = vector(ETA, modes).as_explicit(), vector("eta_I", modes).as_explicit()
    substitution = dict(zip(predicted, current, strict=True))
    return tuple(Equation(e.name, e.left, e.right.xreplace(substitution)) for e in body.definitions)


def _moment_rates(
    body: BodyMoments, modes: int, slope: sp.MatrixSymbol, etad: sp.MatrixSymbol
) -> tuple[Equation, ...]:
    """Rates of J and G."""
    change = vector("j_d", 6)
    xx, xy, xz, yy, yz, zz = change.as_explicit()
    rate = Matrix([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    at_rest = dict.fromkeys(vector(ETA, modes).as_explicit(), sp.Integer(0))
    spin = next(e.right for e in body.definitions if str(e.left.name) == "G")
    variable_part = spin - spin.xreplace(at_rest)
    rates = dict(zip(at_rest, etad.as_explicit(), strict=True))
    return (
        Equation("rate of J", change, slope * etad, "", "xx xy xz yy yz zz"),
        Equation("rate of J", sp.MatrixSymbol("Jd", 3, 3), rate),
        Equation(
            "rate of G", sp.MatrixSymbol("Gd", 3, modes), Matrix(variable_part.xreplace(rates))
        ),
    )


def _beam_shape_equations(statement: BodyStatement) -> tuple[Equation, ...]:
    """Deflections of a planar beam as plane vectors."""
    if statement.kind != "beam":
        return ()
    modes = statement.modes
    s, deflection = vector("s", modes), sp.MatrixSymbol("phi_O", 1, modes)
    at_end = sp.MatrixSymbol("Phi_O", 2, modes)
    return (
        Equation("int rho phi", sp.MatrixSymbol("S_t", 2, modes), _transverse_rows(s.T, modes)),
        Equation("shapes, output end", at_end, _transverse_rows(deflection, modes)),
    )


def _transverse_rows(row: sp.MatrixExpr, modes: int) -> Matrix:
    return Matrix(2, modes, lambda i, k: row[0, k] if i else sp.Integer(0))


def _planar_end(statement: BodyStatement) -> sp.Basic:
    if statement.kind == "beam":
        end_at_rest: sp.Basic = Matrix([sp.MatrixSymbol("L", 1, 1)[0, 0], 0])
    else:
        end_at_rest = vector("r_e", 2)
    if not statement.modes:
        return end_at_rest
    return end_at_rest + sp.MatrixSymbol("Phi_O", 2, statement.modes) * vector(
        "eta_I", statement.modes
    )


def _skew_matrix(name: str, size: int) -> Matrix:
    """Skew matrix given by the part above its diagonal."""
    entries = sp.MatrixSymbol(name, size, size)
    return Matrix(
        size, size,
        lambda i, j: sp.Integer(0) if i == j else entries[i, j] if i < j else -entries[j, i],
    )  # fmt: skip


def _shape_moment_equations(statement: BodyStatement) -> tuple[Equation, ...]:
    """First moments of a beam's shapes, and the modal masses."""
    modes = statement.modes
    if not modes:
        return ()
    masses = Equation("modal masses", sp.MatrixSymbol("M_f", modes, modes), _modal_mass(statement))
    if statement.kind != "beam":
        return (masses,)
    s, directions = vector("s", modes), ["xyz".index(plane) for plane in statement.planes]
    shift = Matrix(3, modes, lambda i, k: s[k, 0] * int(i == directions[k]))
    return (Equation("int rho phi", sp.MatrixSymbol("S_t", 3, modes), shift), masses)


def _modal_mass(statement: BodyStatement) -> sp.Basic:
    modes = statement.modes
    if statement.kind == "beam":
        gram = sp.MatrixSymbol("M_phi", modes, modes)
        return Matrix(
            modes, modes,
            lambda i, j: gram[i, j] * int(statement.planes[i] == statement.planes[j]),
        )  # fmt: skip
    products = sp.MatrixSymbol("F", 3, 3 * modes * (modes + 1) // 2)
    pairs = [(k, j) for k in range(modes) for j in range(k, modes)]

    def entry(i: int, j: int) -> sp.Expr:
        pair_index = pairs.index((min(i, j), max(i, j)))
        return sum(products[r, 3 * pair_index + r] for r in range(3))

    return Matrix(modes, modes, entry)
