"""Validation of numbers and arrays given by users: type, finiteness, shape, leading axes."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from numbers import Integral, Real
from typing import Any, TypeAlias, TypeGuard

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arguments import short
from .errors import SceneError

Array: TypeAlias = NDArray[np.float64]
Integers: TypeAlias = NDArray[np.int64]

_DOUBLE = np.dtype(np.float64)


def real(name: str, value: Any, expected: str = "a finite number") -> float:
    """Convert a real number to a finite float.

    SceneError for texts, truth values, arrays and numbers that are not finite.
    """
    if type(value) is float and math.isfinite(value):
        return value
    number = value.item() if isinstance(value, np.ndarray) and value.ndim == 0 else value
    if isinstance(number, bool | np.bool_) or not isinstance(number, Real) or _masked(value):
        raise SceneError(f"{name} = {short(value)}: expected {expected}")
    try:
        found = float(number)
    except OverflowError:  # an integer beyond all floats, whose text may exceed Python's limit
        raise SceneError(f"{name} exceeds 1.8e308: expected {expected}") from None
    if not math.isfinite(found):
        raise SceneError(f"{name} = {found}: expected {expected}")
    return found


def whole(name: str, value: Any, least: int, expected: str) -> int:
    """Validate an integer not below `least`; SceneError for anything else."""
    if isinstance(value, bool | np.bool_) or not isinstance(value, Integral) or value < least:
        raise SceneError(f"{name} = {short(value)}: expected {expected}")
    return int(value)


def threads_of(value: int | None) -> int | None:
    """Validate a number of threads; None for as many as there are processors."""
    if value is None:
        return None
    return whole("threads", value, 1, "a whole number from 1 up, or None")


def numbers(name: str, value: ArrayLike) -> Array:
    """Copy finite numbers to a new contiguous array; SceneError for anything else."""
    try:
        array = value.copy() if _ready(value) else _converted(value)
    except (TypeError, ValueError, OverflowError):
        raise SceneError(
            f"{name} = {short(value)}: expected an array of real numbers, with rows of equal length"
        ) from None
    if not _surely_finite(array) and not np.isfinite(array).all():
        if array.ndim == 0:
            raise SceneError(f"{name} = {array}: expected a finite number")
        place = tuple(int(k[0]) for k in np.nonzero(~np.isfinite(array)))
        where = f"{name}[{', '.join(map(str, place))}]"
        raise SceneError(f"{where} = {array[place]}: expected a finite number")
    return array


def _surely_finite(array: Array) -> bool:
    """Whether few numbers are finite, by a sum of small parts: fast, and without overflow."""
    row = array if array.ndim == 1 else array.ravel()
    return row.size <= _PARTS.size and math.isfinite(row.dot(_PARTS[: row.size]))


_PARTS = np.full(256, 1e-9)


def _ready(value: ArrayLike) -> TypeGuard[Array]:
    """Whether a value is a plain array of doubles, the common case, which needs no conversion."""
    return type(value) is np.ndarray and value.dtype is _DOUBLE


def _masked(value: Any) -> bool:
    """Whether a value has masked entries; impossible unless numpy.ma is loaded already.

    numpy.ma is not imported for this check, because that is slow.
    """
    known = sys.modules.get("numpy.ma")
    if known is None:
        return False
    if isinstance(value, known.MaskedArray):
        return bool(known.is_masked(value))
    several = value if isinstance(value, list | tuple) else ()
    return any(type(one) is not float and _masked(one) for one in several)


def _converted(value: ArrayLike) -> Array:
    found = np.asarray(value)
    if found.dtype.kind in "cSU" or _masked(value):
        raise TypeError
    return np.array(found, dtype=np.float64, order="C")


def one_row(name: str, value: ArrayLike) -> Array:
    """Validate a row of one or more finite numbers, (n,); SceneError for anything else."""
    found = numbers(name, value)
    if found.ndim != 1 or not found.size:
        raise SceneError(f"{name}: expected a row of one or more numbers, found {found.shape}")
    return found


def by_name(name: str, value: Any, what: str = "numbers") -> dict[str, Any]:
    """Validate a mapping from names to values, which are not checked here."""
    if not isinstance(value, Mapping):
        raise SceneError(f"{name}: expected {what} by their names, found {short(value)}")
    return {str(key): entry for key, entry in value.items()}


def pair(name: str, value: Any) -> tuple[ArrayLike, ArrayLike]:
    """Split a state (q, u) into its two arrays, which are not checked here."""
    try:
        q, u = value
    except (TypeError, ValueError):
        raise SceneError(f"{name}: expected two arrays (q, u), found {short(value)}") from None
    return q, u


def _row(array: Array, width: object) -> Array:
    """Convert a single number to a row of one, where a row of one is expected."""
    return array.reshape(1) if width == 1 and array.ndim == 0 else array


def one(name: str, value: ArrayLike, width: int, instead: str) -> Array:
    """Validate the numbers of one state, (width,); `instead` is the remedy for several states."""
    array = _row(numbers(name, value), width)
    if array.shape != (width,):
        several = array.ndim > 1 and array.shape[-1] == width
        more = f", one state; {instead}" if several else ""
        raise SceneError(f"{name} has shape {array.shape}, expected ({width},){more}")
    return array


def columns(name: str, value: ArrayLike, width: int) -> tuple[bool, Array]:
    """Validate right-hand sides: (whether it is one vector, its columns (..., width, n)).

    As in `numpy.linalg.solve`, (width,) is a vector and (..., width, n) holds n columns.
    """
    array = _row(numbers(name, value), width)
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
    arrays = [_row(numbers(name, value), width) for name, value, width in given]
    tails = [_tail(width) for _, _, width in given]
    for (name, _, _), array, tail in zip(given, arrays, tails, strict=True):
        if tail and array.shape[-len(tail) :] != tail:
            expected = ", ".join(map(str, tail))
            raise SceneError(f"{name} has shape {array.shape}, expected (..., {expected})")
    leads = [a.shape[: a.ndim - len(tail)] for a, tail in zip(arrays, tails, strict=True)]
    if not any(leads):
        return (), [a.reshape(1, *tail) for a, tail in zip(arrays, tails, strict=True)]
    try:
        lead = leads[0] if len(set(leads)) == 1 else np.broadcast_shapes(*leads)
    except ValueError:
        shapes = ", ".join(f"{g[0]} {a.shape}" for g, a in zip(given, arrays, strict=True))
        raise SceneError(
            f"shapes do not match: {shapes}; expected the same number of states in each"
        ) from None
    n = math.prod(lead)
    return lead, [
        _spread(array, lead + tail).reshape(n, *tail)
        for array, tail in zip(arrays, tails, strict=True)
    ]


def into(out: Array | None, found: Array) -> Array:
    """Return a result, written to `out` if given; SceneError unless `out` fits."""
    if out is None:
        return found
    holds = type(out) is np.ndarray and out.dtype is _DOUBLE and out.shape == found.shape
    if not holds or not out.flags.writeable:
        given = f"{out.dtype} {out.shape}" if isinstance(out, np.ndarray) else type(out).__name__
        raise SceneError(f"out: expected a writeable float64 array {found.shape}, found {given}")
    out[...] = found
    return out


def _tail(width: Width) -> tuple[int, ...]:
    """Shape of the axes that follow those of the states."""
    if width is None:
        return ()
    return width if isinstance(width, tuple) else (width,)


def _spread(array: Array, shape: tuple[int, ...]) -> Array:
    """Broadcast an array to `shape`, as a contiguous copy unless it has that shape."""
    return array if array.shape == shape else np.array(np.broadcast_to(array, shape), order="C")
