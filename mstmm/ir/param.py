"""Parameter or coordinate of an element, with unit and bounds."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Param:
    """Named number of an element: SI unit, default and inclusive bounds (None: no bound)."""

    name: str
    unit: str = ""
    description: str = ""
    default: float | None = None
    minimum: float | None = None
    maximum: float | None = None
