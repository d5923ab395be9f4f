"""What an advice is asked for, checked."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from mstmm.array_validation import finite_float, integer
from mstmm.errors import SceneError


@dataclass(frozen=True)
class Request:
    """What was asked for, checked."""

    t_end: float
    error: float
    of: tuple[str, ...]
    budget: float
    samples: int
    rounds: int


def request(
    t_end: float, error: float, of: str | Sequence[str], budget: float, samples: int, rounds: int
) -> Request:
    """SceneError naming the first argument that makes no sense."""
    wanted = _names(of)
    asked = finite_float("error", error, "an error above 0")
    in_parts = len(wanted) != 1  # a quantity alone has a unit, in which 5 may be little
    if not asked > 0 or not math.isfinite(asked) or (in_parts and asked >= 1):
        limits = "above 0 and below 1" if in_parts else "above 0, in the unit of the quantity"
        raise SceneError(f"error = {asked:g}: expected an error {limits}, such as 1e-3")
    return Request(
        _above_zero("t_end", t_end), asked, wanted,
        _above_zero("budget", budget),
        integer("samples", samples, 2, "a whole number of samples, 2 or more"),
        integer("rounds", rounds, 0, "a whole number of rounds, 0 or more"),
    )  # fmt: skip


def _names(of: str | Sequence[str]) -> tuple[str, ...]:
    if isinstance(of, str):
        return (of,)
    if not isinstance(of, Sequence) or not all(isinstance(name, str) for name in of):
        raise SceneError(f"of = {of!r:.60}: expected the name of a quantity, or several")
    return tuple(of)


def _above_zero(name: str, value: float) -> float:
    found = finite_float(name, value, "a time in s above 0")
    if not found > 0 or not math.isfinite(found):
        raise SceneError(f"{name} = {found:g}: expected a time in s above 0")
    return found
