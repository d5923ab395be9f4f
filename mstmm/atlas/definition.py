"""What a case of the atlas is before anything is computed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ..extras import absent
from .scale import Scale


@dataclass(frozen=True)
class Method:
    """A method as a function of the case's parameter.

    `measure` gives what is judged; it raises NumericalFailure, or returns a number that is not
    finite, where there is no answer at all.
    """

    name: str
    measure: Callable[[float], float]


@dataclass(frozen=True)
class Definition:
    """A parameter that breaks a method, when that counts as broken, and what holds there.

    `low` and `high` are the ends between which the method is tried: at one of them it must hold,
    at the other fail.  `reach` is how far the remedy is tried beyond the failing end.  It failed
    where `measured` is above `limit`.  It needs the packages of `extra`.
    """

    name: str
    title: str
    why: str
    parameter: str
    unit: str
    low: float
    high: float
    scale: Scale
    measured: str
    limit: float
    method: Method
    remedy: Method
    reach: float
    source: str
    extra: str = ""

    @property
    def lacks(self) -> list[str]:
        """Packages that the case needs and that are not installed."""
        return absent(self.extra) if self.extra else []
