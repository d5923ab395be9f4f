"""Lowering of the definitions of a Derivation to a KernelIR."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from itertools import accumulate

import sympy as sp
from sympy.matrices.expressions.slice import MatrixSlice

from mstmm.ir import LOOPS, KernelIR, Port
from mstmm.ir.graph import Node
from mstmm.ir.unrolled_solve import SINGULAR, NodeMatrix

from ..definition.derivation import Derivation, Equation, Quantity, Solve
from .fixed_size import Lowering, port

# --- run-time size --------------------------------------------------------------------------------
# An entry is requested by its two indices, integers or loop letters.  A product over the run-time
# size is a sum over the letter that its entry does not use, so an entry of an n x n matrix cannot
# be such a product.  Chains of products are evaluated in the order with fewest multiplications.
#
# Definitions that are outputs are stored, loop by loop, and read from memory afterwards; so
# outputs serve as workspace.  A definition that is no output, or that accumulates, is expanded
# wherever it is used: inside every loop that reads it.  Matrices are stored full, symmetric or
# not.

Index = int | str
Entries = Callable[[Index, Index], Node]

#: Assumed run-time size when the order of a chain of products is chosen.
_LIKELY_SIZE = 5


class SizedLowering(Lowering):
    """Lowering with some matrices of run-time size; the others as in `Lowering`."""

    def __init__(self, derivation: Derivation, size: sp.Symbol) -> None:
        super().__init__(derivation)
        self.size = size
        self.outputs = {q.name: q for q in derivation.outputs}
        self.ports: dict[str, Port] = {q.name: port(q) for q in derivation.inputs}
        self.entries: dict[str, Entries] = {
            q.name: self._memory_entries(self.ports[q.name])
            for q in derivation.inputs
            if q.has_runtime_size
        }
        self._entry_nodes: dict[tuple[sp.Basic, Index, Index], Node] = {}
        self._matrices: dict[sp.Basic, NodeMatrix] = {}
        self._is_fixed_cache: dict[sp.Basic, bool] = {}

    # --- definitions ----------------------------------------------------------------------------

    def define(self, equation: Equation) -> None:
        left = equation.left
        if all(map(_is_integer, left.shape)):
            super().define(equation)
            return
        name, right = str(left.name), equation.computed or equation.right
        if equation.zeros:
            raise NotImplementedError(f"{name}: zeros are declared for fixed sizes only")
        if left.shape != right.shape:
            raise ValueError(f"{name} is {left.shape}, its definition {right.shape}")
        output = self.outputs.get(name)
        if isinstance(right, Solve):
            self._define_solution(name, output, right)
            return
        entries: Entries = lambda i, j: self.entry(right, i, j)  # noqa: E731
        self.entries[name] = entries
        if output is None:
            return
        stored = port(output)
        self.graph.store(stored, _values(stored, entries))
        if not stored.accumulate:
            self._remember(stored)

    def _remember(self, stored: Port) -> None:
        self.ports[stored.name] = stored
        self.entries[stored.name] = self._memory_entries(stored)

    def _memory_entries(self, stored: Port) -> Entries:
        if len(stored.shape) == 1:
            return lambda i, j: self.graph.element(stored.name, i)
        return lambda i, j: self.graph.element(stored.name, i, j)

    def _define_solution(self, name: str, output: Quantity | None, solve: Solve) -> None:
        if output is None or output.accumulate:
            raise NotImplementedError(
                f"{name}: a run-time sized Solve defines an output that does not accumulate"
            )
        arrays = []
        for role, array in (("matrix", solve.matrix), ("right-hand side", solve.right)):
            if not isinstance(array, sp.MatrixSymbol) or str(array.name) not in self.ports:
                raise NotImplementedError(
                    f"{name}: the {role} of a run-time sized Solve must be an input, or an output "
                    f"that is defined before and does not accumulate, not {array}"
                )
            arrays.append(str(array.name))
        matrix, right = arrays
        message = f"a pivot of {matrix} vanishes: a motion is undetermined"
        if solve.symmetric:
            message = f"a pivot of {matrix} vanishes: a motion of the modes is undetermined"
        self.graph.solve(name, matrix, right, SINGULAR, message, solve.symmetric)
        self._remember(port(output))

    # --- matrices of fixed shape ----------------------------------------------------------------

    def matrix(self, expression: sp.Basic) -> NodeMatrix:
        if not getattr(expression, "is_Matrix", False) or self._is_fixed(expression):
            return super().matrix(expression)
        nodes = self._matrices.get(expression)
        if nodes is None:
            rows, columns = expression.shape
            if not (_is_integer(rows) and _is_integer(columns)):
                raise NotImplementedError(f"{expression}: expected a fixed size, found {self.size}")
            nodes = [
                [self.entry(expression, i, j) for j in range(int(columns))]
                for i in range(int(rows))
            ]
            self._matrices[expression] = nodes
        return [list(row) for row in nodes]

    def _is_fixed(self, expression: sp.Basic) -> bool:
        """Whether no part of an expression has the run-time size."""
        is_fixed = self._is_fixed_cache.get(expression)
        if is_fixed is None:
            is_fixed = self._is_fixed_cache[expression] = self.size not in expression.atoms(
                sp.Symbol
            )
        return is_fixed

    def _scalar(self, e: sp.Basic) -> Node:
        if isinstance(e, sp.Sum):
            raise NotImplementedError(
                f"{e}: define a product over {self.size} as a separate matrix, not by its entries"
            )
        return super()._scalar(e)

    def _entry(self, e: sp.Basic) -> Node:
        if self._is_fixed(e.parent):
            return super()._entry(e)
        if not all(map(_is_integer, e.parent.shape)):
            raise NotImplementedError(f"{e}: expected no single entry along {self.size}")
        return self.entry(e.parent, int(e.i), int(e.j))

    # --- entries --------------------------------------------------------------------------------

    def entry(self, expression: sp.Basic, i: Index, j: Index) -> Node:
        """One entry; letters denote any index below the run-time size."""
        key = (expression, i, j)
        node = self._entry_nodes.get(key)
        if node is None:
            node = self._entry_of(expression, i, j)
            if not isinstance(expression, sp.MatrixSymbol):
                self._entry_nodes[key] = node
        return node

    def _entry_of(self, e: sp.Basic, i: Index, j: Index) -> Node:
        if isinstance(e, sp.MatrixSymbol) and str(e.name) in self.entries:
            return self.entries[str(e.name)](i, j)
        if isinstance(e, sp.ZeroMatrix):
            return self.graph.constant(0)
        if isinstance(i, int) and isinstance(j, int) and self._is_fixed(e):
            return self._fixed_matrix(e)[i][j]
        if isinstance(e, sp.MatrixBase):
            return self.scalar(e[i, j])
        if isinstance(e, sp.MatAdd):
            first, *rest = [self.entry(term, i, j) for term in e.args]
            for term in rest:
                first = first + term
            return first
        if isinstance(e, sp.MatMul):
            return self._product_entry(e, i, j)
        if isinstance(e, sp.Transpose):
            return self.entry(e.arg, j, i)
        if isinstance(e, sp.BlockMatrix):
            return self._block_entry(e, i, j)
        if isinstance(e, MatrixSlice):
            return self.entry(e.parent, _parent_index(e.rowslice, i), _parent_index(e.colslice, j))
        raise NotImplementedError(f"cannot lower {e} ({type(e).__name__}) with a run-time size")

    def _fixed_matrix(self, e: sp.Basic) -> NodeMatrix:
        nodes = self._matrices.get(e)
        if nodes is None:
            nodes = self._matrices[e] = super().matrix(e)
        return nodes

    def _product_entry(self, e: sp.MatMul, i: Index, j: Index) -> Node:
        factor, matrices = e.as_coeff_matrices()
        extents = [matrices[0].rows, *(m.cols for m in matrices)]
        split = _splits(tuple(int(x) if _is_integer(x) else _LIKELY_SIZE for x in extents))

        def part(first: int, last: int, i: Index, j: Index) -> Node:
            if first == last:
                return self.entry(matrices[first], i, j)
            key = (sp.MatMul(*matrices[first : last + 1], evaluate=False), i, j)
            node = self._entry_nodes.get(key)
            if node is None:
                middle = split[first, last]
                node = self._inner_sum(
                    e, extents[middle + 1], i, j,
                    lambda s: part(first, middle, i, s) * part(middle + 1, last, s, j),
                )  # fmt: skip
                self._entry_nodes[key] = node
            return node

        return self.scalar(factor) * part(0, len(matrices) - 1, i, j)

    def _inner_sum(
        self, e: sp.Basic, extent: sp.Expr, i: Index, j: Index, term: Callable[[Index], Node]
    ) -> Node:
        """Sum of `term` over the inner extent of a product."""
        if _is_integer(extent):
            total = self.graph.constant(0)
            for s in range(int(extent)):
                total = total + term(s)
            return total
        free = [letter for letter in LOOPS if letter not in (i, j)]
        if not free:
            raise NotImplementedError(
                f"{e}: every entry of an {self.size} x {self.size} matrix is a sum over "
                f"{self.size} (three loops); make the product a vector or a fixed number of rows"
            )
        return self.graph.sum_over_modes(term(free[0]), free[0])

    def _block_entry(self, e: sp.BlockMatrix, i: Index, j: Index) -> Node:
        blocks = e.blocks
        heights = [blocks[r, 0].rows for r in range(blocks.rows)]
        widths = [blocks[0, c].cols for c in range(blocks.cols)]
        row, i = self._block_position(e, heights, i)
        column, j = self._block_position(e, widths, j)
        return self.entry(blocks[row, column], i, j)

    def _block_position(self, e: sp.Basic, extents: list[sp.Expr], i: Index) -> tuple[int, Index]:
        """Block that contains an index, and the index within it."""
        if len(extents) == 1:
            return 0, i
        if not all(map(_is_integer, extents)):
            raise NotImplementedError(
                f"{e}: a run-time size cannot share an axis with other blocks"
            )
        assert isinstance(i, int)
        ends = list(accumulate(int(extent) for extent in extents))
        block = next(b for b, end in enumerate(ends) if i < end)
        return block, i - ends[block] + int(extents[block])


def _values(stored: Port, entries: Entries) -> object:
    """Argument of `Graph.store`: one value along a run-time size, a list along a fixed one."""
    letters = iter(LOOPS)
    axes: list[list[Index]] = [
        [next(letters)] if isinstance(extent, str) else list(range(extent))
        for extent in stored.shape
    ]
    rows, columns = axes if len(axes) == 2 else (axes[0], [0])
    rows_of_values: list[object] = []
    for i in rows:
        row: list[object] = [entries(i, j) for j in columns]
        alone = len(axes) == 1 or isinstance(stored.shape[1], str)
        rows_of_values.append(row[0] if alone else row)
    return rows_of_values[0] if isinstance(stored.shape[0], str) else rows_of_values


def _parent_index(piece: tuple[sp.Expr, sp.Expr, sp.Expr], i: Index) -> Index:
    """Index in the whole matrix of index `i` of a slice (start, stop, step)."""
    if isinstance(i, int):
        return int(piece[0]) + int(piece[2]) * i
    if piece[0] != 0 or piece[2] != 1:
        raise NotImplementedError(f"part {piece} of a run-time size")
    return i


def _is_integer(extent: object) -> bool:
    """Whether an extent is an integer, of SymPy or of Python."""
    return bool(sp.sympify(extent).is_Integer)


@cache
def _splits(extents: tuple[int, ...]) -> dict[tuple[int, int], int]:
    """Best split of every part of a chain of products: fewest multiplications."""
    count = len(extents) - 1
    cost: dict[tuple[int, int], int] = {(i, i): 0 for i in range(count)}
    split: dict[tuple[int, int], int] = {}
    for length in range(1, count):
        for first in range(count - length):
            last = first + length
            cost[first, last], split[first, last] = min(
                (
                    cost[first, middle]
                    + cost[middle + 1, last]
                    + extents[first] * extents[middle + 1] * extents[last + 1],
                    middle,
                )
                for middle in range(first, last)
            )
    return split


# --- definitions ----------------------------------------------------------------------------------


def lower(
    derivation: Derivation, name: str, guards: tuple[tuple[sp.Basic, int, str], ...] = ()
) -> KernelIR:
    """KernelIR of the derivation's definitions.

    `guards` are (condition, failure code, message) over the derivation's quantities.
    Quantities with a run-time size are lowered as in `variable_size`.
    Raises NotImplementedError, naming the expression, for SymPy that has no counterpart in the IR.
    """
    size = derivation.size
    lowering = Lowering(derivation) if size is None else SizedLowering(derivation, size)
    for equation in derivation.definitions:
        lowering.define(equation)
    for condition, code, message in guards:
        lowering.graph.guard(lowering.scalar(condition), code, message)
    values: dict[str, object] = {
        q.name: lowering.stored_entries(q) for q in derivation.outputs if not q.has_runtime_size
    }
    return lowering.graph.kernel(
        name,
        [port(q) for q in derivation.inputs],
        [port(q) for q in derivation.outputs],
        values,
        size_symbol=None if size is None else str(size),
        purpose=derivation.title,
        sources=derivation.sources,
    )
