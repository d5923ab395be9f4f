"""Kernels evaluated with numpy for many points at once: for results, not for the integration.

Every value has two last axes after those of the points, one for each loop of a kernel whose size is
given at run time; outside the loops they have length 1.  A loop is then one array operation.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure
from mstmm.ir import (
    LOOP_INDEX,
    LOOPS,
    OPERATIONS,
    Assign,
    Constant,
    Element,
    Guard,
    KernelIR,
    Port,
    Solve,
    Store,
    Sum,
)
from mstmm.ir.interpreter import Interpreter
from mstmm.ir.operations import Operation


def evaluate(kernel: KernelIR, inputs: Mapping[str, ArrayLike], n: int = 0) -> dict[str, Array]:
    """Evaluate the outputs of a kernel in doubles, for any number of points at once.

    `inputs[port]` has the port's shape after any number of leading axes, which are broadcast
    against those of the other inputs and precede every output; `n` is the run-time size of a kernel
    that has one.  An output that accumulates contains the increment; entries never stored are 0.
    Raises NumericalFailure if a guard or a pivot fails at any point, ValueError for a missing
    input or one that does not end in its port's shape.
    """
    with np.errstate(all="ignore"):
        return _ArrayEvaluation(kernel, inputs, n).run()


class _ArrayEvaluation(Interpreter):
    """Evaluation of a kernel with an array axis for every loop."""

    def __init__(self, kernel: KernelIR, inputs: Mapping[str, ArrayLike], n: int) -> None:
        super().__init__(kernel, _OPERATIONS, n)
        input_arrays = {port.name: self._input_values(port, inputs) for port in kernel.inputs}
        lead_shapes = [
            a.shape[: a.ndim - len(self.ports[name].shape)] for name, a in input_arrays.items()
        ]
        lead_shape = np.broadcast_shapes(*lead_shapes)
        self.results: dict[str, Array] = {
            port.name: np.zeros((*lead_shape, *self._shape(port))) for port in kernel.outputs
        }
        #: Arrays that statements read: inputs, and complete outputs.
        self.arrays = input_arrays | self.results

    def _shape(self, port: Port) -> tuple[int, ...]:
        return tuple(self.n if isinstance(extent, str) else extent for extent in port.shape)

    def _input_values(self, port: Port, inputs: Mapping[str, ArrayLike]) -> Array:
        if port.name not in inputs:
            raise ValueError(f"{self.kernel.name}: no value for the input {port.name!r}")
        array, shape = np.asarray(inputs[port.name], dtype=float), self._shape(port)
        if array.shape[array.ndim - len(shape) :] != shape:
            raise ValueError(
                f"{self.kernel.name}: {port.name} ends in the shape {shape}, not {array.shape}"
            )
        return array

    # --- statements -----------------------------------------------------------------------------

    def guard(self, guard: Guard) -> None:
        if not np.all(_is_true(self.value(guard.condition))):
            raise NumericalFailure(f"{self.kernel.name}: {guard.message}")

    def total(self, statement: Sum) -> Array:
        axis = LOOPS.index(statement.over) - 2
        product = self._product(statement, axis)
        if product is not None:
            return product
        value: Array = self.inside(statement)
        # A value that is equal for all indices has length 1 there.
        is_common = value.shape[axis] == 1
        return np.asarray(value * self.n if is_common else value.sum(axis=axis, keepdims=True))

    def _product(self, statement: Sum, axis: int) -> Array | None:
        """Sum as a matrix product if it is a vector per point times a common matrix, else None."""
        (assignment, *further_statements) = statement.body
        if further_statements or not isinstance(assignment, Assign) or assignment.op != "mul":
            return None
        values = (np.moveaxis(self.value(operand), axis, -1) for operand in assignment.args)
        matrix, vector = sorted(values, key=lambda a: a.ndim)
        if matrix.ndim > 2 or vector.shape[-2:] != (1, self.n) or matrix.shape != (self.n, self.n):
            return None
        return np.asarray(np.expand_dims(vector[..., 0, :] @ matrix.T, axis))

    def constant(self, constant: Constant) -> Array:
        return _constant(constant.text)

    def entry(self, element: Element) -> Array:
        letters = [entry for entry in element.index if isinstance(entry, str)]
        entry: Array = self.arrays[element.port][_slices(element.index)]
        if len(letters) == 2 and letters[0] == letters[1]:
            entry = np.diagonal(entry, axis1=-2, axis2=-1)
            letters = letters[:1]
        if len(letters) == 2:
            return entry if letters[0] == LOOP_INDEX else np.swapaxes(entry, -1, -2)
        if not letters:
            return np.asarray(entry)[..., None, None]
        return entry[..., :, None] if letters[0] == LOOP_INDEX else entry[..., None, :]

    def store(self, store: Store) -> None:
        value = self.inside(store)
        letters = [entry for entry in store.index if isinstance(entry, str)]
        if len(letters) == 2:
            value = value if letters[0] == LOOP_INDEX else np.swapaxes(value, -1, -2)
        else:
            value = value[..., 0, :] if letters and letters[0] != LOOP_INDEX else value[..., 0]
            value = value if letters else value[..., 0]
        place = _slices(store.index)
        if self.ports[store.port].accumulate:
            self.results[store.port][place] += value
        else:
            self.results[store.port][place] = value

    def solve(self, solve: Solve) -> None:
        if solve.symmetric:
            self._solve_by_ldl(solve)
        else:
            self._solve_by_lu(solve)

    def _solve_by_lu(self, solve: Solve) -> None:
        """Solve by LU with row exchange, per point in LAPACK; fails only for a zero pivot."""
        a, b = self.arrays[solve.matrix], self.arrays[solve.right]
        is_vector = len(self.ports[solve.port].shape) == 1
        try:
            solution = np.linalg.solve(a, b[..., None] if is_vector else b)
        except np.linalg.LinAlgError:
            raise NumericalFailure(f"{self.kernel.name}: {solve.message}") from None
        self.results[solve.port][...] = solution[..., 0] if is_vector else solution

    def _solve_by_ldl(self, solve: Solve) -> None:
        """Solve by L D L^T without pivoting from the lower triangle, for all points at once."""
        a = self.arrays[solve.matrix]
        a = np.tril(a) + np.swapaxes(np.tril(a, -1), -1, -2)
        remainder, lower = a.copy(), np.zeros_like(a)
        columns = self.results[solve.port]
        columns[...] = self.arrays[solve.right]
        if len(self.ports[solve.port].shape) == 1:
            columns = columns[..., None]
        for i in range(self.n):
            pivot, diagonal = remainder[..., i, i], a[..., i, i]
            if not np.all(pivot > solve.relative_pivot * np.abs(diagonal)):
                raise NumericalFailure(f"{self.kernel.name}: {solve.message}")
            rows_below = slice(i + 1, None)
            lower[..., rows_below, i] = remainder[..., rows_below, i] / pivot[..., None]
            factors = lower[..., rows_below, i, None]
            remainder[..., rows_below, rows_below] -= factors * remainder[..., None, i, rows_below]
            columns[..., rows_below, :] -= factors * columns[..., None, i, :]
        columns /= np.diagonal(remainder, axis1=-2, axis2=-1)[..., None]
        for i in reversed(range(self.n)):
            rows_above = lower[..., i, :i, None]
            columns[..., :i, :] -= rows_above * columns[..., None, i, :]


@lru_cache(maxsize=1024)
def _constant(text: str) -> Array:
    return np.full((1, 1), Constant(text).number)


def _slices(index: tuple[int | str, ...]) -> tuple[Any, ...]:
    return (..., *(slice(None) if isinstance(entry, str) else entry for entry in index))


def _is_true(value: Array) -> NDArray[np.bool_]:
    """Mask of the values that are neither zero nor nan."""
    return np.abs(value) > 0


def _array_function(row: Operation) -> Callable[..., Array]:
    """Array function of an operation; unlike in numpy, nan is false and results are floats."""
    function, condition_count = getattr(np, row.numpy), row.conditions

    def call(*args: Array) -> Array:
        value = function(*map(_is_true, args[:condition_count]), *args[condition_count:])
        return np.asarray(value, dtype=float)

    return call if condition_count or row.truth else function


_OPERATIONS = {row.name: _array_function(row) for row in OPERATIONS.values()}
