"""Kernels of bodies and force elements: mass matrix, inertia force, energy, wrench."""

from __future__ import annotations

import sympy as sp

from mstmm.errors import ElementError

from ..definition.derivation import Derivation, Equation, Quantity, tilde, vector
from ..definition.element import Body, ForceElement, Symbols, describe_array
from ..definition.nonsmooth_functions import slope
from ..definition.notation import rotating_derivative
from .riccati_sweep import MOTION, E, S

# --- bodies ---------------------------------------------------------------------------------------
# The residual (force and moment at the input end that a motion requires) is linear in the
# accelerations; its derivative is the mass matrix, its value at the bias motion the load f_bias.
#
# A body defines its equations in its own axes and about its own origin, whichever end is its input
# end: the motion of the internal frame (point P, hinge axes) is transformed to the body's own
# frame and the load back.  R_u (internal to own axes) and r_u (P from the own origin, own axes)
# are twelve numbers after the parameters:
#
#     a_O = X a_P + [w x (w x -r_u); 0],   X = [R_u  r_u~ R_u; 0  R_u],   f_P = X^T f_O

#: Count of numbers in R_u and r_u.
FRAME = 12


def _columns(body: Body) -> tuple[Symbols, sp.MatrixSymbol, Quantity]:
    p = Symbols("p", tuple(x.name for x in body.parameters))
    array = vector("p", len(p) + (0 if body.uses_hinge_axes else FRAME))
    meaning = describe_array("parameters", body.parameters)
    meaning += "; body axes, about its input end" if body.uses_hinge_axes else "; then R_u and r_u"
    return p, array, Quantity(array, "", meaning)


def _frame(body: Body, array: sp.MatrixSymbol) -> tuple[sp.Matrix, sp.Matrix, sp.BlockMatrix]:
    """(R_u, r_u~, X): transformation from the internal frame to the body's own."""
    first = len(body.parameters)
    turn = sp.ImmutableDenseMatrix(3, 3, lambda i, j: array[first + 3 * i + j, 0])
    lever = tilde(_triple(array, first + 9))
    x = sp.BlockMatrix([[turn, lever * turn], [sp.zeros(3, 3), turn]])
    return turn, lever, x


def _substitute_parameters(
    matrix: sp.Matrix, p: Symbols, array: sp.MatrixSymbol
) -> sp.ImmutableDenseMatrix:
    replace = {s: array[i, 0] for i, s in enumerate(p)}
    return sp.ImmutableDenseMatrix(sp.Matrix(matrix).xreplace(replace))


def _triple(array: sp.MatrixSymbol, first: int) -> sp.Matrix:
    return sp.Matrix([array[first + i, 0] for i in range(3)])


def _accelerations() -> tuple[sp.Matrix, sp.Matrix, sp.Matrix]:
    return (
        sp.Matrix(sp.symbols("a_x a_y a_z", real=True)),
        sp.Matrix(sp.symbols("alpha_x alpha_y alpha_z", real=True)),
        sp.Matrix(sp.symbols("w_x w_y w_z", real=True)),
    )


def inertia(body: Body) -> Derivation:
    """S of the single body: derivative of its residual by the acceleration."""
    p, array, parameters = _columns(body)
    a, alpha, w = _accelerations()
    residual = sp.Matrix(body.residual(a, alpha, w, p))
    accelerations = sp.Matrix.vstack(a, alpha)
    mass = residual.jacobian(accelerations).applyfunc(sp.expand)
    if mass.atoms(sp.Symbol) & set(accelerations):
        raise ElementError(f"body {body.name}: the residual is not linear in a and alpha")
    if sp.simplify(mass - mass.T) != sp.zeros(6, 6):
        raise ElementError(
            f"body {body.name}: the mass matrix d residual / d [a; alpha] is not symmetric"
        )
    if mass.atoms(sp.Symbol) & set(w):
        raise ElementError(f"body {body.name}: the mass matrix depends on the angular velocity")
    return Derivation(
        body.name,
        f"mass matrix of the {body.title}",
        (parameters,),
        (S,),
        _mass_equations(body, array, _substitute_parameters(mass, p, array)),
        sources=body.sources,
    )


