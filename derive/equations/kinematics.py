"""Poses, velocities and end points that loads, springs and results need beyond the sweep."""

from __future__ import annotations

import sympy as sp

from ..definition.derivation import Derivation, Equation, Quantity, tilde, vector
from ..definition.notation import column, part, stack, symbol
from .riccati_sweep import FLOOR, MOTION, SHIFT, E, R, inertia_floor

A_PARENT = Quantity(symbol("A_I", 3, 3), "", "rotation, parent axes to inertial axes")
X_PARENT = Quantity(symbol("x_I", 3), "m", "P of the parent, inertial axes")
A = Quantity(symbol("A", 3, 3), "", "rotation, body axes to inertial axes")
X = Quantity(symbol("x", 3), "m", "P of the body, inertial axes")
V = Quantity(symbol("v", 3), "m/s", "velocity of P, body axes")
W = Quantity(symbol("w", 3), "rad/s", "angular velocity, body axes")
OFFSET = Quantity(symbol("offset", 3), "m", "point of the body from P, body axes")


def pose() -> Derivation:
    """Pose of a body from that of its parent."""
    return Derivation(
        "frames",
        "pose of a body",
        (A_PARENT, X_PARENT, R, SHIFT),
        (A, X),
        (
            Equation("rotation", A.symbol, A_PARENT.symbol * R.symbol),
            Equation("position", X.symbol, X_PARENT.symbol + A_PARENT.symbol * SHIFT.symbol),
        ),
    )


def velocity() -> Derivation:
    """Velocity of P from that of the parent and the relative velocity (body axes)."""
    v_i, w_i, relative = vector("v_I", 3), vector("w_I", 3), vector("v_rel", 3)
    carried = R.symbol.T * (v_i + tilde(column(w_i)) * SHIFT.symbol)
    return Derivation(
        "frames",
        "velocity of a body's input end",
        (
            R,
            SHIFT,
            Quantity(v_i, "m/s", "velocity of the parent's P, parent axes"),
            Quantity(w_i, "rad/s", "angular velocity of the parent, parent axes"),
            Quantity(relative, "m/s", "relative velocity of the hinge, body axes"),
        ),
        (V,),
        (Equation("velocity", V.symbol, carried + relative),),
    )


def point() -> Derivation:
    """Position, velocity and acceleration of a point of a body, inertial axes.

    The swept motion carries gravity as an acceleration of the ground, which is put back here.
    """
    at, rate, second = symbol("x_K", 3), symbol("v_K", 3), symbol("a_K", 3)
    delta = Quantity(symbol("delta", 6), "", "deviation of the body's acceleration")
    gravity = Quantity(symbol("gravity", 3), "m/s2", "inertial axes")
    lever, motion = OFFSET.symbol, MOTION.symbol
    spin, turn = tilde(part(motion, 0)), tilde(part(motion, 3) + part(delta.symbol, 3))
    linear = part(motion, 6) + part(delta.symbol, 0)
    return Derivation(
        "frames",
        "motion of a point of a body",
        (A, X, V, MOTION, delta, OFFSET, gravity),
        (
            Quantity(at, "m", "position, inertial axes"),
            Quantity(rate, "m/s", "velocity, inertial axes"),
            Quantity(second, "m/s2", "acceleration, inertial axes"),
        ),
        (
            Equation("position", at, X.symbol + A.symbol * lever),
            Equation("velocity", rate, A.symbol * (V.symbol + spin * lever)),
            Equation(
                "acceleration",
                second,
                A.symbol * (linear + turn * lever + spin * (spin * lever)) + gravity.symbol,
            ),
        ),
    )


