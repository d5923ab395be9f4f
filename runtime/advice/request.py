"""Validated arguments of `mstmm.advise`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from mstmm.array_validation import finite_float, integer
from mstmm.errors import SceneError


@dataclass(frozen=True)
class Request:
    """Validated arguments of `mstmm.advise`."""

    t_end: float
    error: float
    of: tuple[str, ...]
    budget: float
    samples: int
    rounds: int


def advice_request(
    t_end: float, error: float, of: str | Sequence[str], budget: float, samples: int, rounds: int
) -> Request:
    """Validate the arguments of `mstmm.advise`; SceneError names the first invalid one."""
    quantities = _require_names(of)
    target_error = finite_float("error", error, "an error above 0")
    is_relative = len(quantities) != 1  # a single quantity has a unit, and no upper limit
    is_positive = target_error > 0 and math.isfinite(target_error)
    if not is_positive or (is_relative and target_error >= 1):
        limits = "above 0 and below 1" if is_relative else "above 0, in the unit of the quantity"
        raise SceneError(f"error = {target_error:g}: expected an error {limits}, such as 1e-3")
    return Request(
        _require_positive_time("t_end", t_end), target_error, quantities,
        _require_positive_time("budget", budget),
        integer("samples", samples, 2, "a whole number of samples, 2 or more"),
        integer("rounds", rounds, 0, "a whole number of rounds, 0 or more"),
    )  # fmt: skip


def _require_names(of: str | Sequence[str]) -> tuple[str, ...]:
    if isinstance(of, str):
        return (of,)
    if not isinstance(of, Sequence) or not all(isinstance(name, str) for name in of):
        raise SceneError(f"of = {of!r:.60}: expected the name of a quantity, or a list of names")
    return tuple(of)


def _require_positive_time(name: str, value: float) -> float:
    time = finite_float(name, value, "a time in s above 0")
    if not time > 0 or not math.isfinite(time):
        raise SceneError(f"{name} = {time:g}: expected a time in s above 0")
    return time