def bias_load(body: Body) -> Derivation:
    """Derive the load e of f = S a + e of a user-defined body: its residual at the bias motion."""
    p, array, parameters = _columns(body)
    carried = () if body.uses_hinge_axes else _motion_equations(body, array)
    motion = carried[-1].left if carried else MOTION.symbol
    residual = body.residual(_triple(motion, 6), _triple(motion, 3), _triple(motion, 0), p)
    return Derivation(
        body.name,
        f"load required by the bias motion of the {body.title}",
        (parameters, MOTION),
        (E,),
        (*carried, *_load_equations(body, array, _substitute_parameters(residual, p, array))),
        sources=body.sources,
    )


def kinetic_energy(body: Body) -> Derivation:
    """T from the velocity of P and the angular velocity, body axes."""
    p, array, parameters = _columns(body)
    v, w = vector("v", 3), vector("w", 3)
    energy = sp.MatrixSymbol("T", 1, 1)
    carried = () if body.uses_hinge_axes else _velocity_equations(body, array, v, w)
    v_own, w_own = (carried[1].left, carried[0].left) if carried else (v, w)
    value = sp.Matrix([[body.kinetic_energy(_triple(v_own, 0), _triple(w_own, 0), p)]])
    return Derivation(
        body.name,
        f"kinetic energy of the {body.title}",
        (parameters, Quantity(v, "m/s", "velocity of P"), Quantity(w, "rad/s", "angular velocity")),
        (Quantity(energy, "J", "kinetic energy"),),
        (*carried, Equation("kinetic energy", energy, _substitute_parameters(value, p, array))),
        sources=body.sources,
    )


# --- between the internal frame and the body's own ----------------------------------------------


def _mass_equations(
    body: Body, array: sp.MatrixSymbol, mass: sp.ImmutableDenseMatrix
) -> tuple[Equation, ...]:
    if body.uses_hinge_axes:
        return (Equation("S = d residual / d acceleration", S.symbol, mass),)
    body_mass, (_, _, x) = sp.MatrixSymbol("S_O", 6, 6), _frame(body, array)
    carry = sp.MatrixSymbol("X", 6, 6)
    return (
        Equation("d residual / d acceleration, own frame", body_mass, mass),
        Equation("X", carry, x),
        Equation("S = X^T S_O X", S.symbol, carry.T * body_mass * carry),
    )


def _motion_equations(body: Body, array: sp.MatrixSymbol) -> tuple[Equation, ...]:
    motion, (turn, lever, _) = MOTION.symbol, _frame(body, array)
    w, wd, body_motion = vector("w_O", 3), vector("wd_O", 3), vector("motion_O", 9)
    spin = tilde(_triple(w, 0))
    minus_r = -sp.ImmutableDenseMatrix(_triple(array, len(body.parameters) + 9))
    a = turn * sp.ImmutableDenseMatrix(_triple(motion, 6)) + lever * wd + spin * (spin * minus_r)
    return (
        Equation(
            "angular velocity, own axes", w, turn * sp.ImmutableDenseMatrix(_triple(motion, 0))
        ),
        Equation(
            "angular acceleration, own axes", wd, turn * sp.ImmutableDenseMatrix(_triple(motion, 3))
        ),
        Equation("bias motion of the own origin", body_motion, sp.BlockMatrix([[w], [wd], [a]])),
    )


def _load_equations(
    body: Body, array: sp.MatrixSymbol, residual: sp.ImmutableDenseMatrix
) -> tuple[Equation, ...]:
    if body.uses_hinge_axes:
        return (Equation("e = residual at the bias motion", E.symbol, residual),)
    body_load, carry, (_, _, x) = vector("e_O", 6), sp.MatrixSymbol("X", 6, 6), _frame(body, array)
    return (
        Equation("residual at the bias motion, own frame", body_load, residual),
        Equation("X", carry, x),
        Equation("e = X^T e_O", E.symbol, carry.T * body_load),
    )


