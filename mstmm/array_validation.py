"""Validation of numbers and arrays given by users: type, finiteness, shape, leading axes."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from numbers import Integral, Real
from typing import Any, TypeAlias, TypeGuard

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .argument_validation import abbreviate
from .errors import SceneError

Array: TypeAlias = NDArray[np.float64]
Integers: TypeAlias = NDArray[np.int64]

_DOUBLE = np.dtype(np.float64)


def finite_float(name: str, value: Any, expected: str = "a finite number") -> float:
    """Convert a real number to a finite float.

    SceneError for texts, truth values, arrays and numbers that are not finite.
    """
    if type(value) is float and math.isfinite(value):
        return value
    number = value.item() if isinstance(value, np.ndarray) and value.ndim == 0 else value
    if isinstance(number, bool | np.bool_) or not isinstance(number, Real) or _has_mask(value):
        raise SceneError(f"{name} = {abbreviate(value)}: expected {expected}")
    try:
        result = float(number)
    except OverflowError:  # an integer beyond all floats, whose text may exceed Python's limit
        raise SceneError(f"{name} exceeds 1.8e308: expected {expected}") from None
    if not math.isfinite(result):
        raise SceneError(f"{name} = {result}: expected {expected}")
    return result


def positive_float(name: str, value: Any, meaning: str) -> float:
    """A finite number above 0; raises SceneError for other values, with its `meaning`."""
    number = finite_float(name, value, f"{meaning} above 0")
    if not number > 0:
        raise SceneError(f"{name} = {number:g}: expected {meaning} above 0")
    return number


def integer(name: str, value: Any, least: int, expected: str) -> int:
    """Validate an integer not below `least`; SceneError for anything else."""
    if isinstance(value, bool | np.bool_) or not isinstance(value, Integral) or value < least:
        raise SceneError(f"{name} = {abbreviate(value)}: expected {expected}")
    return int(value)


def thread_count(value: int | None) -> int | None:
    """Validate a number of threads; None for as many as there are processors."""
    if value is None:
        return None
    return integer("threads", value, 1, "a whole number from 1 up, or None")


def finite_array(name: str, value: ArrayLike) -> Array:
    """Copy finite numbers to a new contiguous array; SceneError for anything else."""
    try:
        array = value.copy() if _is_double_array(value) else _convert(value)
    except (TypeError, ValueError, OverflowError):
        raise SceneError(
            f"{name} = {abbreviate(value)}: expected an array of real numbers, with rows of equal "
            f"length"
        ) from None
    if not _is_surely_finite(array) and not np.isfinite(array).all():
        if array.ndim == 0:
            raise SceneError(f"{name} = {array}: expected a finite number")
        index = tuple(int(k[0]) for k in np.nonzero(~np.isfinite(array)))
        where = f"{name}[{', '.join(map(str, index))}]"
        raise SceneError(f"{where} = {array[index]}: expected a finite number")
    return array


def _is_surely_finite(array: Array) -> bool:
    """Fast one-sided test: True only for a short array whose values are all finite."""
    row = array if array.ndim == 1 else array.ravel()
    return row.size <= _SMALL_WEIGHTS.size and math.isfinite(row.dot(_SMALL_WEIGHTS[: row.size]))


_SMALL_WEIGHTS = np.full(256, 1e-9)


def _is_double_array(value: ArrayLike) -> TypeGuard[Array]:
    """Whether a value is a plain array of doubles, the common case, which needs no conversion."""
    return type(value) is np.ndarray and value.dtype is _DOUBLE


def _has_mask(value: Any) -> bool:
    """Whether a value has masked entries; impossible unless numpy.ma is loaded already.

    numpy.ma is not imported for this check, because that is slow.
    """
    numpy_ma = sys.modules.get("numpy.ma")
    if numpy_ma is None:
        return False
    if isinstance(value, numpy_ma.MaskedArray):
        return bool(numpy_ma.is_masked(value))
    entries = value if isinstance(value, list | tuple) else ()
    return any(type(entry) is not float and _has_mask(entry) for entry in entries)


def _convert(value: ArrayLike) -> Array:
    array = np.asarray(value)
    if array.dtype.kind in "cSU" or _has_mask(value):
        raise TypeError
    return np.array(array, dtype=np.float64, order="C")


def one_row(name: str, value: ArrayLike) -> Array:
    """Validate a row of one or more finite numbers, (n,); SceneError for anything else."""
    row = finite_array(name, value)
    if row.ndim != 1 or not row.size:
        raise SceneError(f"{name}: expected a row of one or more numbers, found {row.shape}")
    return row


def mapping_by_name(name: str, value: Any, what: str = "numbers") -> dict[str, Any]:
    """Validate a mapping from names to values, which are not checked here."""
    if not isinstance(value, Mapping):
        raise SceneError(f"{name}: expected {what} by their names, found {abbreviate(value)}")
    return {str(key): entry for key, entry in value.items()}


def split_state(name: str, value: Any) -> tuple[ArrayLike, ArrayLike]:
    """Split a state (q, u) into its two arrays, which are not checked here."""
    try:
        q, u = value
    except (TypeError, ValueError):
        raise SceneError(f"{name}: expected two arrays (q, u), found {abbreviate(value)}") from None
    return q, u


def _as_row(array: Array, width: object) -> Array:
    """Convert a single number to a row of one, where a row of one is expected."""
    return array.reshape(1) if width == 1 and array.ndim == 0 else array


def single_state(name: str, value: ArrayLike, width: int, instead: str) -> Array:
    """Validate the numbers of one state, (width,); `instead` is the remedy for several states."""
    array = _as_row(finite_array(name, value), width)
    if array.shape != (width,):
        is_batch = array.ndim > 1 and array.shape[-1] == width
        advice = f", one state; {instead}" if is_batch else ""
        raise SceneError(f"{name} has shape {array.shape}, expected ({width},){advice}")
    return array


def right_hand_sides(name: str, value: ArrayLike, width: int) -> tuple[bool, Array]:
    """Validate right-hand sides: (whether it is one vector, its columns (..., width, n)).

    As in `numpy.linalg.solve`, (width,) is a vector and (..., width, n) holds n columns.
    """
    array = _as_row(finite_array(name, value), width)
    if array.shape == (width,):
        return True, array[:, None]
    if array.ndim < 2 or array.shape[-2] != width:
        raise SceneError(
            f"{name} has shape {array.shape}, expected ({width},) or (..., {width}, columns)"
        )
    return False, array


#: Numbers per state: None for one, the length of a row, or the shape of an array.
Width = int | tuple[int, int] | None


def batch(*given: tuple[str, ArrayLike, Width]) -> tuple[tuple[int, ...], list[Array]]:
    """Validate arrays over states: leading axes, and a contiguous copy (n, width) of each array.

    Each argument is (name, value, width).  The leading axes are broadcast against each other.
    Width None means one number per state: then the copy is (n,).  SceneError for shapes that do
    not match and for numbers that are not finite.
    """
    arrays = [_as_row(finite_array(name, value), width) for name, value, width in given]
    state_shapes = [_state_shape(width) for _, _, width in given]
    for (name, _, _), array, state_shape in zip(given, arrays, state_shapes, strict=True):
        if state_shape and array.shape[-len(state_shape) :] != state_shape:
            expected = ", ".join(map(str, state_shape))
            raise SceneError(f"{name} has shape {array.shape}, expected (..., {expected})")
    leading_shapes = [
        a.shape[: a.ndim - len(state_shape)]
        for a, state_shape in zip(arrays, state_shapes, strict=True)
    ]
    if not any(leading_shapes):
        return (), [
            a.reshape(1, *state_shape) for a, state_shape in zip(arrays, state_shapes, strict=True)
        ]
    try:
        leading_shape = (
            leading_shapes[0]
            if len(set(leading_shapes)) == 1
            else np.broadcast_shapes(*leading_shapes)
        )
    except ValueError:
        shapes = ", ".join(f"{g[0]} {a.shape}" for g, a in zip(given, arrays, strict=True))
        raise SceneError(
            f"shapes do not match: {shapes}; expected the same number of states in each"
        ) from None
    n = math.prod(leading_shape)
    return leading_shape, [
        _broadcast(array, leading_shape + state_shape).reshape(n, *state_shape)
        for array, state_shape in zip(arrays, state_shapes, strict=True)
    ]


def copy_to(out: Array | None, found: Array) -> Array:
    """Return a result, written to `out` if given; SceneError unless `out` fits."""
    if out is None:
        return found
    is_compatible = type(out) is np.ndarray and out.dtype is _DOUBLE and out.shape == found.shape
    if not is_compatible or not out.flags.writeable:
        description = (
            f"{out.dtype} {out.shape}" if isinstance(out, np.ndarray) else type(out).__name__
        )
        raise SceneError(
            f"out: expected a writeable float64 array {found.shape}, found {description}"
        )
    out[...] = found
    return out


def _state_shape(width: Width) -> tuple[int, ...]:
    """Shape of the axes that follow those of the states."""
    if width is None:
        return ()
    return width if isinstance(width, tuple) else (width,)


def _broadcast(array: Array, shape: tuple[int, ...]) -> Array:
    """Broadcast an array to `shape`, as a contiguous copy unless it has that shape."""
    return array if array.shape == shape else np.array(np.broadcast_to(array, shape), order="C")
