"""Lowering of matrices of fixed size: products entry by entry, no inverse.

Value numbering merges symmetric halves and repeated products into one node; nodes that no output
needs are not emitted.  Zeros and ones of explicit matrices fold, so sparsity is kept.
"""

from __future__ import annotations

from collections.abc import Callable

import sympy as sp
from sympy.logic.boolalg import BooleanFalse, BooleanTrue

from mstmm.ir import Port
from mstmm.ir.graph import Graph, Node
from mstmm.ir.unrolled_solve import (
    NodeMatrix,
    back_substitute,
    factor_ldl,
    forward_substitute,
    givens_triangle,
    solve_pivoted,
    solve_symmetric,
)

from ..definition.derivation import (
    FUNCTIONS,
    Derivation,
    Equation,
    Factor,
    Quantity,
    Solve,
    Triangle,
    Triangular,
)


def port(quantity: Quantity) -> Port:
    """Storage of a quantity: upper triangle, vector or row-major matrix."""
    rows, columns = quantity.shape
    shape: tuple[int | str, ...] = (rows, columns)
    if quantity.symmetric and isinstance(rows, int):
        shape = (rows * (rows + 1) // 2,)
    elif columns == 1:
        shape = (rows,)
    return Port(
        quantity.name, shape, quantity.unit, quantity.meaning, accumulate=quantity.accumulate
    )


class Lowering:
    """Evaluates SymPy matrix expressions over graph nodes."""

    def __init__(self, derivation: Derivation) -> None:
        self.graph = Graph()
        self.values: dict[str, NodeMatrix] = {
            q.name: self._input(q) for q in derivation.inputs if not q.has_runtime_size
        }
        self._scalars: dict[sp.Basic, Node] = {}

    def _input(self, quantity: Quantity) -> NodeMatrix:
        name, rows, columns = quantity.name, quantity.rows, quantity.columns
        if quantity.symmetric:
            return _full_symmetric(self.graph.vector(name, rows * (rows + 1) // 2), rows)
        if columns == 1:
            return [[node] for node in self.graph.vector(name, rows)]
        return self.graph.matrix(name, rows, columns)

    def define(self, equation: Equation) -> None:
        value = self.matrix(equation.right if equation.computed is None else equation.computed)
        for i, j in equation.zeros:
            value[i][j] = self.graph.constant(0)
        if equation.symmetric:
            for i, row in enumerate(value):
                row[:i] = [value[j][i] for j in range(i)]
        self.values[str(equation.left.name)] = value

    def stored_entries(self, quantity: Quantity) -> list[object]:
        if quantity.rows * quantity.columns == 0:  # A hinge without speeds has empty gains.
            return [] if quantity.columns == 1 else [[] for _ in range(quantity.rows)]
        value = self.values[quantity.name]
        if quantity.symmetric:
            return [value[i][j] for i in range(quantity.rows) for j in range(i, quantity.rows)]
        if quantity.columns == 1:
            return [row[0] for row in value]
        return list(value)

    # --- matrices -------------------------------------------------------------------------

    def matrix(self, expression: sp.Basic) -> NodeMatrix:
        rules: tuple[tuple[type, Callable[[sp.Basic], NodeMatrix]], ...] = (
            (sp.MatrixSymbol, self._symbol),
            (sp.MatrixBase, self._explicit),
            (sp.MatAdd, self._sum),
            (sp.MatMul, self._product),
            (sp.Transpose, lambda e: _transpose(self.matrix(e.arg))),
            (sp.BlockMatrix, self._blocks),
            (sp.matrices.expressions.slice.MatrixSlice, self._slice),
            (sp.Identity, lambda e: self._explicit(sp.eye(int(e.rows)))),
            (sp.ZeroMatrix, lambda e: self._explicit(sp.zeros(int(e.rows), int(e.cols)))),
            (Solve, self._solve),
            (Factor, self._factor),
            (Triangular, self._triangular),
            (Triangle, lambda e: givens_triangle(self.graph, self.matrix(e.matrix), e.count)),
        )
        for kind, rule in rules:
            if isinstance(expression, kind):
                return rule(expression)
        if isinstance(expression, sp.Expr) and not getattr(expression, "is_Matrix", False):
            return [[self.scalar(expression)]]
        raise NotImplementedError(f"cannot lower the matrix expression {expression}")

    def _symbol(self, symbol: sp.MatrixSymbol) -> NodeMatrix:
        return [list(row) for row in self.values[str(symbol.name)]]

    def _explicit(self, matrix: sp.MatrixBase) -> NodeMatrix:
        return [[self.scalar(e) for e in matrix.row(i)] for i in range(matrix.rows)]

    def _sum(self, expression: sp.MatAdd) -> NodeMatrix:
        first, *rest = [self.matrix(term) for term in expression.args]
        for term in rest:
            first = [
                [a + b for a, b in zip(x, y, strict=True)] for x, y in zip(first, term, strict=True)
            ]
        return first

    def _product(self, expression: sp.MatMul) -> NodeMatrix:
        factor, *rest = expression.as_coeff_matrices()
        result: NodeMatrix | None = None
        for term in rest[0]:
            value = self.matrix(term)
            result = value if result is None else self._multiply(result, value)
        assert result is not None
        coefficient = self.scalar(factor)
        return [[coefficient * e for e in row] for row in result]

    def _multiply(self, a: NodeMatrix, b: NodeMatrix) -> NodeMatrix:
        zero = self.graph.constant(0)
        product = []
        for row in a:
            entries = []
            for column in zip(*b, strict=True):
                total = zero
                for x, y in zip(row, column, strict=True):
                    total = total + x * y
                entries.append(total)
            product.append(entries)
        return product

    def _blocks(self, expression: sp.BlockMatrix) -> NodeMatrix:
        rows: NodeMatrix = []
        blocks = expression.blocks
        for i in range(blocks.rows):
            parts = [self.matrix(blocks[i, j]) for j in range(blocks.cols)]
            rows += [sum(pieces, []) for pieces in zip(*parts, strict=True)]
        return rows

    def _slice(self, expression: sp.Basic) -> NodeMatrix:
        rows, columns = expression.rowslice, expression.colslice
        whole = self.matrix(expression.parent)
        return [[whole[i][j] for j in range(*map(int, columns))] for i in range(*map(int, rows))]

    def _solve(self, expression: Solve) -> NodeMatrix:
        matrix, right = self.matrix(expression.matrix), self.matrix(expression.right)
        if not matrix:
            return []
        solve = solve_symmetric if expression.symmetric else solve_pivoted
        return solve(self.graph, matrix, right)

    def _factor(self, expression: Factor) -> NodeMatrix:
        lower, reciprocal = factor_ldl(self.graph, self.matrix(expression.matrix))
        zero = self.graph.constant(0)
        return [
            [*row, entry, *[zero] * (len(reciprocal) - i - 1)]
            for i, (row, entry) in enumerate(zip(lower, reciprocal, strict=True))
        ]

    def _triangular(self, expression: Triangular) -> NodeMatrix:
        factor, right = self.matrix(expression.factor), self.matrix(expression.right)
        substitute = back_substitute if expression.is_transposed else forward_substitute
        return _transpose([substitute(factor, list(c)) for c in zip(*right, strict=True)])

    # --- scalars --------------------------------------------------------------------------

    def scalar(self, expression: sp.Basic) -> Node:
        node = self._scalars.get(expression)
        if node is None:
            node = self._scalar(expression)
            self._scalars[expression] = node
        return node

    def _scalar(self, e: sp.Basic) -> Node:
        graph = self.graph
        if isinstance(e, sp.matrices.expressions.matexpr.MatrixElement):
            return self._entry(e)
        if isinstance(e, (sp.Rational, sp.Float)):
            return graph.constant(_fraction(e))
        if e is sp.pi:
            return graph.pi
        if isinstance(e, (BooleanTrue, BooleanFalse)):
            return graph.constant(int(bool(e)))
        if isinstance(e, sp.Pow):
            return graph.power(self.scalar(e.base), self.scalar(e.exp))
        if isinstance(e, sp.Piecewise):
            return self._piecewise(e)
        if isinstance(e, (sp.Add, sp.Mul, sp.Min, sp.Max, sp.And, sp.Or)):
            return self._fold(e)
        if isinstance(e, sp.core.relational.Relational):
            return self._relation(e)
        if isinstance(e, sp.Not):
            return graph.call("not", self.scalar(e.args[0]))
        if type(e) in FUNCTIONS:
            return graph.call(FUNCTIONS[type(e)], *(self.scalar(a) for a in e.args))
        raise NotImplementedError(f"cannot lower {e} ({type(e).__name__})")

    def _entry(self, e: sp.Basic) -> Node:
        parent = e.parent
        if isinstance(parent, sp.MatrixSymbol):
            return self.values[str(parent.name)][int(e.i)][int(e.j)]
        return self.matrix(parent)[int(e.i)][int(e.j)]

    def _fold(self, e: sp.Basic) -> Node:
        op = {sp.Add: "add", sp.Mul: "mul", sp.Min: "min", sp.Max: "max"}.get(type(e))
        if op is None:
            op = "and" if isinstance(e, sp.And) else "or"
        if op == "mul":
            return self._product_with_reciprocal(e)
        shared = _shared_factor(e) if op == "add" else sp.Integer(1)
        if shared != 1:
            rest = sp.Add(*(a / shared for a in e.args))
            return self.graph.constant(_fraction(shared)) * self.scalar(rest)
        first, *rest = [self.scalar(a) for a in sorted(e.args, key=sp.default_sort_key)]
        for node in rest:
            first = self.graph.call(op, first, node)
        return first

    def _product_with_reciprocal(self, e: sp.Mul) -> Node:
        """Product with the reciprocal of the denominator, so that it can be shared."""
        above, below = sp.fraction(e, exact=True)
        number, above = above.as_coeff_Mul()
        result = self.graph.constant(1)
        for factor in sorted(sp.Mul.make_args(above), key=sp.default_sort_key):
            result = result * self.scalar(factor)
        factor = self.graph.constant(_fraction(number))
        if below == 1:
            return factor * result
        return (factor * (1 / self.scalar(below))) * result

    def _piecewise(self, e: sp.Piecewise) -> Node:
        *cases, (value, condition) = e.args
        if condition not in (True, sp.true):
            raise NotImplementedError(f"a Piecewise without a last 'otherwise' branch: {e}")
        result = self.scalar(value)
        for value, condition in reversed(cases):
            result = self.graph.select(self.scalar(condition), self.scalar(value), result)
        return result

    def _relation(self, e: sp.core.relational.Relational) -> Node:
        left, right = self.scalar(e.lhs), self.scalar(e.rhs)
        call = self.graph.call
        return {
            "<": lambda: call("lt", left, right),
            "<=": lambda: call("le", left, right),
            ">": lambda: call("lt", right, left),
            ">=": lambda: call("le", right, left),
            "==": lambda: call("eq", left, right),
            "!=": lambda: call("not", call("eq", left, right)),
        }[e.rel_op]()


def _shared_factor(total: sp.Add) -> sp.Rational:
    """Common factor of all terms of a sum (up to sign), which SymPy distributes."""
    factors = {abs(term.as_coeff_Mul()[0]) for term in total.args}
    factor = factors.pop()
    return factor if not factors and isinstance(factor, sp.Rational) else sp.Integer(1)


def _fraction(number: sp.Number) -> float:
    from fractions import Fraction

    if isinstance(number, sp.Rational):
        return Fraction(int(number.p), int(number.q))  # type: ignore[return-value]
    return float(number)


def _transpose(a: NodeMatrix) -> NodeMatrix:
    return [list(column) for column in zip(*a, strict=True)]


def _full_symmetric(upper: list[Node], n: int) -> NodeMatrix:
    """Full symmetric matrix from its upper triangle, row by row."""
    full: NodeMatrix = [[upper[0]] * n for _ in range(n)]
    entries = iter(upper)
    for i in range(n):
        for j in range(i, n):
            full[i][j] = full[j][i] = next(entries)
    return full
