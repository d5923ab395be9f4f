"""Kernels evaluated with numpy over many points at once: for results, not for the integration.

Every value carries two axes behind those of the points, one for each loop of a run-time sized
kernel; outside the loops they have the length 1.  So a loop is one array operation.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mstmm.arrays import Array
from mstmm.errors import NumericalFailure
from mstmm.ir import (
    LOOP_INDEX,
    LOOPS,
    Assign,
    Constant,
    Guard,
    Inner,
    KernelIR,
    Operand,
    Port,
    Solve,
    Store,
    Sum,
    Temporary,
)


def evaluate(kernel: KernelIR, inputs: Mapping[str, ArrayLike], n: int = 0) -> dict[str, Array]:
    """Outputs of a kernel in doubles, for any number of points at once.

    `inputs[port]` has the port's shape behind any number of leading axes, which are broadcast
    against those of the other inputs and lead every output; `n` is the run-time size of a kernel
    that has one.  An output that accumulates holds the increment; what is never stored is 0.
    Raises NumericalFailure where a guard or a pivot fails at any point, ValueError for a missing
    input or one that does not end in its port's shape.
    """
    run = _Run(kernel, inputs, n)
    with np.errstate(all="ignore"):
        for statement in kernel.statements:
            run.statement(statement)
    return run.outputs


class _Run:
    """One evaluation."""

    def __init__(self, kernel: KernelIR, inputs: Mapping[str, ArrayLike], n: int) -> None:
        self.kernel, self.n = kernel, n
        self.ports = {port.name: port for port in (*kernel.inputs, *kernel.outputs)}
        self.temporaries: dict[int, Array] = {}
        given = {port.name: self._given(port, inputs) for port in kernel.inputs}
        leads = [a.shape[: a.ndim - len(self.ports[name].shape)] for name, a in given.items()]
        lead = np.broadcast_shapes(*leads)
        self.outputs: dict[str, Array] = {
            port.name: np.zeros((*lead, *self._shape(port))) for port in kernel.outputs
        }
        #: What can be read: inputs, and outputs that are complete.
        self.arrays = given | self.outputs

    def _shape(self, port: Port) -> tuple[int, ...]:
        return tuple(self.n if isinstance(extent, str) else extent for extent in port.shape)

    def _given(self, port: Port, inputs: Mapping[str, ArrayLike]) -> Array:
        if port.name not in inputs:
            raise ValueError(f"{self.kernel.name}: no value for the input {port.name!r}")
        array, shape = np.asarray(inputs[port.name], dtype=float), self._shape(port)
        if array.shape[array.ndim - len(shape) :] != shape:
            raise ValueError(
                f"{self.kernel.name}: {port.name} ends in the shape {shape}, not {array.shape}"
            )
        return array

    # --- statements -----------------------------------------------------------------------------

    def statement(self, statement: object) -> None:
        if isinstance(statement, (Assign, Sum)):
            self._inner(statement)
        elif isinstance(statement, Store):
            self._store(statement)
        elif isinstance(statement, Guard):
            if not np.all(_true(self._value(statement.condition))):
                raise NumericalFailure(f"{self.kernel.name}: {statement.message}")
        elif isinstance(statement, Solve):
            self._solve(statement)

    def _inner(self, statement: Inner) -> None:
        if isinstance(statement, Assign):
            operands = map(self._value, statement.args)
            self.temporaries[statement.number] = _OPERATIONS[statement.op](*operands)
            return
        axis = LOOPS.index(statement.over) - 2
        product = self._product(statement, axis)
        if product is not None:
            self.temporaries[statement.number] = product
            return
        for inner in statement.body:
            self._inner(inner)
        value = self._value(statement.value)
        # A value that is the same for all has the length 1 there.
        alike = value.shape[axis] == 1
        total = value * self.n if alike else value.sum(axis=axis, keepdims=True)
        self.temporaries[statement.number] = total

    def _product(self, statement: Sum, axis: int) -> Array | None:
        """The sum where it is a vector of every point times a matrix that is the same for all."""
        (inner, *more) = statement.body
        if more or not isinstance(inner, Assign) or inner.op != "mul":
            return None
        values = (np.moveaxis(self._value(operand), axis, -1) for operand in inner.args)
        matrix, vector = sorted(values, key=lambda a: a.ndim)
        if matrix.ndim > 2 or vector.shape[-2:] != (1, self.n) or matrix.shape != (self.n, self.n):
            return None
        return np.asarray(np.expand_dims(vector[..., 0, :] @ matrix.T, axis))

    def _value(self, operand: Operand) -> Array:
        if isinstance(operand, Temporary):
            return self.temporaries[operand.number]
        if isinstance(operand, Constant):
            return np.full((1, 1), operand.number)
        letters = [entry for entry in operand.index if isinstance(entry, str)]
        entry: Array = self.arrays[operand.port][_slices(operand.index)]
        if len(letters) == 2 and letters[0] == letters[1]:
            entry = np.diagonal(entry, axis1=-2, axis2=-1)
            letters = letters[:1]
        if len(letters) == 2:
            return entry if letters[0] == LOOP_INDEX else np.swapaxes(entry, -1, -2)
        if not letters:
            return np.asarray(entry)[..., None, None]
        return entry[..., :, None] if letters[0] == LOOP_INDEX else entry[..., None, :]

    def _store(self, store: Store) -> None:
        for inner in store.body:
            self._inner(inner)
        value = self._value(store.value)
        letters = [entry for entry in store.index if isinstance(entry, str)]
        if len(letters) == 2:
            value = value if letters[0] == LOOP_INDEX else np.swapaxes(value, -1, -2)
        else:
            value = value[..., 0, :] if letters and letters[0] != LOOP_INDEX else value[..., 0]
            value = value if letters else value[..., 0]
        place = _slices(store.index)
        if self.ports[store.port].accumulate:
            self.outputs[store.port][place] += value
        else:
            self.outputs[store.port][place] = value

    def _solve(self, solve: Solve) -> None:
        """L D L^T without pivoting, from the lower half of the matrix, for all points at once."""
        a = self.arrays[solve.matrix]
        a = np.tril(a) + np.swapaxes(np.tril(a, -1), -1, -2)
        rest, lower = a.copy(), np.zeros_like(a)
        columns = self.outputs[solve.port]
        columns[...] = self.arrays[solve.right]
        if len(self.ports[solve.port].shape) == 1:
            columns = columns[..., None]
        for i in range(self.n):
            pivot, diagonal = rest[..., i, i], a[..., i, i]
            if not np.all(pivot > solve.relative_pivot * np.abs(diagonal)):
                raise NumericalFailure(f"{self.kernel.name}: {solve.message}")
            below = slice(i + 1, None)
            lower[..., below, i] = rest[..., below, i] / pivot[..., None]
            factors = lower[..., below, i, None]
            rest[..., below, below] -= factors * rest[..., None, i, below]
            columns[..., below, :] -= factors * columns[..., None, i, :]
        columns /= np.diagonal(rest, axis1=-2, axis2=-1)[..., None]
        for i in reversed(range(self.n)):
            above = lower[..., i, :i, None]
            columns[..., :i, :] -= above * columns[..., None, i, :]


def _slices(index: tuple[int | str, ...]) -> tuple[Any, ...]:
    return (..., *(slice(None) if isinstance(entry, str) else entry for entry in index))


def _true(value: Array) -> NDArray[np.bool_]:
    """Neither zero nor NaN."""
    return np.abs(value) > 0


def _truth(operation: Callable[..., Any]) -> Callable[..., Array]:
    """An operation whose value is 0 or 1."""
    return lambda *args: np.asarray(operation(*args), dtype=float)


_OPERATIONS: dict[str, Callable[..., Array]] = {
    "neg": np.negative, "add": np.add, "sub": np.subtract, "mul": np.multiply, "div": np.divide,
    "pow": np.power, "sqrt": np.sqrt, "sin": np.sin, "cos": np.cos, "tan": np.tan,
    "asin": np.arcsin, "acos": np.arccos, "atan": np.arctan, "atan2": np.arctan2,
    "sinh": np.sinh, "cosh": np.cosh, "tanh": np.tanh, "exp": np.exp, "log": np.log,
    "abs": np.abs, "sign": np.sign, "floor": np.floor, "min": np.minimum, "max": np.maximum,
    "lt": _truth(np.less), "le": _truth(np.less_equal), "eq": _truth(np.equal),
    "and": _truth(lambda a, b: _true(a) & _true(b)),
    "or": _truth(lambda a, b: _true(a) | _true(b)),
    "not": _truth(lambda a: a == 0),
    "select": lambda c, a, b: np.asarray(np.where(_true(c), a, b)),
}  # fmt: skip
