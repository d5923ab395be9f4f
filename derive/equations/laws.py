"""Laws on hinge coordinates: springs, dampers, efforts, friction, limits; with energies.

Every law returns the efforts tau, the stored energy V and the power P of the rest (dampers,
friction, given efforts), with P = tau . u + dV/dt, so that energies can be balanced.
"""

from __future__ import annotations

import sympy as sp

from ..definition.derivation import Derivation, Equation, Quantity, vector
from ..definition.notation import column, part, rate_of, rotation_of

LINEAR = ("stiffness", "rest", "damping")
FRICTION = ("coulomb", "static", "stribeck_velocity", "regularisation_velocity")
LIMITS = ("lower", "upper", "limit_stiffness", "limit_damping")


def _scalar(name: str, unit: str = "", meaning: str = "") -> Quantity:
    return Quantity(vector(name, 1), unit, meaning)


TAU, V, POWER = (
    _scalar("tau", "N or N*m", "effort on the coordinate"),
    _scalar("V", "J", "stored energy"),
    _scalar("P", "W", "power of dampers, friction and given efforts"),
)


def coordinate_law(full: bool) -> Derivation:
    """Law of one coordinate with u = qdot; `full` adds friction and limits.

    friction: -(F_c + (F_s - F_c) exp(-(u/v_s)^2)) tanh(u/v_r), Coulomb with Stribeck's decay,
    smooth over the regularisation speed v_r;  limits: one-sided spring-dampers that never pull.
    """
    names = LINEAR + (FRICTION + LIMITS if full else ())
    p = {name: vector("p", len(names))[i, 0] for i, name in enumerate(names)}
    q, u, effort = vector("q", 1)[0, 0], vector("u", 1)[0, 0], vector("effort", 1)[0, 0]
    stretch = q - p["rest"]
    energy = p["stiffness"] * stretch**2 / 2
    lost = effort - p["damping"] * u
    stored = -p["stiffness"] * stretch
    if full:
        lost += _friction(p, u)
        for sign, bound in ((1, p["upper"]), (-1, p["lower"])):
            depth = sign * (q - bound)
            push = p["limit_stiffness"] * depth
            damped = sp.Max(0, push + sign * p["limit_damping"] * u)
            touching = depth > 0
            energy += sp.Piecewise((push * depth / 2, touching), (0, True))
            stored += sp.Piecewise((-sign * push, touching), (0, True))
            lost += sp.Piecewise((-sign * (damped - push), touching), (0, True))
    outputs = ((TAU, stored + lost), (V, energy), (POWER, lost * u))
    return Derivation(
        "coordinate",
        "law of one hinge coordinate" + (" with friction and limits" if full else ""),
        (
            Quantity(vector("p", len(names)), "", ", ".join(names)),
            _scalar("q", "m or rad", "coordinate"),
            _scalar("u", "m/s or rad/s", "speed"),
            _scalar("effort", "N or N*m", "given effort"),
        ),
        tuple(quantity for quantity, _ in outputs),
        tuple(
            Equation(quantity.meaning, quantity.symbol, sp.ImmutableDenseMatrix([value]))
            for quantity, value in outputs
        ),
    )


def _friction(p: dict[str, sp.Expr], u: sp.Expr) -> sp.Expr:
    decay = sp.exp(-((u / p["stribeck_velocity"]) ** 2))
    level = p["coulomb"] + (p["static"] - p["coulomb"]) * decay
    return -level * sp.tanh(u / p["regularisation_velocity"])


# --- rotations by quaternion: a potential of swing and unwrapped twist ------------------------

#: Stiffness about the hinge axes x, y, z, rest twist about the law axis, damping about x, y, z.
ROTATIONAL = ("kx", "ky", "kz", "rest_twist", "cx", "cy", "cz")


