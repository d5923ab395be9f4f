"""Definition of a case of the atlas, before anything is computed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ..optional_packages import missing_packages
from .parameter_scale import Scale


@dataclass(frozen=True)
class MethodDefinition:
    """Method as a function of the case's parameter.

    `measure` returns the error measure; it raises NumericalFailure, or returns a number that is not
    finite, where there is no answer.
    """

    name: str
    measure: Callable[[float], float]


@dataclass(frozen=True)
class CaseDefinition:
    """Case: a parameter for which a method fails, the criterion, and the remedy.

    The method is measured between `low` and `high`: at one end it must hold, at the other fail.
    The remedy is measured from the failing end to `reach`.  A method fails where `measured` exceeds
    `limit`.  The case needs the packages of `extra`.
    """

    name: str
    title: str
    cause: str
    parameter: str
    unit: str
    low: float
    high: float
    scale: Scale
    measured: str
    limit: float
    method: MethodDefinition
    remedy: MethodDefinition
    reach: float
    source: str
    extra: str = ""

    @property
    def lacks(self) -> list[str]:
        """Packages needed by the case that are not installed."""
        return missing_packages(self.extra) if self.extra else []