def angular_motion() -> Derivation:
    """Angular velocity and acceleration of a body in inertial axes."""
    rate, second = symbol("w_K", 3), symbol("alpha_K", 3)
    delta = Quantity(symbol("delta", 6), "", "deviation of the body's acceleration")
    motion = MOTION.symbol
    return Derivation(
        "frames",
        "rotation of a body",
        (A, MOTION, delta),
        (
            Quantity(rate, "rad/s", "angular velocity, inertial axes"),
            Quantity(second, "rad/s2", "angular acceleration, inertial axes"),
        ),
        (
            Equation("angular velocity", rate, A.symbol * part(motion, 0)),
            Equation(
                "angular acceleration", second, A.symbol * (part(motion, 3) + part(delta.symbol, 3))
            ),
        ),
    )


def end_frame() -> Derivation:
    """Axes of an end of a body."""
    local_axes, axes = symbol("R_end", 3, 3), symbol("A_end", 3, 3)
    return Derivation(
        "frames",
        "axes of an end",
        (A, Quantity(local_axes, "", "rotation, end axes to body axes")),
        (Quantity(axes, "", "rotation, end axes to inertial axes"),),
        (Equation("axes of the end", axes, A.symbol * local_axes),),
    )


def reaction_wrench() -> Derivation:
    """Load on the F end of a massless element with the load F and M on T."""
    x_f, x_t, force, moment = (symbol(n, 3) for n in ("x_F", "x_T", "F", "M"))
    back, turn = symbol("F_back", 3), symbol("M_back", 3)
    return Derivation(
        "frames",
        "load on the other end of a force element",
        tuple(Quantity(s) for s in (x_f, x_t, force, moment)),
        (Quantity(back, "N", "force on F"), Quantity(turn, "N*m", "moment on F")),
        (
            Equation("force", back, -force),
            Equation("moment", turn, -moment - tilde(part(x_t - x_f, 0)) * force),
        ),
    )


def power() -> Derivation:
    """Power of a force and moment at a point, all in the load's axes."""
    axes, force, moment = symbol("A_F", 3, 3), symbol("F", 3), symbol("M", 3)
    v_k, w_k, total = symbol("v_K", 3), symbol("w_K", 3), symbol("P", 1)
    return Derivation(
        "frames",
        "power of an applied load",
        (
            Quantity(axes, "", "rotation, axes of the load to inertial axes"),
            Quantity(force, "N", "force, axes of the load"),
            Quantity(moment, "N*m", "moment, axes of the load"),
            Quantity(v_k, "m/s", "velocity of the point, inertial axes"),
            Quantity(w_k, "rad/s", "angular velocity, inertial axes"),
        ),
        (Quantity(total, "W", "power"),),
        (Equation("power", total, v_k.T * (axes * force) + w_k.T * (axes * moment)),),
    )


def carried_momentum() -> Derivation:
    """Momentum about P, body axes, carried to the inertial origin."""
    local = Quantity(
        vector("h", 6), "N*s, N*m*s", "momentum, moment of momentum about P, body axes"
    )
    push, turn = symbol("p", 3), symbol("L", 3)
    inertial = symbol("p_0", 3)
    return Derivation(
        "frames",
        "momentum about the inertial origin",
        (A, X, local),
        (
            Quantity(push, "N*s", "momentum, inertial axes", accumulate=True),
            Quantity(turn, "N*m*s", "angular momentum about the inertial origin", accumulate=True),
        ),
        (
            Equation("momentum, inertial axes", inertial, A.symbol * part(local.symbol, 0)),
            Equation("momentum", push, inertial),
            Equation(
                "angular momentum",
                turn,
                A.symbol * part(local.symbol, 3) + tilde(part(X.symbol, 0)) * inertial,
            ),
        ),
    )


