"""Direct evaluation of a derivation's matrix equations, before lowering, at any precision.

Products, blocks and sums are mpmath matrices, `Solve` is a solution of the linear system by
elimination with row exchange, and declared zeros are computed like any other entry.  Nothing of
`lower` or of the IR is used, so that agreement with them is an independent check.  The
storage of a quantity (upper triangle of symmetric ones) matters only for inputs and outputs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import mpmath
import sympy as sp
from sympy.core.relational import Relational
from sympy.matrices.expressions.matexpr import MatrixElement
from sympy.matrices.expressions.slice import MatrixSlice

from ..definition.derivation import Derivation, Factor, Quantity, Solve, Triangle, Triangular

Matrix = Any  # mpmath.matrix; one with no rows or columns is kept as a plain list of rows
Number = Any


class Undefined(ArithmeticError):
    """An equation has no finite real value: a pole, a singular system, or outside its domain."""


class GuardBroken(Undefined):
    """A guard of the kernel does not hold; `code` is what the kernel returns."""

    def __init__(self, code: int, message: str) -> None:
        super().__init__(message)
        self.code = code


@dataclass(frozen=True)
class DirectValue:
    """Stored outputs, and the largest entry of S - S^T of the symmetric ones."""

    outputs: dict[str, list[Number]]
    asymmetry: Number


def evaluate_equations(
    derivation: Derivation,
    inputs: Mapping[str, Any],
    guards: Iterable[tuple[sp.Basic, int, str]] = (),
    digits: int = 50,
    n: int = 0,
) -> DirectValue:
    """Outputs of the derivation's definitions at `digits` decimal digits, each a flat list.

    `inputs[name]` are the numbers in the format of the kernel's inputs (row-major, of symmetric
    quantities the upper triangle); floats count as exact numbers.  `n` replaces the run-time
    size of a derivation that has one.  Raises GuardBroken where a
    guard does not hold and Undefined where an equation has no finite value.
    """
    derivation = derivation.at_size(n)
    with mpmath.workdps(digits):
        values = _Values(digits)
        for quantity in derivation.inputs:
            values.matrices[quantity.name] = _read_quantity(
                quantity, _flatten(inputs[quantity.name])
            )
        values.define(derivation, tuple(guards))
        outputs = {q.name: _stored_values(q, values) for q in derivation.outputs}
        asymmetries = [
            _asymmetry(values.matrices[q.name]) for q in derivation.outputs if q.symmetric
        ]
        return DirectValue(outputs, max(asymmetries, default=mpmath.mpf(0)))


def evaluate_matrix(
    matrix: sp.MatrixBase, values: Mapping[sp.Basic, Any], digits: int = 50
) -> list[list[Number]]:
    """Evaluate a matrix of scalar expressions at given values of its symbols."""
    with mpmath.workdps(digits):
        evaluation = _Values(digits)
        evaluation.scalars = {symbol: _number(value) for symbol, value in values.items()}
        return [[evaluation.scalar(e) for e in matrix.row(i)] for i in range(matrix.rows)]


# --- the border -------------------------------------------------------------------------------


def _flatten(values: Any) -> list[Number]:
    if isinstance(values, (str, mpmath.mpf)) or not isinstance(values, Iterable):
        return [_number(values)]
    return [number for entry in values for number in _flatten(entry)]


def _number(value: Any) -> Number:
    if isinstance(value, (int, float, str, mpmath.mpf)):
        return mpmath.mpf(value)
    return mpmath.mpf(int(value.numerator)) / int(value.denominator)


def _read_quantity(quantity: Quantity, numbers: list[Number]) -> Matrix:
    rows, columns = quantity.rows, quantity.columns
    count = rows * (rows + 1) // 2 if quantity.symmetric else rows * columns
    if len(numbers) != count:
        raise ValueError(f"{quantity.name}: expected {count} numbers, found {len(numbers)}")
    if quantity.symmetric:
        symmetric_matrix = mpmath.matrix(rows, rows)
        entries = iter(numbers)
        for i in range(rows):
            for j in range(i, rows):
                symmetric_matrix[i, j] = symmetric_matrix[j, i] = next(entries)
        return symmetric_matrix
    return _matrix_of_rows(
        [numbers[i * columns : (i + 1) * columns] for i in range(rows)], rows, columns
    )


def _stored_values(quantity: Quantity, values: _Values) -> list[Number]:
    rows, columns = quantity.rows, quantity.columns
    if rows * columns == 0:
        return []
    value = values.matrices[quantity.name]
    return [
        value[i, j] for i in range(rows) for j in range(i if quantity.symmetric else 0, columns)
    ]


def _asymmetry(value: Matrix) -> Number:
    n = value.rows
    return max((abs(value[i, j] - value[j, i]) for i in range(n) for j in range(i)), default=0)


# --- matrices ---------------------------------------------------------------------------------


@dataclass
class _Empty:
    """A matrix without entries, which mpmath does not support."""

    rows: int
    cols: int


def _matrix_of_rows(rows: list[list[Number]], height: int, width: int) -> Matrix:
    return mpmath.matrix(rows) if height and width else _Empty(height, width)


class _Values:
    """Quantities known so far, by name."""

    def __init__(self, digits: int) -> None:
        self.digits = digits
        self.matrices: dict[str, Matrix] = {}
        self.scalars: dict[sp.Basic, Number] = {}

    def define(self, derivation: Derivation, guards: tuple[tuple[sp.Basic, int, str], ...]) -> None:
        """Evaluate the definitions in order; a guard is checked once its quantities are known."""
        pending_guards = list(guards)
        for equation in derivation.definitions:
            self.matrices[str(equation.left.name)] = self.matrix(equation.right)
            pending_guards = [g for g in pending_guards if not self._check_guard(g)]
        assert not pending_guards, "a guard reads a quantity that no equation defines"

    def _check_guard(self, guard: tuple[sp.Basic, int, str]) -> bool:
        """Check a guard; return False while its quantities are not known."""
        condition, code, message = guard
        names = {str(s.name) for s in condition.atoms(sp.MatrixSymbol)}
        if not names <= self.matrices.keys():
            return False
        if not self.truth(condition):
            raise GuardBroken(code, message)
        return True

    def matrix(self, e: sp.Basic) -> Matrix:
        if not getattr(e, "is_Matrix", False):
            return mpmath.matrix([[self.scalar(e)]])
        height, width = (int(n) for n in e.shape)
        if 0 in (height, width):
            return _Empty(height, width)
        if isinstance(e, sp.MatrixSymbol):
            return self.matrices[str(e.name)]
        if isinstance(e, sp.MatrixBase):
            return mpmath.matrix([[self.scalar(x) for x in e.row(i)] for i in range(height)])
        if isinstance(e, sp.MatAdd):
            return _fold(lambda a, b: a + b, [self.matrix(a) for a in e.args])
        if isinstance(e, sp.MatMul):
            return self._product(e, height, width)
        if isinstance(e, sp.Transpose):
            return self.matrix(e.arg).T
        if isinstance(e, sp.BlockMatrix):
            return self._blocks(e, height, width)
        if isinstance(e, MatrixSlice):
            parent_matrix = self.matrix(e.parent)
            rows, columns = (range(*map(int, part)) for part in (e.rowslice, e.colslice))
            return mpmath.matrix([[parent_matrix[i, j] for j in columns] for i in rows])
        if isinstance(e, sp.Identity):
            return mpmath.eye(height)
        if isinstance(e, sp.ZeroMatrix):
            return mpmath.zeros(height, width)
        if isinstance(e, Solve):
            return self._solve(e.matrix, e.right)
        if isinstance(e, Factor):
            return self._factor(self.matrix(e.matrix))
        if isinstance(e, Triangular):
            lower = self._unit_lower(e.factor)
            return self._solve(lower.T if e.is_transposed else lower, e.right)
        if isinstance(e, Triangle):
            return self._triangle(self.matrix(e.matrix), e.count)
        raise NotImplementedError(f"cannot evaluate {type(e).__name__}")

    def _product(self, e: sp.MatMul, height: int, width: int) -> Matrix:
        if any(0 in (int(a.shape[0]), int(a.shape[1])) for a in e.args if a.is_Matrix):
            return mpmath.zeros(height, width)  # empty sum
        factors = [self.matrix(a) if a.is_Matrix else self.scalar(a) for a in e.args]
        return _fold(lambda a, b: a * b, factors)

    def _blocks(self, e: sp.BlockMatrix, height: int, width: int) -> Matrix:
        result = mpmath.matrix(height, width)
        top = 0
        for i in range(e.blocks.rows):
            left = 0
            for j in range(e.blocks.cols):
                block = self.matrix(e.blocks[i, j])
                for r in range(block.rows):
                    for c in range(block.cols):
                        result[top + r, left + c] = block[r, c]
                left += block.cols
            top += int(e.blocks[i, 0].shape[0])
        return result

    def _factor(self, a: Matrix) -> Matrix:
        """L and 1 / d of L diag(d) L^T from Cholesky's factor, A = C C^T: L = C diag(C_ii)^-1."""
        n = a.rows
        with mpmath.workdps(self.digits + 10):
            try:
                root = mpmath.cholesky(a)
            except ValueError as error:
                raise Undefined(f"matrix not positive definite: {error}") from None
            factor = mpmath.zeros(n, n)
            for i in range(n):
                factor[i, i] = 1 / root[i, i] ** 2
                for j in range(i):
                    factor[i, j] = root[i, j] / root[j, j]
            return factor

    def _triangle(self, a: Matrix, count: int) -> Matrix:
        """Rows of R by Gram-Schmidt orthogonalisation.

        A column that depends linearly on earlier ones gives a row of zeros.
        """
        with mpmath.workdps(2 * self.digits):
            columns = [a[:, j] for j in range(a.cols)]
            sizes = [mpmath.norm(column) for column in columns]
            triangle = mpmath.zeros(count, a.cols)
            for k in range(count):
                length = mpmath.norm(columns[k])
                if length <= sizes[k] * mpmath.mpf(10) ** -self.digits:
                    continue
                unit = columns[k] / length
                for j in range(k, a.cols):
                    triangle[k, j] = (unit.T * columns[j])[0]
                    columns[j] = columns[j] - unit * triangle[k, j]
            return triangle

    def _unit_lower(self, factor: sp.Basic) -> sp.ImmutableDenseMatrix:
        """L as an explicit matrix: ones on the diagonal, zeros above."""
        n = int(factor.shape[0])
        return sp.ImmutableDenseMatrix(
            n, n, lambda i, j: factor[i, j] if i > j else sp.Integer(i == j)
        )

    def _solve(self, matrix: sp.Basic, right: sp.Basic) -> Matrix:
        """X of A X = B by LU with row exchange, at ten digits more."""
        a, b = self.matrix(matrix), self.matrix(right)
        if isinstance(b, _Empty):
            return b
        with mpmath.workdps(self.digits + 10):
            try:
                columns = [mpmath.lu_solve(a, b[:, j]) for j in range(b.cols)]
            except (ZeroDivisionError, ValueError) as error:
                raise Undefined(f"singular system: {error}") from None
            return mpmath.matrix([[+c[i] for c in columns] for i in range(b.rows)])

    # --- scalars ------------------------------------------------------------------------------

    def scalar(self, e: sp.Basic) -> Number:
        value = self.scalars.get(e)
        if value is None:
            value = self._scalar(e)
            self.scalars[e] = value
        return value

    def _scalar(self, e: sp.Basic) -> Number:
        if isinstance(e, MatrixElement):
            return self.matrix(e.parent)[int(e.i), int(e.j)]
        if isinstance(e, (sp.Rational, sp.Float, sp.NumberSymbol)):
            return mpmath.mpf(e._to_mpmath(mpmath.mp.prec))
        if e is sp.I or e in (sp.nan, sp.zoo, sp.oo, -sp.oo):
            raise Undefined(f"{e} is not a real number")
        if isinstance(e, sp.Piecewise):
            return next(self.scalar(value) for value, condition in e.args if self.truth(condition))
        function = _FUNCTIONS.get(type(e)) or next(
            (f for kind, f in _FUNCTIONS.items() if isinstance(e, kind)), None
        )
        if function is None:
            raise NotImplementedError(f"cannot evaluate {e} ({type(e).__name__})")
        try:
            value = function(*(self.scalar(a) for a in e.args))
        except ZeroDivisionError:
            raise Undefined(f"pole of {e}") from None
        if not isinstance(value, mpmath.mpf) or not mpmath.isfinite(value):
            raise Undefined(f"{e} has no finite real value")
        return value

    def truth(self, condition: sp.Basic) -> bool:
        """Whether a condition holds."""
        if condition in (sp.true, sp.false, True, False):
            return bool(condition)
        if isinstance(condition, Relational):
            left, right = self.scalar(condition.lhs), self.scalar(condition.rhs)
            return bool(_RELATIONS[condition.rel_op](left, right))
        parts = [self.truth(a) for a in condition.args]
        if isinstance(condition, sp.And):
            return all(parts)
        if isinstance(condition, sp.Or):
            return any(parts)
        assert isinstance(condition, sp.Not)
        return not parts[0]


