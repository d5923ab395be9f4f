"""Numbers and arrays that users give, checked in one place: kind, finite, shape, leading axes."""

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
    """A finite Python float of any library's real number (not of text, truth values, arrays)."""
    if type(value) is float and math.isfinite(value):
        return value
    number = value.item() if isinstance(value, np.ndarray) and value.ndim == 0 else value
    if isinstance(number, bool | np.bool_) or not isinstance(number, Real) or _masked(value):
        raise SceneError(f"{name} = {short(value)}: expected {expected}")
    try:
        found = float(number)
    except OverflowError:  # a whole number beyond all floats, which may not even have a text
        raise SceneError(f"{name} is beyond 1.8e308: expected {expected}") from None
    if not math.isfinite(found):
        raise SceneError(f"{name} = {found}: expected {expected}")
    return found


def whole(name: str, value: Any, least: int, expected: str) -> int:
    """A whole number from `least` up."""
    if isinstance(value, bool | np.bool_) or not isinstance(value, Integral) or value < least:
        raise SceneError(f"{name} = {short(value)}: expected {expected}")
    return int(value)


def threads_of(value: int | None) -> int | None:
    """How many threads to start; None for as many as there are processors."""
    if value is None:
        return None
    return whole("threads", value, 1, "a whole number from 1 up, or None")


def numbers(name: str, value: ArrayLike) -> Array:
    """A new contiguous array of finite numbers; SceneError for anything else."""
    try:
        array = value.copy() if _ready(value) else _converted(value)
    except (TypeError, ValueError, OverflowError):
        raise SceneError(
            f"{name} = {short(value)}: expected an array of real numbers, every row as long"
        ) from None
    if not _surely_finite(array) and not np.isfinite(array).all():
        if array.ndim == 0:
            raise SceneError(f"{name} = {array}: expected a finite number")
        place = tuple(int(k[0]) for k in np.nonzero(~np.isfinite(array)))
        where = f"{name}[{', '.join(map(str, place))}]"
        raise SceneError(f"{where} = {array[place]}: expected a finite number")
    return array


def _surely_finite(array: Array) -> bool:
    """Of few numbers by a sum of small parts of them, which is quick and does not overflow."""
    row = array if array.ndim == 1 else array.ravel()
    return row.size <= _PARTS.size and math.isfinite(row.dot(_PARTS[: row.size]))


_PARTS = np.full(256, 1e-9)


def _ready(value: ArrayLike) -> TypeGuard[Array]:
    """Whether it is what most calls give, for which less is to be done."""
    return type(value) is np.ndarray and value.dtype is _DOUBLE


def _masked(value: Any) -> bool:
    """Whether a mask hides some of it; without numpy.ma, which takes its time, there are none."""
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
    """One finite number or more, (n,); SceneError for anything else."""
    found = numbers(name, value)
    if found.ndim != 1 or not found.size:
        raise SceneError(f"{name}: expected one number or more in a row, found {found.shape}")
    return found


def by_name(name: str, value: Any, what: str = "numbers") -> dict[str, Any]:
    """A table of values by their names, not yet looked into."""
    if not isinstance(value, Mapping):
        raise SceneError(f"{name}: expected {what} by their names, found {short(value)}")
    return {str(key): entry for key, entry in value.items()}


def pair(name: str, value: Any) -> tuple[ArrayLike, ArrayLike]:
    """(q, u), not yet looked into."""
    try:
        q, u = value
    except (TypeError, ValueError):
        raise SceneError(f"{name}: expected two arrays (q, u), found {short(value)}") from None
    return q, u


def _row(array: Array, width: object) -> Array:
    """A number alone stands for the row that holds nothing else."""
    return array.reshape(1) if width == 1 and array.ndim == 0 else array


def one(name: str, value: ArrayLike, width: int, instead: str) -> Array:
    """(width,) of one state.  `instead` says what to do with several."""
    array = _row(numbers(name, value), width)
    if array.shape != (width,):
        several = array.ndim > 1 and array.shape[-1] == width
        more = f", one state; {instead}" if several else ""
        raise SceneError(f"{name} has shape {array.shape}, expected ({width},){more}")
    return array


def columns(name: str, value: ArrayLike, width: int) -> tuple[bool, Array]:
    """(whether it is one vector, its columns (..., width, n)).

    As `numpy.linalg.solve` has it: (width,) is a vector, (..., width, n) holds n columns.
    """
    array = _row(numbers(name, value), width)
    if array.shape == (width,):
        return True, array[:, None]
    if array.ndim < 2 or array.shape[-2] != width:
        raise SceneError(
            f"{name} has shape {array.shape}, expected ({width},) or (..., {width}, columns)"
        )
    return False, array


#: How many numbers there are per state: one, a row of so many, or an array of such a shape.
Width = int | tuple[int, int] | None


def batch(*given: tuple[str, ArrayLike, Width]) -> tuple[tuple[int, ...], list[Array]]:
    """Leading axes, and for each (name, value, width) a contiguous copy (n, width) over all states.

    The leading axes are broadcast against each other.  Width None stands for one number per state:
    then the copy is (n,).  SceneError for a misfit or for what is no finite number.
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
        raise SceneError(f"shapes do not fit: {shapes}; expected as many states in each") from None
    n = math.prod(lead)
    return lead, [
        _spread(array, lead + tail).reshape(n, *tail)
        for array, tail in zip(arrays, tails, strict=True)
    ]


def into(out: Array | None, found: Array) -> Array:
    """What was found, written into `out` where one is given; SceneError unless that holds it."""
    if out is None:
        return found
    holds = type(out) is np.ndarray and out.dtype is _DOUBLE and out.shape == found.shape
    if not holds or not out.flags.writeable:
        given = f"{out.dtype} {out.shape}" if isinstance(out, np.ndarray) else type(out).__name__
        raise SceneError(f"out: expected a writeable float64 array {found.shape}, found {given}")
    out[...] = found
    return out


def _tail(width: Width) -> tuple[int, ...]:
    """The axes behind those of the states."""
    if width is None:
        return ()
    return width if isinstance(width, tuple) else (width,)


def _spread(array: Array, shape: tuple[int, ...]) -> Array:
    """The array, or a contiguous copy of it broadcast to `shape`."""
    return array if array.shape == shape else np.array(np.broadcast_to(array, shape), order="C")