def _swing_twist_law(
    quaternion: sp.Matrix, p: sp.MatrixSymbol, first: int, axes: sp.MatrixSymbol, spin: sp.Matrix
) -> tuple[list[Equation], sp.Matrix, sp.Expr, sp.Expr]:
    """(equations, torque in body axes, energy, lost power) of V(swing vector, twist).

    In law axes (z' along the hinge's axis a) the rotation is a twist psi about z' followed by a
    swing s about an axis normal to z'.  With sigma = s + (psi - rest) a in hinge axes,
    V = (kx sigma_x^2 + ky sigma_y^2 + kz sigma_z^2)/2.  The torque is minus the gradient of V along
    the body's infinitesimal rotations, so no energy is made at any angle.  The twist is unwrapped
    to the turn nearest to `twist_ref`.
    """
    kx, ky, kz, rest, cx, cy, cz = (p[first + i, 0] for i in range(7))
    local, sigma, push = vector("law_q", 4), vector("sigma", 3), vector("push", 3)
    frame = sp.Matrix(3, 3, lambda i, j: axes[i, j])
    axial_part = frame.T * sp.Matrix(quaternion[1:])
    w, x, y, z = sp.symbols("w x y z", real=True)
    square = w**2 + x**2 + y**2 + z**2
    inner, outer = w**2 + z**2, x**2 + y**2
    factor, slope, twist = (sp.MatrixSymbol(n, 1, 1) for n in ("F_swing", "dF_swing", "twist"))
    swing = sp.Function("F")
    share = outer / square
    norm = sp.sqrt(inner * square)
    sx, sy = swing(share) * (x * w - y * z) / norm, swing(share) * (y * w + x * z) / norm
    twist_rate = {w: -2 * z / inner, z: 2 * w / inner}
    arrays = {s: local[i, 0] for i, s in enumerate((w, x, y, z))}
    omega = sp.Matrix(sp.symbols("omega_x omega_y omega_z", real=True))
    rates = rate_of(sp.Matrix([w, x, y, z]), omega)
    torque = []
    for direction in omega:
        rate_part = rates.diff(direction)
        change = sp.Integer(0)
        for symbol, rate in zip((w, x, y, z), rate_part, strict=True):
            change += (push[0, 0] * sx.diff(symbol) + push[1, 0] * sy.diff(symbol)) * rate
            change += push[2, 0] * twist_rate.get(symbol, 0) * rate
        torque.append(-_replace_function(change, swing, share, factor, slope).xreplace(arrays))
    swings = [_replace_function(s, swing, share, factor, slope).xreplace(arrays) for s in (sx, sy)]
    damping = sp.Matrix([-c * s for c, s in zip((cx, cy, cz), spin, strict=True)])
    stiffness = sp.ImmutableDenseMatrix(sp.diag(kx, ky, kz))
    equations = [
        Equation(
            "quaternion in law axes", local, sp.ImmutableDenseMatrix([quaternion[0], *axial_part])
        ),
        *_swing_equations(share.xreplace(arrays), (outer / inner).xreplace(arrays), factor, slope),
        Equation("unwrapped twist", twist, _unwrapped_twist(local)),
        Equation(
            "swing and twist, law axes",
            sigma,
            sp.ImmutableDenseMatrix([*swings, twist[0, 0] - rest]),
        ),
        Equation("gradient of V by them", push, axes.T * (stiffness * (axes * sigma))),
    ]
    energy = sum(sigma[i, 0] * push[i, 0] for i in range(3)) / 2
    return equations, frame * sp.Matrix(torque) + damping, energy, damping.dot(spin)


def _replace_function(
    expression: sp.Expr,
    swing: sp.Function,
    share: sp.Expr,
    factor: sp.MatrixSymbol,
    slope: sp.MatrixSymbol,
) -> sp.Expr:
    """Expression with F(share) and its derivative replaced by named values."""
    expression = expression.doit()
    for term in expression.atoms(sp.Subs):
        expression = expression.xreplace({term: slope[0, 0]})
    for term in expression.atoms(sp.Derivative):
        expression = expression.xreplace({term: slope[0, 0]})
    return expression.xreplace({swing(share): factor[0, 0]})


def _swing_equations(
    share: sp.Expr, tangent_squared: sp.Expr, factor: sp.MatrixSymbol, slope: sp.MatrixSymbol
) -> list[Equation]:
    """F(X) = swing angle / sin(half swing angle), X = sin^2, and dF/dX; series near X = 0."""
    x_symbol = sp.Symbol("X", nonnegative=True)
    root = sp.sqrt(share)
    half = sp.atan(sp.sqrt(tangent_squared))
    value = 2 * half / root
    derivative = (1 / sp.sqrt(1 - share) - half / root) / share
    series = sp.Integer(0)
    for k in range(8):
        coefficient = sp.binomial(2 * k, k) / sp.Integer(4) ** k / (2 * k + 1)
        series += 2 * coefficient * x_symbol**k
    near = share < sp.Rational(1, 100)
    value_near = sp.horner(series).xreplace({x_symbol: share})
    slope_near = sp.horner(series.diff(x_symbol)).xreplace({x_symbol: share})
    return [
        Equation(
            "swing angle over its half sine",
            factor,
            sp.ImmutableDenseMatrix([sp.Piecewise((value_near, near), (value, True))]),
        ),
        Equation(
            "its derivative",
            slope,
            sp.ImmutableDenseMatrix([sp.Piecewise((slope_near, near), (derivative, True))]),
        ),
    ]