def gravity_energy() -> Derivation:
    """Potential of uniform gravity from the mass matrix, zero at the inertial origin."""
    mass_matrix = Quantity(symbol("S", 6, 6), "", "mass matrix at P", symmetric=True)
    gravity = Quantity(symbol("gravity", 3), "m/s2", "inertial axes")
    matrix, energy = mass_matrix.symbol, symbol("V", 1)
    moment = sp.ImmutableDenseMatrix([matrix[1, 5], matrix[2, 3], matrix[0, 4]])
    # The mixed block is -tilde(m c): entries (2,6), (3,4), (1,5) hold m c_x, m c_y, m c_z.
    return Derivation(
        "frames",
        "potential energy of gravity",
        (mass_matrix, A, X, gravity),
        (Quantity(energy, "J", "potential energy"),),
        (
            Equation(
                "V = -g . (m x + A m c)",
                energy,
                -(gravity.symbol.T * (matrix[0, 0] * X.symbol + A.symbol * moment)),
            ),
        ),
    )


def pivot_floor() -> Derivation:
    """Lower limit of a pivot from the mass matrix of the body that it moves."""
    mass_matrix = Quantity(symbol("S", 6, 6), "", "mass matrix at P", symmetric=True)
    return Derivation(
        "frames",
        "least inertia that is not rounding",
        (mass_matrix,),
        (FLOOR,),
        (Equation("share of the mean inertia", FLOOR.symbol, inertia_floor(mass_matrix.symbol)),),
    )


def applied_load() -> Derivation:
    """External force and moment at a point, subtracted from e (f_I = S a + e - applied)."""
    axes = Quantity(symbol("A_F", 3, 3), "", "rotation, axes of the load to inertial axes")
    force = Quantity(symbol("F", 3), "N", "force, axes of the load")
    moment = Quantity(symbol("M", 3), "N*m", "moment, axes of the load")
    load = Quantity(E.symbol, "N, N*m", "contribution to e", accumulate=True)
    local, turning = symbol("F_b", 3), symbol("M_b", 3)
    return Derivation(
        "frames",
        "load applied at a point of a body",
        (A, axes, OFFSET, force, moment),
        (load,),
        (
            Equation("force in body axes", local, A.symbol.T * (axes.symbol * force.symbol)),
            Equation("moment in body axes", turning, A.symbol.T * (axes.symbol * moment.symbol)),
            Equation(
                "e = -[F; offset x F + M]",
                load.symbol,
                stack(-local, -(tilde(column(OFFSET.symbol)) * local + turning)),
            ),
        ),
    )


def momentum() -> Derivation:
    """Momentum of a body and angular momentum about the inertial origin from S and its velocity."""
    mass_matrix = Quantity(symbol("S", 6, 6), "", "mass matrix at P", symmetric=True)
    linear, angular = symbol("L", 3), symbol("K", 3)
    local = symbol("h", 6)
    return Derivation(
        "frames",
        "momentum of a body",
        (mass_matrix, A, X, V, W),
        (
            Quantity(linear, "kg*m/s", "momentum, inertial axes", accumulate=True),
            Quantity(
                angular, "kg*m2/s", "about the inertial origin, inertial axes", accumulate=True
            ),
        ),
        (
            Equation("momentum at P", local, mass_matrix.symbol * stack(V.symbol, W.symbol)),
            Equation("momentum", linear, A.symbol * part(local, 0)),
            Equation(
                "angular momentum",
                angular,
                A.symbol * part(local, 3) + tilde(column(X.symbol)) * (A.symbol * part(local, 0)),
            ),
        ),
    )


def reaction() -> Derivation:
    """f = S delta + e at P, body axes, and its components in inertial axes."""
    s = Quantity(symbol("S", 6, 6), "", "f = S a + e of everything outboard", symmetric=True)
    delta = Quantity(symbol("delta", 6), "", "deviation of the body's acceleration")
    f, force, moment = symbol("f", 6), symbol("force", 3), symbol("moment", 3)
    return Derivation(
        "frames",
        "load of the inboard on the outboard side at P",
        (s, E, delta, A),
        (
            Quantity(f, "N, N*m", "body axes"),
            Quantity(force, "N", "inertial axes"),
            Quantity(moment, "N*m", "inertial axes"),
        ),
        (
            Equation("f = S delta + e", f, s.symbol * delta.symbol + E.symbol),
            Equation("force", force, A.symbol * part(f, 0)),
            Equation("moment", moment, A.symbol * part(f, 3)),
        ),
    )


