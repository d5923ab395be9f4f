"""Dynamic stiffness of a uniform beam and rod in harmonic vibration, from field matrices.

With the field matrix U, which relates displacements d and internal loads p at both ends, the ends'
displacements d = (d_0, d_L) give

    p_0 = U_dp^-1 (d_L - U_dd d_0),      p_L = U_pd d_0 + U_pp p_0,

for a beam with d = (w, w') and p = (w'', w'''), loads (E I w''', -E I w'') on the root and (-E I
w''', E I w'') on the tip, for a rod with d = u and p = u'.  Length and stiffness are 1; the only
parameter is

    beam: zeta = z^4 = -rho A s^2 l^4 / (E I),      rod: zeta = z^2 = -rho A s^2 l^2 / (E A)

at exp(s t), complex with damping.  Hyperbolic functions are scaled by exp(z), a common factor of
numerator and denominator, so that nothing overflows.

The term of order 0 in zeta is the static stiffness, that of order 1 the mass of the element with
polynomial shapes (Przemieniecki, Theory of Matrix Structural Analysis, ch. 12).  The kernels give
the stiffness less its term of order 0, because the mass of rigid motions would be lost next to a
stiffness that is larger by 1 / zeta.  Near zeta = 0 it is a power series, where the quotients would
cancel.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import sympy as sp

from ..definition.derivation import Derivation, Equation, Quantity, vector
from ..definition.notation import Matrix

# --- transfer matrices ----------------------------------------------------------------------------
# The state is [w, w', w'', w'''], deflection, slope, and moment and shear over the bending
# stiffness. The solutions of the field equation w'''' = beta^4 w, beta^4 = rho A omega^2 / (E I),
# are normalised to the state at the input end: Krylov's functions.

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


# --- dynamic stiffness ----------------------------------------------------------------------------

_Z = sp.Symbol("z", positive=True)
#: exp(-z), cos z and sin z.
_DECAY, _COS, _SIN = sp.symbols("E c s")
_HYPERBOLIC = {sp.cosh(_Z): (1 / _DECAY + _DECAY) / 2, sp.sinh(_Z): (1 / _DECAY - _DECAY) / 2}
#: Derivatives at 0, in turn.
_DERIVATIVES = {
    sp.cosh: (1, 0, 1, 0), sp.sinh: (0, 1, 0, 1), sp.cos: (1, 0, -1, 0), sp.sin: (0, 1, 0, -1),
}  # fmt: skip
_CIRCULAR = {sp.cos(_Z): _COS, sp.sin(_Z): _SIN}
#: Number of power series terms beyond the first two, and |zeta| up to which the series is used:
#: there the last term is below rounding; the first pole is at zeta = 500 for the beam and 10 for
#: the rod.
_SERIES_TERM_COUNT, _MAX_SERIES_ZETA_BEAM, _MAX_SERIES_ZETA_ROD = 8, 5, sp.Rational(1, 10)

ZETA = Quantity(vector("zeta", 2), "", "real and imaginary part of zeta")
SOURCES = (
    "Rui, Wang, Zhang, ch. 2 (field matrices)",
    "Wittrick, Williams, Q. J. Mech. Appl. Math. 24 (1971) 263-284 (dynamic stiffness)",
)


@cache
def beam_stiffness() -> tuple[sp.ImmutableMatrix, sp.Expr]:
    """N (4, 4) and its divisor d of D = N / d for (w, w') at root and tip."""
    field = field_matrix().subs({BETA: _Z, LENGTH: 1})
    loads = sp.Matrix([[0, 1], [-1, 0]])
    return _stiffness_from_field_matrix(field, loads, 2 * _Z**4)


@cache
def rod_stiffness() -> tuple[sp.ImmutableMatrix, sp.Expr]:
    """N (2, 2) and its divisor d of D = N / d for u at root and tip."""
    field = sp.Matrix([[sp.cos(_Z), sp.sin(_Z) / _Z], [-_Z * sp.sin(_Z), sp.cos(_Z)]])
    return _stiffness_from_field_matrix(field, sp.Matrix([[-1]]), _Z)


def _stiffness_from_field_matrix(
    field: Matrix, loads: Matrix, scale: sp.Expr
) -> tuple[sp.ImmutableMatrix, sp.Expr]:
    """End loads by end displacements, as numerators over `scale` det U_dp.

    `loads` maps p_0 to the loads on the root.
    """
    m = field.rows // 2
    dd, dp, pd, pp = field[:m, :m], field[:m, m:], field[m:, :m], field[m:, m:]
    root = sp.Matrix.hstack(-dp.adjugate() * dd, dp.adjugate())
    tip = sp.Matrix.hstack(pd * dp.det(), sp.zeros(m)) + pp * root
    loads_by_displacements = sp.Matrix.vstack(loads * root, -loads * tip)
    numerator = loads_by_displacements.applyfunc(lambda entry: _reduce_polynomial(scale * entry))
    return sp.ImmutableMatrix(numerator), _reduce_polynomial(scale * dp.det())


def _reduce_polynomial(expression: sp.Expr) -> sp.Expr:
    """Polynomial of z, cosh z, sinh z, cos z and sin z with reduced squares."""
    symbols = {name(_Z): sp.Dummy(str(name)) for name in _DERIVATIVES}
    cosh_, sinh_, cos_, sin_ = symbols.values()
    identities = [cosh_**2 - sinh_**2 - 1, cos_**2 + sin_**2 - 1]
    polynomial = sp.expand(expression.xreplace(symbols))
    _, remainder = sp.reduced(polynomial, identities, *symbols.values())
    return remainder.xreplace({symbol: function for function, symbol in symbols.items()})


# --- near zeta = 0 --------------------------------------------------------------------------------


@cache
def _series_coefficients(numerator: sp.Expr, divisor: sp.Expr, order: int) -> list[sp.Rational]:
    """Coefficients of zeta^0, zeta^1, ... of a quotient, zeta = z^order."""
    count = order * (_SERIES_TERM_COUNT + 2)
    numerator_series, divisor_series = (
        _taylor_coefficients(x, count + 5) for x in (numerator, divisor)
    )
    leading_index = next(k for k, x in enumerate(divisor_series) if x)
    numerator_series, divisor_series = (
        numerator_series[leading_index:],
        divisor_series[leading_index:],
    )
    coefficients: list[sp.Rational] = []
    for k in range(count):
        convolution = sum(
            (coefficients[j] * divisor_series[k - j] for j in range(k)), sp.Integer(0)
        )
        coefficients.append((numerator_series[k] - convolution) / divisor_series[0])
    return coefficients[::order]


def _taylor_coefficients(expression: sp.Expr, count: int) -> list[sp.Rational]:
    """Coefficients of the powers of z up to `count`."""
    symbols = {name(_Z): sp.Dummy(str(name)) for name in _DERIVATIVES}
    total = sp.Poly(0, _Z)
    for powers, factor in sp.Poly(expression.xreplace(symbols), _Z, *symbols.values()).terms():
        term = sp.Poly(factor * _Z ** powers[0], _Z)
        for name, power in zip(_DERIVATIVES, powers[1:], strict=True):
            for _ in range(power):
                term = term * _function_series(name, count)
        total = total + term
    return [total.coeff_monomial(_Z**k) for k in range(count)]


@cache
def _function_series(name: type[sp.Function], count: int) -> sp.Poly:
    """Power series of a function whose derivatives at 0 repeat."""
    cycle = _DERIVATIVES[name]
    terms = (cycle[k % 4] * _Z**k / sp.factorial(k) for k in range(count))
    return sp.Poly(sum(terms, sp.Integer(0)), _Z)


# --- in real and imaginary parts ------------------------------------------------------------------

Pair = tuple[sp.Expr, sp.Expr]


def _complex_parts(symbol: sp.MatrixSymbol) -> Pair:
    return symbol[0, 0], symbol[1, 0]


def _complex_product(a: Pair, b: Pair) -> Pair:
    return a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]


