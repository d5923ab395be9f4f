"""Transfer matrices of a beam in harmonic vibration: Rui, Wang, Zhang, ch. 2.

The state is [w, w', w'', w'''], deflection, slope, and moment and shear over the bending stiffness.
The solutions of the field equation w'''' = beta^4 w, beta^4 = rho A omega^2 / (E I), are normalised
to the state at the input end: Krylov's functions.
"""

from __future__ import annotations

from functools import cache

import sympy as sp

BETA = sp.Symbol("beta", positive=True)
LENGTH = sp.Symbol("l", positive=True)


@cache
def field_matrix() -> sp.ImmutableMatrix:
    """U (4, 4) of z(l) = U z(0)."""
    x = sp.Symbol("x", real=True)
    solutions = [function(BETA * x) for function in (sp.cosh, sp.sinh, sp.cos, sp.sin)]
    state = sp.Matrix([[w.diff(x, k) for w in solutions] for k in range(4)])
    at_end = state.subs(x, LENGTH) * state.subs(x, 0).inv()
    return sp.ImmutableMatrix(at_end.applyfunc(sp.simplify))


def mass_matrix(ratio: sp.Expr) -> sp.ImmutableMatrix:
    """Transfer matrix (4, 4) of a point mass with `ratio` = m / (rho A)."""
    return _shear_matrix(ratio * BETA**4)


def spring_matrix(ratio: sp.Expr) -> sp.ImmutableMatrix:
    """Transfer matrix (4, 4) of a transverse spring to the ground with `ratio` = k / (E I)."""
    return _shear_matrix(-ratio)


def _shear_matrix(by: sp.Expr) -> sp.ImmutableMatrix:
    matrix = sp.eye(4)
    matrix[3, 0] = by
    return sp.ImmutableMatrix(matrix)