def moment_about() -> Derivation:
    """Moment of a load about another point of the body, inertial axes."""
    f, moment = Quantity(symbol("f", 6), "N, N*m", "load at P, body axes"), symbol("moment", 3)
    return Derivation(
        "frames",
        "moment about another point",
        (A, OFFSET, f),
        (Quantity(moment, "N*m", "about the point, inertial axes"),),
        (
            Equation(
                "moment - offset x force",
                moment,
                A.symbol * (part(f.symbol, 3) - tilde(column(OFFSET.symbol)) * part(f.symbol, 0)),
            ),
        ),
    )


def transport() -> Derivation:
    """Load at P carried to P of the parent, as summed by inverse dynamics."""
    load = Quantity(symbol("e_I", 6), "N, N*m", "contribution to the parent", accumulate=True)
    push = symbol("push", 3)
    return Derivation(
        "frames",
        "load carried to the parent",
        (R, SHIFT, E),
        (load,),
        (
            Equation("force, parent axes", push, R.symbol * part(E.symbol, 0)),
            Equation(
                "X^T e",
                load.symbol,
                stack(push, R.symbol * part(E.symbol, 3) + tilde(column(SHIFT.symbol)) * push),
            ),
        ),
    )


def rotor_energy() -> Derivation:
    """Kinetic energy of a rotor whose inertia is reflected to one speed."""
    inertia, speed, energy = symbol("J", 1), symbol("u", 1), symbol("T", 1)
    return Derivation(
        "frames",
        "kinetic energy of a reflected rotor",
        (Quantity(inertia, "kg*m2", "reflected inertia"), Quantity(speed, "rad/s", "speed")),
        (Quantity(energy, "J", "kinetic energy"),),
        (Equation("T", energy, sp.Rational(1, 2) * speed.T * inertia * speed),),
    )


def driven_effort() -> Derivation:
    """Effort on one speed beyond a given one: tau_d = load + J udot - tau."""
    load, inertia, rate, stated, effort = (
        symbol(name, 1) for name in ("load", "J", "udot", "tau", "tau_d")
    )
    return Derivation(
        "frames",
        "effort required by a prescribed acceleration",
        (
            Quantity(load, "N, N*m", "effort along the speed of the load at P, H^T f"),
            Quantity(inertia, "kg or kg*m2", "rotor inertia reflected to the speed"),
            Quantity(rate, "", "acceleration"),
            Quantity(stated, "N, N*m", "effort already applied"),
        ),
        (Quantity(effort, "N, N*m", "missing effort"),),
        (Equation("tau_d", effort, load + inertia * rate - stated),),
    )


def speed_power() -> Derivation:
    """Power of an effort along one speed."""
    effort, speed, power = symbol("tau", 1), symbol("u", 1), symbol("P", 1)
    return Derivation(
        "frames",
        "power of an effort",
        (Quantity(effort, "N, N*m", "effort"), Quantity(speed, "m/s, rad/s", "speed")),
        (Quantity(power, "W", "power"),),
        (Equation("P", power, effort * speed),),
    )


def length() -> Derivation:
    """Distance between two points and its rate."""
    x_f, v_f, x_t, v_t = (symbol(n, 3) for n in ("x_F", "v_F", "x_T", "v_T"))
    between, rate, value = symbol("x_rel", 3), symbol("v_rel", 3), symbol("l", 2)
    distance = sp.sqrt(sum(between[i, 0] ** 2 for i in range(3)))
    rate_along = sum(between[i, 0] * rate[i, 0] for i in range(3)) / distance
    return Derivation(
        "frames",
        "distance of two points",
        tuple(Quantity(s) for s in (x_f, v_f, x_t, v_t)),
        (Quantity(value, "m, m/s", "distance and its rate"),),
        (
            Equation("relative position", between, x_t - x_f),
            Equation("relative velocity", rate, v_t - v_f),
            Equation("distance and rate", value, sp.ImmutableDenseMatrix([distance, rate_along])),
        ),
    )


