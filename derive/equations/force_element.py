"""Kernel of a force element between two ends, from its law in relative motion."""

from __future__ import annotations

import sympy as sp

from ..definition.derivation import Derivation, Equation, Quantity, tilde, vector
from ..definition.element import ForceElement, Symbols, describe_array
from ..definition.nonsmooth_functions import slope
from ..definition.rotations import rotating_derivative

#: Failure code of a force element whose direction is undefined (`domain`).
UNDEFINED = 2


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
    equations, arrays = relative_motion()
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

    a_f, local = _matrix("A_F"), vector("f_local", 3)
    turning = vector("m_local", 3)
    outputs = (
        Quantity(vector("F", 3), "N", "force on T at its point, inertial axes"),
        Quantity(vector("M", 3), "N*m", "moment on T, inertial axes"),
        Quantity(vector("V", 1), "J", "stored energy"),
        Quantity(vector("P", 1), "W", "power of non-conservative forces"),
    )
    return Derivation(
        element.name,
        f"load of the {element.title}",
        (
            Quantity(parameters, "", describe_array("parameters", element.parameters)),
            Quantity(vector("t", 1), "s", "time"),
            Quantity(vector("effort", 1), "", "given effort"),
            *(
                Quantity(_matrix(f"A_{end}") if k == "A" else vector(f"{k}_{end}", 3), "", meaning)
                for end in ("F", "T")
                for k, meaning in (
                    ("A", "rotation, end axes to inertial axes"),
                    ("x", "position"),
                    ("v", "velocity, inertial axes"),
                    ("w", "angular velocity, inertial axes"),
                )
            ),
        ),
        outputs,
        (
            *equations,
            *(Equation(step.name, step.left, final(step.right)) for step in steps),
            Equation("force, F axes", local, final(load[:3, :])),
            Equation("moment, F axes", turning, final(load[3:, :])),
            Equation("force", outputs[0].symbol, a_f * local),
            Equation("moment", outputs[1].symbol, a_f * turning),
            Equation("stored energy", outputs[2].symbol, final(sp.Matrix([energy]))),
            Equation("power", outputs[3].symbol, final(sp.Matrix([lost]))),
        ),
        sources=element.sources,
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