def _evaluate_polynomial(expression: sp.Expr, values: dict[sp.Symbol, Pair]) -> Pair:
    """Polynomial of complex symbols, in real and imaginary parts."""
    total: Pair = (sp.Integer(0), sp.Integer(0))
    symbols = list(values)
    for powers, coefficient in sp.Poly(sp.expand(expression), *symbols).terms():
        term: Pair = (coefficient, sp.Integer(0))
        for symbol, power in zip(symbols, powers, strict=True):
            for _ in range(power):
                term = _complex_product(term, values[symbol])
        total = (total[0] + term[0], total[1] + term[1])
    return total


def _evaluate_series(coefficients: Sequence[sp.Expr], zeta: Pair) -> Pair:
    """sum c_k zeta^k from k = 1 on, in Horner's form."""
    value: Pair = (sp.Integer(0), sp.Integer(0))
    for coefficient in reversed(coefficients[1:]):
        value = _complex_product(value, zeta)
        value = (value[0] + coefficient, value[1])
    return _complex_product(value, zeta)


_ROOT, _FUNCTION_VALUES = vector("z", 2), vector("f", 6)


def _function_values(order: int) -> tuple[Equation, ...]:
    """z, and exp(-z), cos z and sin z in parts."""
    a, b = _complex_parts(ZETA.symbol)
    size, turn = sp.sqrt(a**2 + b**2), sp.atan2(b, a) / order
    radius = sp.sqrt(sp.sqrt(size)) if order == 4 else sp.sqrt(size)
    x, y = _complex_parts(_ROOT)
    growing, falling, decay = sp.exp(y), sp.exp(-y), sp.exp(-x)
    cosh_y, sinh_y = (growing + falling) / 2, (growing - falling) / 2
    values = [
        decay * sp.cos(y), -decay * sp.sin(y), sp.cos(x) * cosh_y, -sp.sin(x) * sinh_y,
        sp.sin(x) * cosh_y, sp.cos(x) * sinh_y,
    ]  # fmt: skip
    root = [radius * sp.cos(turn), radius * sp.sin(turn)]
    return (
        Equation("z", _ROOT, sp.ImmutableDenseMatrix(root)),
        Equation("exp(-z), cos z, sin z", _FUNCTION_VALUES, sp.ImmutableDenseMatrix(values)),
    )