def to_inertial() -> Derivation:
    """Vector of a body in inertial axes."""
    local, out = symbol("b", 3), symbol("b_0", 3)
    return Derivation(
        "frames",
        "vector in inertial axes",
        (A, Quantity(local, "", "body axes")),
        (Quantity(out, "", "inertial axes"),),
        (Equation("vector", out, A.symbol * local),),
    )


def classical_body() -> Derivation:
    """Inputs of the classical matrix of a rigid body, in inertial axes, from swept data."""
    p = Quantity(symbol("p", 10), "", "parameters of the rigid body")
    load = Quantity(symbol("load", 6), "N, N*m", "applied force and moment at P, body axes")
    out = Quantity(symbol("ro_n", 3), "m", "inboard point of the next hinge, body axes")
    numbers = p.symbol
    center = sp.ImmutableDenseMatrix([numbers[i, 0] / numbers[0, 0] for i in (1, 2, 3)])
    entries = [numbers[i, 0] for i in range(4, 10)]
    tensor = sp.ImmutableDenseMatrix(
        [
            [entries[0], entries[1], entries[2]],
            [entries[1], entries[3], entries[4]],
            [entries[2], entries[4], entries[5]],
        ]
    )
    names = (("M", 1, 1), ("r_IO", 3, 1), ("r_IC", 3, 1), ("J_I", 3, 3), ("omega", 3, 1))
    mass, r_io, r_ic, inertia, omega = (symbol(*name) for name in names)
    force, moment = symbol("f_C", 3), symbol("m_C", 3)
    push, turn = part(load.symbol, 0), part(load.symbol, 3)
    return Derivation(
        "frames",
        "inputs of the classical body matrix",
        (A, p, MOTION, load, out),
        (
            Quantity(mass, "kg", "mass"),
            Quantity(r_io, "m", "output end from input end, inertial axes"),
            Quantity(r_ic, "m", "mass centre from input end, inertial axes"),
            Quantity(inertia, "kg*m2", "about the input end, inertial axes", symmetric=True),
            Quantity(omega, "rad/s", "angular velocity, inertial axes"),
            Quantity(force, "N", "force at the mass centre"),
            Quantity(moment, "N*m", "moment"),
        ),
        (
            Equation("mass", mass, sp.ImmutableDenseMatrix([numbers[0, 0]])),
            Equation("output end", r_io, A.symbol * out.symbol),
            Equation("mass centre", r_ic, A.symbol * center),
            Equation("inertia", inertia, A.symbol * tensor * A.symbol.T),
            Equation("angular velocity", omega, A.symbol * part(MOTION.symbol, 0)),
            Equation("force", force, A.symbol * push),
            Equation("moment", moment, A.symbol * (turn - tilde(center) * push)),
        ),
    )


def state_deviation() -> Derivation:
    """Deviation of a body's acceleration from the bias motion, from a classical state."""
    state = Quantity(symbol("z", 13), "", "[rdd; omegadot; m; q; 1] at P, inertial axes")
    delta = Quantity(symbol("delta", 6), "", "deviation of the body's acceleration")
    z, motion = state.symbol, MOTION.symbol
    return Derivation(
        "frames",
        "deviation read from a classical state vector",
        (A, MOTION, state),
        (delta,),
        (
            Equation(
                "deviation",
                delta.symbol,
                stack(
                    A.symbol.T * part(z, 0) - part(motion, 6),
                    A.symbol.T * part(z, 3) - part(motion, 3),
                ),
            ),
        ),
    )