def _unwrapped_twist(local: sp.MatrixSymbol) -> sp.ImmutableDenseMatrix:
    reference = vector("twist_ref", 1)[0, 0]
    wrapped = 2 * sp.atan2(local[3, 0], local[0, 0])
    turns = sp.floor((reference - wrapped) / (4 * sp.pi) + sp.Rational(1, 2))
    return sp.ImmutableDenseMatrix([wrapped + 4 * sp.pi * turns])


def rotation_law() -> Derivation:
    """Law of a ball hinge: swing-twist potential, damping (outboard axes), given torques."""
    p, q, u = vector("p", 7), vector("q", 4), vector("u", 3)
    axes, effort = sp.MatrixSymbol("B", 3, 3), vector("effort", 3)
    spin, efforts = column(u), column(effort)
    equations, torque, energy, lost = _swing_twist_law(column(q), p, 0, axes, spin)
    outputs = (
        (vector("tau", 3), torque + efforts),
        (V.symbol, sp.Matrix([energy])),
        (POWER.symbol, sp.Matrix([lost + efforts.dot(spin)])),
    )
    equations += [Equation(str(s.name), s, sp.ImmutableDenseMatrix(v)) for s, v in outputs]
    return Derivation(
        "rotation",
        "swing-twist law of a ball hinge",
        (
            Quantity(p, "", ", ".join(ROTATIONAL)),
            Quantity(q, "", "unit quaternion"),
            Quantity(u, "rad/s", "angular velocity, outboard axes"),
            Quantity(axes, "", "rotation, law axes to hinge axes"),
            Quantity(effort, "N*m", "given torques, outboard axes"),
            _scalar("twist_ref", "rad", "twist at the last accepted step"),
        ),
        (
            Quantity(vector("tau", 3), "N*m", "torques, outboard axes"),
            V,
            POWER,
            _scalar("twist", "rad", "unwrapped twist"),
        ),
        tuple(equations),
    )


#: Law parameters of six directions: translations first, then `ROTATIONAL`.
SIX = ("kx", "ky", "kz", "rest_x", "rest_y", "rest_z", "cx", "cy", "cz", *ROTATIONAL)


def six_direction_law() -> Derivation:
    """Law of a free or elastic hinge: V = d^T K d/2 in inboard axes plus swing and twist."""
    p, q, u = vector("p", len(SIX)), vector("q", 7), vector("u", 6)
    axes, given = sp.MatrixSymbol("B", 3, 3), vector("effort", 6)
    spin, quaternion = part(u, 3), part(q, 3, 4)
    equations, torque, energy, lost = _swing_twist_law(quaternion, p, 9, axes, spin)
    rotation, d_rate = sp.MatrixSymbol("R", 3, 3), vector("law_rate", 3)
    rotation_entries = sp.Matrix(3, 3, lambda i, j: rotation[i, j])
    stretch = sp.Matrix([q[i, 0] - p[3 + i, 0] for i in range(3)])
    rate = column(d_rate)
    spring = sp.Matrix([-p[i, 0] * stretch[i] for i in range(3)])
    damper = sp.Matrix([-p[6 + i, 0] * rate[i] for i in range(3)])
    energy += sum(p[i, 0] * stretch[i] ** 2 for i in range(3)) / 2
    force = rotation_entries.T * (spring + damper)
    efforts = column(given)
    tau = sp.Matrix.vstack(force, torque) + efforts
    power = lost + damper.dot(rate) + efforts.dot(column(u))
    equations += [
        Equation("rotation", rotation, sp.ImmutableDenseMatrix(rotation_of(*quaternion))),
        Equation(
            "rate of d in hinge axes",
            d_rate,
            sp.ImmutableDenseMatrix(rotation_entries * part(u, 0)),
        ),
        Equation("efforts", vector("tau", 6), sp.ImmutableDenseMatrix(tau)),
        Equation("stored energy", V.symbol, sp.ImmutableDenseMatrix([energy])),
        Equation("lost power", POWER.symbol, sp.ImmutableDenseMatrix([power])),
    ]
    return Derivation(
        "six",
        "six-direction law of a free or elastic hinge",
        (
            Quantity(p, "", ", ".join(SIX)),
            Quantity(q, "", "position, unit quaternion"),
            Quantity(u, "", "velocity and angular velocity, outboard axes"),
            Quantity(axes, "", "rotation, law axes to hinge axes"),
            Quantity(given, "N, N*m", "given force and torque, outboard axes"),
            _scalar("twist_ref", "rad", "twist at the last accepted step"),
        ),
        (
            Quantity(vector("tau", 6), "N, N*m", "force and torque, outboard axes"),
            V,
            POWER,
            _scalar("twist", "rad", "unwrapped twist"),
        ),
        tuple(equations),
        sources=(
            "Rui, Wang, Zhang, ch. 5, section 5.8 (elastic efforts of the acceleration hinge)",
        ),
    )