def _stiffness_derivation(
    title: str, parts: tuple[sp.ImmutableMatrix, sp.Expr], order: int, near: sp.Expr, scale: sp.Expr
) -> Derivation:
    """D less its term of order 0; `scale` times numerator and divisor has no cosh."""
    numerator, divisor = parts
    size = numerator.rows
    values = {
        s: (_FUNCTION_VALUES[2 * k, 0], _FUNCTION_VALUES[2 * k + 1, 0])
        for k, s in enumerate((_DECAY, _COS, _SIN))
    } | {_Z: _complex_parts(_ROOT)}

    def in_parts(expression: sp.Expr) -> Pair:
        return _evaluate_polynomial(
            (expression.xreplace(_HYPERBOLIC) * scale).xreplace(_CIRCULAR), values
        )

    divisor_symbol, quotient = vector("d", 2), vector("inverse", 2)
    d = _complex_parts(divisor_symbol)
    square = d[0] ** 2 + d[1] ** 2
    inverse = [d[0] / square, -d[1] / square]
    zeta = _complex_parts(ZETA.symbol)
    is_near = zeta[0] ** 2 + zeta[1] ** 2 < near**2
    real, imaginary = sp.zeros(size), sp.zeros(size)
    for i in range(size):
        for j in range(i, size):
            above, coefficients = (
                numerator[i, j],
                _series_coefficients(numerator[i, j], divisor, order),
            )
            far_value = _complex_product(in_parts(above), _complex_parts(quotient))
            far_value = (far_value[0] - coefficients[0], far_value[1])
            near_value = _evaluate_series(coefficients, zeta)
            real[i, j] = real[j, i] = sp.Piecewise((near_value[0], is_near), (far_value[0], True))
            imaginary[i, j] = imaginary[j, i] = sp.Piecewise(
                (near_value[1], is_near), (far_value[1], True)
            )
    re, im = sp.MatrixSymbol("D_re", size, size), sp.MatrixSymbol("D_im", size, size)
    return Derivation(
        "beam",
        title,
        (ZETA,),
        (
            Quantity(divisor_symbol, "", "the divisor, with the sign of that of D"),
            Quantity(re, "", "real part, in the stiffness of the element", symmetric=True),
            Quantity(im, "", "imaginary part", symmetric=True),
        ),
        (
            *_function_values(order),
            Equation("divisor", divisor_symbol, sp.ImmutableDenseMatrix(list(in_parts(divisor)))),
            Equation("1 / divisor", quotient, sp.ImmutableDenseMatrix(inverse)),
            Equation("Re D", re, sp.ImmutableDenseMatrix(real), symmetric=True),
            Equation("Im D", im, sp.ImmutableDenseMatrix(imaginary), symmetric=True),
        ),
        sources=SOURCES,
    )  # fmt: skip


def harmonic_bending() -> Derivation:
    """Dynamic stiffness of bending beyond the static one."""
    title = "dynamic stiffness of a bending beam, less the static one"
    return _stiffness_derivation(title, beam_stiffness(), 4, _MAX_SERIES_ZETA_BEAM, _DECAY)


def harmonic_rod() -> Derivation:
    """Dynamic stiffness of tension or twist beyond the static one."""
    title = "dynamic stiffness of a rod, less the static one"
    return _stiffness_derivation(title, rod_stiffness(), 2, _MAX_SERIES_ZETA_ROD, sp.Integer(1))


#: Name -> derivation of the kernels.
KERNELS = {"harmonic_bending": harmonic_bending, "harmonic_rod": harmonic_rod}