def _fold(join: Callable[[Any, Any], Any], values: list[Any]) -> Any:
    result = values[0]
    for value in values[1:]:
        result = join(result, value)
    return result


_RELATIONS: dict[str, Callable[[Number, Number], bool]] = {
    "<": lambda a, b: a < b,
    "<=": lambda a, b: a <= b,
    ">": lambda a, b: a > b,
    ">=": lambda a, b: a >= b,
    "==": lambda a, b: a == b,
    "!=": lambda a, b: a != b,
}

_FUNCTIONS: dict[type, Callable[..., Number]] = {
    sp.Add: lambda *a: mpmath.fsum(a),
    sp.Mul: lambda *a: mpmath.fprod(a),
    sp.Pow: mpmath.power,
    sp.Min: min,
    sp.Max: max,
    sp.Abs: abs,
    sp.sign: mpmath.sign,
    sp.floor: mpmath.floor,
    sp.sin: mpmath.sin, sp.cos: mpmath.cos, sp.tan: mpmath.tan,
    sp.asin: mpmath.asin, sp.acos: mpmath.acos, sp.atan: mpmath.atan, sp.atan2: mpmath.atan2,
    sp.sinh: mpmath.sinh, sp.cosh: mpmath.cosh, sp.tanh: mpmath.tanh,
    sp.exp: mpmath.exp, sp.log: mpmath.log,
}  # fmt: skip
