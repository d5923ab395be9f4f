"""Kernels of a body from its residual: mass matrix, inertia force of the bias motion, energy.

The residual (force and moment at the input end that a motion needs) is linear in the
accelerations; its derivative is the mass matrix, its value at the bias motion the load f_bias.
"""

from __future__ import annotations

import sympy as sp

from mstmm.errors import ElementError

from .derivation import Derivation, Equation, Quantity, vector
from .element import Body, Symbols
from .sweep import E, MOTION, S


def _columns(body: Body) -> tuple[Symbols, sp.MatrixSymbol, Quantity]:
    p = Symbols("p", tuple(x.name for x in body.parameters))
    array = vector("p", len(p))
    return p, array, Quantity(array, "", "parameters of the body, body axes, about its input end")


def _evaluated(matrix: sp.Matrix, p: Symbols, array: sp.MatrixSymbol) -> sp.ImmutableDenseMatrix:
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
    """S of the body alone: derivative of its residual by the acceleration."""
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
        (Equation("S = d residual / d acceleration", S.symbol, _evaluated(mass, p, array)),),
        sources=body.sources,
    )


def bias_load(body: Body) -> Derivation:
    """e of the body alone: residual at the bias motion."""
    p, array, parameters = _columns(body)
    motion = MOTION.symbol
    residual = body.residual(_triple(motion, 6), _triple(motion, 3), _triple(motion, 0), p)
    return Derivation(
        body.name,
        f"load that the bias motion of the {body.title} needs",
        (parameters, MOTION),
        (E,),
        (Equation("e = residual at the bias motion", E.symbol, _evaluated(residual, p, array)),),
        sources=body.sources,
    )


def kinetic_energy(body: Body) -> Derivation:
    """T from the velocity of P and the angular velocity, body axes."""
    p, array, parameters = _columns(body)
    v, w = vector("v", 3), vector("w", 3)
    energy = sp.MatrixSymbol("T", 1, 1)
    value = sp.Matrix([[body.kinetic_energy(_triple(v, 0), _triple(w, 0), p)]])
    return Derivation(
        body.name,
        f"kinetic energy of the {body.title}",
        (parameters, Quantity(v, "m/s", "velocity of P"), Quantity(w, "rad/s", "angular velocity")),
        (Quantity(energy, "J", "kinetic energy"),),
        (Equation("kinetic energy", energy, _evaluated(value, p, array)),),
        sources=body.sources,
    )