def _velocity_equations(
    body: Body, array: sp.MatrixSymbol, v: sp.MatrixSymbol, w: sp.MatrixSymbol
) -> tuple[Equation, ...]:
    turn, lever, _ = _frame(body, array)
    spin, velocity = vector("w_O", 3), vector("v_O", 3)
    return (
        Equation("angular velocity, own axes", spin, turn * w),
        Equation("velocity of the own origin", velocity, turn * v + lever * spin),
    )


# --- force elements -------------------------------------------------------------------------------

#: Failure code of a force element whose direction is undefined (`domain`).
UNDEFINED = 2

FORCE = Quantity(vector("F", 3), "N", "force on T at its point, inertial axes")
MOMENT = Quantity(vector("M", 3), "N*m", "moment on T, inertial axes")
STORED = Quantity(vector("V", 1), "J", "stored energy")
POWER = Quantity(vector("P", 1), "W", "power of non-conservative forces")


def _matrix(name: str) -> sp.MatrixSymbol:
    return sp.MatrixSymbol(name, 3, 3)


def _explicit(array: sp.MatrixSymbol) -> sp.Matrix:
    return sp.Matrix(array.rows, array.cols, lambda i, j: array[i, j])


def relative_motion() -> tuple[tuple[Equation, ...], tuple[sp.MatrixSymbol, ...]]:
    """Position, rate, rotation and angular velocity of T relative to F, in F axes."""
    a_f, a_t = _matrix("A_F"), _matrix("A_T")
    x_f, x_t, v_f, v_t, w_f, w_t = (
        vector(n, 3) for n in ("x_F", "x_T", "v_F", "v_T", "w_F", "w_T")
    )
    x, v, w, spin = (vector(n, 3) for n in ("x_rel", "v_rel", "w_rel", "w_own"))
    rotation = _matrix("R_rel")
    equations = (
        Equation("relative position, F axes", x, a_f.T * (x_t - x_f)),
        Equation("angular velocity of F, F axes", spin, a_f.T * w_f),
        Equation("relative rate, F axes", v, a_f.T * (v_t - v_f) - tilde(_explicit(spin)) * x),
        Equation("relative rotation", rotation, a_f.T * a_t),
        Equation("relative angular velocity, F axes", w, a_f.T * (w_t - w_f)),
    )
    return equations, (x, v, rotation, w)


