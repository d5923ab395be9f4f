"""A named number of an element."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Param:
    """A named number of an element: unit in SI, bounds inclusive, None where there is none."""

    name: str
    unit: str = ""
    meaning: str = ""
    default: float | None = None
    minimum: float | None = None
    maximum: float | None = None
