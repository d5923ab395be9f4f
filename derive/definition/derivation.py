"""Derivation: equations of one element in SymPy, before lowering to code.

`premises` are the physical equations as the field states them; `definitions` are the explicit
assignments that follow from them, in an order in which they can be evaluated.  Only the
definitions are lowered; the premises are what the checks compare the lowered kernel with.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any

import sympy as sp
from sympy.functions.elementary.piecewise import ExprCondPair
from sympy.logic.boolalg import Boolean

from mstmm.errors import ElementError, MstmmError
from mstmm.ir import OPERATIONS


@dataclass(frozen=True)
class Quantity:
    """A named array: MatrixSymbol `symbol` of shape (rows, columns); columns = 1 for a vector.

    `symmetric` quantities are stored as their upper triangle, row by row.  Either extent may be
    a symbol, a run-time size; such quantities are stored full, symmetric or not.
    """

    symbol: sp.MatrixSymbol
    unit: str = ""
    meaning: str = ""
    symmetric: bool = False
    accumulate: bool = False

    @property
    def name(self) -> str:
        return str(self.symbol.name)

    @property
    def rows(self) -> int:
        return int(self.symbol.rows)

    @property
    def columns(self) -> int:
        return int(self.symbol.cols)

    @property
    def shape(self) -> tuple[int | str, int | str]:
        """Rows and columns; a run-time size is given by its name."""
        rows, columns = (int(e) if e.is_Integer else str(e) for e in self.symbol.shape)
        return rows, columns

    @property
    def has_runtime_size(self) -> bool:
        """Whether an extent is a run-time size."""
        return any(isinstance(extent, str) for extent in self.shape)


@dataclass(frozen=True)
class Equation:
    """left = right; in a definition `left` is the MatrixSymbol that `right` defines.

    `zeros` lists entries of `right` that vanish identically although no single term does; they
    are not computed.  If `symmetric`, the upper half is computed and mirrored.  `computed` is a
    shorter form of `right` that is lowered in its place.  The checks evaluate `right` itself.
    """

    name: str
    left: sp.Basic
    right: sp.Basic
    source: str = ""
    remark: str = ""
    zeros: tuple[tuple[int, int], ...] = ()
    symmetric: bool = False
    computed: sp.Basic | None = None


@dataclass(frozen=True)
class Derivation:
    """One element (or one step of the sweep), from its premises to explicit definitions."""

    element: str
    title: str
    inputs: tuple[Quantity, ...]
    outputs: tuple[Quantity, ...]
    definitions: tuple[Equation, ...]
    premises: tuple[Equation, ...] = ()
    sources: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def size(self) -> sp.Symbol | None:
        """Run-time size; None without one.  Raises ValueError where there are two."""
        symbols = [q.symbol for q in (*self.inputs, *self.outputs)]
        symbols += [e.left for e in self.definitions]
        sizes = {extent for s in symbols for extent in s.shape if not extent.is_Integer}
        if len(sizes) > 1 or not all(extent.is_Symbol for extent in sizes):
            raise ValueError(
                f"{self.element}: more than one run-time size: {sorted(map(str, sizes))}"
            )
        return sizes.pop() if sizes else None

    def at_size(self, n: int) -> Derivation:
        """The same derivation with the run-time size replaced by a number."""
        size = self.size
        if size is None:
            return self
        replacements = {size: sp.Integer(n)}

        def quantity(q: Quantity) -> Quantity:
            symbol = q.symbol.xreplace(replacements)
            return replace(q, symbol=symbol, symmetric=q.symmetric and not q.has_runtime_size)

        def equation(e: Equation) -> Equation:
            computed = None if e.computed is None else e.computed.xreplace(replacements)
            left, right = e.left.xreplace(replacements), e.right.xreplace(replacements)
            return replace(e, left=left, right=right, computed=computed)

        return replace(
            self,
            inputs=tuple(map(quantity, self.inputs)),
            outputs=tuple(map(quantity, self.outputs)),
            definitions=tuple(map(equation, self.definitions)),
            premises=tuple(map(equation, self.premises)),
        )

    def definition(self, name: str) -> sp.Basic:
        """Right-hand side of the definition of `name`.  Raises KeyError if there is none."""
        for equation in self.definitions:
            if str(getattr(equation.left, "name", equation.left)) == name:
                return equation.right
        raise KeyError(f"{self.element}: no equation defines {name!r}")


class Solve(sp.MatrixExpr):
    """A^-1 B, never inverted symbolically: lowered to an unrolled, guarded elimination.

    With `symmetric` (A positive definite) the elimination is LDL^T without pivoting; otherwise
    LU with row exchange.  A pivot below 1e-13 of its own diagonal entry (of its row for LU)
    makes the kernel return a failure code.
    """

    def __new__(cls, matrix: sp.Basic, right: sp.Basic, symmetric: bool = False) -> Solve:
        return super().__new__(
            cls, sp.sympify(matrix), sp.sympify(right), sp.sympify(bool(symmetric))
        )

    @property
    def matrix(self) -> sp.Basic:
        return self.args[0]

    @property
    def right(self) -> sp.Basic:
        return self.args[1]

    @property
    def symmetric(self) -> bool:
        return bool(self.args[2])

    @property
    def shape(self) -> tuple[sp.Expr, sp.Expr]:
        return (self.args[0].shape[0], self.args[1].shape[1])

    def _entry(self, i: sp.Expr, j: sp.Expr, **kwargs: object) -> sp.Expr:
        return (self.args[0].inv() * self.args[1])[i, j]


class Factor(sp.MatrixExpr):
    """A = L diag(d) L^T of a symmetric positive definite A, stored in one matrix.

    The diagonal holds 1 / d, the part below it the unit lower triangular L; zeros above.
    Guarded as `Solve`.
    """

    def __new__(cls, matrix: sp.Basic) -> Factor:
        return super().__new__(cls, sp.sympify(matrix))

    @property
    def matrix(self) -> sp.Basic:
        return self.args[0]

    @property
    def shape(self) -> tuple[sp.Expr, sp.Expr]:
        return self.args[0].shape

    def _entry(self, i: sp.Expr, j: sp.Expr, **kwargs: object) -> sp.Expr:
        lower, pivots = sp.Matrix(self.args[0]).LDLdecomposition(hermitian=False)
        return 1 / pivots[i, i] if i == j else lower[i, j]


class Triangular(sp.MatrixExpr):
    """L^-1 B, or L^-T B if `is_transposed`; L is the unit lower triangle of `factor`.

    Lowered to unrolled substitution; the diagonal and the part above it are not read.
    """

    def __new__(cls, factor: sp.Basic, right: sp.Basic, transposed: bool = False) -> Triangular:
        return super().__new__(
            cls, sp.sympify(factor), sp.sympify(right), sp.sympify(bool(transposed))
        )

    @property
    def factor(self) -> sp.Basic:
        return self.args[0]

    @property
    def right(self) -> sp.Basic:
        return self.args[1]

    @property
    def is_transposed(self) -> bool:
        return bool(self.args[2])

    @property
    def shape(self) -> tuple[sp.Expr, sp.Expr]:
        return (self.args[0].shape[0], self.args[1].shape[1])

    def _entry(self, i: sp.Expr, j: sp.Expr, **kwargs: object) -> sp.Expr:
        n = int(self.args[0].shape[0])
        lower = sp.Matrix(n, n, lambda r, c: self.args[0][r, c] if r > c else sp.Integer(r == c))
        return ((lower.T if self.is_transposed else lower).inv() * sp.Matrix(self.args[1]))[i, j]


class Triangle(sp.MatrixExpr):
    """The first `count` rows of R, where A = Q R with orthonormal Q.

    R is upper triangular in the first `count` columns, with a non-negative diagonal: R^T R =
    A^T A if A has no more rows.  Lowered to rotations of neighbouring rows, which keep known
    zeros; blocks of any size may be placed side by side.
    """

    def __new__(cls, matrix: sp.Basic, count: int | sp.Integer) -> Triangle:
        return super().__new__(cls, sp.sympify(matrix), sp.Integer(count))

    @property
    def matrix(self) -> sp.Basic:
        return self.args[0]

    @property
    def count(self) -> int:
        return int(self.args[1])

    @property
    def shape(self) -> tuple[sp.Expr, sp.Expr]:
        return (self.args[1], self.args[0].shape[1])

    def _entry(self, i: sp.Expr, j: sp.Expr, **kwargs: object) -> sp.Expr:
        a = sp.Matrix(self.args[0])
        q, r = a[:, : self.count].QRdecomposition()
        return r[i, j] if j < self.count else (q.T * a)[i, j]


def vector(name: str, length: int) -> sp.MatrixSymbol:
    """Column of `length` numbers."""
    return sp.MatrixSymbol(name, length, 1)


def tilde(a: sp.MatrixBase | sp.MatrixExpr | Iterable[sp.Expr]) -> sp.ImmutableDenseMatrix:
    """Cross-product matrix: tilde(a) b = a x b."""
    matrix: Any = a
    x, y, z = (matrix[i, 0] for i in range(3)) if hasattr(a, "shape") else a
    return sp.ImmutableDenseMatrix([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def axial(matrix: sp.MatrixBase) -> sp.ImmutableDenseMatrix:
    """Inverse of `tilde` on the skew part of a 3 x 3 matrix."""
    return sp.ImmutableDenseMatrix(
        [
            (matrix[2, 1] - matrix[1, 2]) / 2,
            (matrix[0, 2] - matrix[2, 0]) / 2,
            (matrix[1, 0] - matrix[0, 1]) / 2,
        ]
    )


# --- results of methods ---------------------------------------------------------------------------
# A definition is user code: a method may raise, return nothing, or use functions without
# counterpart in C.  Each such error becomes an ElementError that names element and method.

#: Expression nodes, apart from functions, that the IR has operations for.
_NODES = (
    sp.Add, sp.Mul, sp.Pow, sp.Min, sp.Max, sp.Piecewise, ExprCondPair, sp.Symbol, sp.Rational,
    sp.Float, Boolean,
)  # fmt: skip


def matrix(
    where: str, what: str, method: Callable[..., Any], shape: tuple[int, int], *arguments: Any
) -> sp.Matrix:
    """`method(*arguments)` as a matrix of this shape.  Raises ElementError."""
    if 0 in shape:
        return sp.zeros(*shape)
    found = as_matrix(where, what, _call_method(where, what, method, *arguments))
    if found.shape != shape:
        raise ElementError(
            f"{where}: {what} must be {shape[0]} x {shape[1]}, found {found.rows} x {found.cols}"
        )
    return found


def as_matrix(where: str, what: str, value: Any) -> sp.Matrix:
    """A SymPy matrix, a nested list or a numpy array as a matrix of real expressions."""
    if value is None:
        raise ElementError(f"{where}: {what} returns nothing; is there a `return`?")
    try:
        if isinstance(value, (str, bytes)) or not hasattr(value, "__len__"):
            raise TypeError
        found = sp.Matrix(value)
    except Exception:
        raise ElementError(
            f"{where}: {what} must be a matrix (sympy.Matrix or a list), found {_short_text(value)}"
        ) from None
    for entry in found:
        _reject_unknown(where, what, entry)
    return found


def scalar(where: str, what: str, method: Callable[..., Any], *arguments: Any) -> sp.Expr:
    """`method(*arguments)` as one expression.  Raises ElementError."""
    value = _call_method(where, what, method, *arguments)
    if value is None:
        raise ElementError(f"{where}: {what} returns nothing; is there a `return`?")
    try:
        found = sp.sympify(value, strict=True)
    except Exception:
        found = None
    if not isinstance(found, sp.Expr) or getattr(found, "is_Matrix", False):
        raise ElementError(f"{where}: {what} must be one expression, found {_short_text(value)}")
    _reject_unknown(where, what, found)
    return found


def optional(
    where: str, what: str, method: Callable[..., Any], *arguments: Any
) -> sp.Matrix | None:
    """A matrix of any shape, or None if the definition leaves it to the derivation."""
    value = _call_method(where, what, method, *arguments)
    return None if value is None else as_matrix(where, what, value)


def pair(
    where: str, what: str, method: Callable[..., Any], *arguments: Any
) -> tuple[sp.Matrix, sp.Matrix]:
    """Two 3 x 1 matrices, force and moment, returned by `method(*arguments)`."""
    value = _call_method(where, what, method, *arguments)
    if not isinstance(value, (tuple, list)) or len(value) != 2:
        raise ElementError(
            f"{where}: {what} must return two 3 x 1 matrices, force and moment, "
            f"found {_short_text(value)}"
        )
    force = as_matrix(where, f"the force of {what}", value[0])
    moment = as_matrix(where, f"the moment of {what}", value[1])
    if force.shape != (3, 1) or moment.shape != (3, 1):
        raise ElementError(
            f"{where}: {what} must return two 3 x 1 matrices, force and moment, found "
            f"{force.rows} x {force.cols} and {moment.rows} x {moment.cols}"
        )
    return force, moment


def _call_method(where: str, what: str, method: Callable[..., Any], *arguments: Any) -> Any:
    try:
        return method(*arguments)
    except MstmmError:
        raise
    except NotImplementedError:
        raise ElementError(f"{where}: {what} is missing; the definition must define it") from None
    except Exception as error:
        hint = ""
        if "convert expression to float" in str(error) or "loop of ufunc" in str(error):
            hint = "; take functions from sympy (sympy.sin), not from math or numpy"
        cause = f"{type(error).__name__}: {error}".rstrip(": ")
        raise ElementError(f"{where}: {what} failed with {cause}{hint}") from error


def _short_text(value: Any) -> str:
    """Representation of a value on one line of at most 80 characters, for messages."""
    return f"{' '.join(repr(value).split()):.80}"


def _reject_unknown(where: str, what: str, entry: Any) -> None:
    """Reject parts of an expression that are not real and finite, or unknown to the IR."""
    for node in sp.preorder_traversal(entry):
        if node.has(sp.nan, sp.zoo, sp.oo, -sp.oo) and not node.args:
            raise ElementError(f"{where}: {what} must be finite, found {node}")
        if node is sp.I:
            raise ElementError(f"{where}: {what} must be real, found the imaginary unit")
        if isinstance(node, sp.Piecewise) and node.args[-1][1] != sp.true:
            raise ElementError(
                f"{where}: {what} contains a Piecewise without a last case; add (value, True)"
            )
        if node is sp.pi or isinstance(node, (*_NODES, *FUNCTIONS)):
            continue
        names = ", ".join(sorted(str(f.__name__).lower() for f in FUNCTIONS))
        name = getattr(type(node), "__name__", str(node))
        raise ElementError(
            f"{where}: {what} contains the unknown function {name}; expected one of {names}, "
            "sqrt, powers, Min, Max, Piecewise"
        )


FUNCTIONS: dict[type, str] = {
    getattr(sp, row.sympy): row.name for row in OPERATIONS.values() if row.sympy
}