def wrench(element: ForceElement) -> Derivation:
    """(p, t, effort, motion of both ends) -> force and moment on T, energy and power."""
    p = Symbols("p", tuple(x.name for x in element.parameters))
    parameters = vector("p", len(p))
    effort, t = sp.Symbol("effort", real=True), sp.Symbol("t", real=True)
    motion_equations, arrays = relative_motion()
    x, v, rotation, w = (_explicit(a) for a in arrays)
    force, moment = element.wrench(x, v, rotation, w, p, effort, t)
    beyond, rates = sp.Matrix([*force, *moment]), sp.Matrix([*v, *w])
    deflection, steps = element.deflection(x, rotation, p), list[Equation]()
    if deflection is None:
        energy, push = _potential_gradient(element, x, p)
        load, lost = beyond, (beyond - sp.Matrix([*push, 0, 0, 0])).dot(rates)
    else:
        bent = _explicit(vector("bent", len(deflection)))
        energy, push = _potential_gradient(element, bent, p)
        steps, pull = _deflection_equations(deflection, x, rotation, push)
        load, lost = beyond + pull, beyond.dot(rates)
    replace = {s: parameters[i, 0] for i, s in enumerate(p)}
    replace |= {effort: vector("effort", 1)[0, 0], t: vector("t", 1)[0, 0]}

    def final(value: sp.Matrix) -> sp.ImmutableDenseMatrix:
        return sp.ImmutableDenseMatrix(value.xreplace(replace))

    local, turning = vector("f_local", 3), vector("m_local", 3)
    equations = (
        *motion_equations,
        *(Equation(step.name, step.left, final(step.right)) for step in steps),
        Equation("force, F axes", local, final(load[:3, :])),
        Equation("moment, F axes", turning, final(load[3:, :])),
        Equation("force", FORCE.symbol, _matrix("A_F") * local),
        Equation("moment", MOMENT.symbol, _matrix("A_F") * turning),
        Equation("stored energy", STORED.symbol, final(sp.Matrix([energy]))),
        Equation("power", POWER.symbol, final(sp.Matrix([lost]))),
    )
    return Derivation(
        element.name,
        f"load of the {element.title}",
        (
            Quantity(parameters, "", describe_array("parameters", element.parameters)),
            Quantity(vector("t", 1), "s", "time"),
            Quantity(vector("effort", 1), "", "given effort"),
            *_end_motion("F"),
            *_end_motion("T"),
        ),
        (FORCE, MOMENT, STORED, POWER),
        equations,
        sources=element.sources,
    )


def _end_motion(end: str) -> tuple[Quantity, ...]:
    """Motion of an end, F or T."""
    return (
        Quantity(_matrix(f"A_{end}"), "", "rotation, end axes to inertial axes"),
        Quantity(vector(f"x_{end}", 3), "", "position"),
        Quantity(vector(f"v_{end}", 3), "", "velocity, inertial axes"),
        Quantity(vector(f"w_{end}", 3), "", "angular velocity, inertial axes"),
    )


def _potential_gradient(
    element: ForceElement, deflection: sp.Matrix, p: Symbols
) -> tuple[sp.Expr, sp.Matrix]:
    """Potential of a deflection, and its negative gradient."""
    names = sp.Matrix([sp.Dummy(real=True) for _ in deflection])
    values = dict(zip(names, deflection, strict=True))
    energy = sp.sympify(element.potential(names, p))
    push = sp.Matrix([-slope(energy, name).xreplace(values) for name in names])
    return energy.xreplace(values), push


def _deflection_equations(
    deflection: sp.Matrix, x: sp.Matrix, rotation: sp.Matrix, push: sp.Matrix
) -> tuple[list[Equation], sp.Matrix]:
    """Deflection, its derivatives by rates of x and rotations of T, and the resulting load."""
    n, units = len(deflection), sp.eye(3)
    names = [sp.Dummy(real=True) for _ in x]
    values = dict(zip(names, x, strict=True))
    of_names = deflection.xreplace(dict(zip(x, names, strict=True)))
    derivatives = [slope(of_names, name).xreplace(values) for name in names]
    turns = [rotating_derivative(deflection, rotation, units[:, k]) for k in range(3)]
    rows, force = sp.MatrixSymbol("E", n, 6), vector("push", n)
    steps = [
        Equation("deflection", vector("bent", n), deflection),
        Equation("deflection by rates and rotations", rows, sp.Matrix.hstack(*derivatives, *turns)),
        Equation("force along the deflection", force, push),
    ]
    return steps, _explicit(rows).T * _explicit(force)


def wrench_guards(element: ForceElement) -> tuple[tuple[sp.Basic, int, str], ...]:
    """Condition stated by the element, in terms of the arrays of the kernel."""
    p = Symbols("p", tuple(x.name for x in element.parameters))
    _, arrays = relative_motion()
    condition = element.domain_by_rotation(_explicit(arrays[0]), _explicit(arrays[2]), p)
    if condition is None:
        return ()
    replace = {s: vector("p", len(p))[i, 0] for i, s in enumerate(p)}
    return ((condition.xreplace(replace), UNDEFINED, "the force is undefined there"),)
