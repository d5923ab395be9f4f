"""What an advice is asked for, checked."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from mstmm.arrays import real, whole
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
    asked = real("error", error, "an error above 0 and below 1")
    if not 0 < asked < 1:
        raise SceneError(f"error = {asked:g}: expected an error above 0 and below 1, such as 1e-3")
    return Request(
        _above_zero("t_end", t_end), asked, (of,) if isinstance(of, str) else tuple(of),
        _above_zero("budget", budget),
        whole("samples", samples, 2, "a whole number of samples, 2 or more"),
        whole("rounds", rounds, 0, "a whole number of rounds, 0 or more"),
    )  # fmt: skip


def _above_zero(name: str, value: float) -> float:
    found = real(name, value, "a time in s above 0")
    if not found > 0 or not math.isfinite(found):
        raise SceneError(f"{name} = {found:g}: expected a time in s above 0")
    return found
