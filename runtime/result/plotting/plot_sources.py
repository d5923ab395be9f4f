"""What can be drawn: a result, a file of columns, each run of a batch."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from mstmm.array_validation import Array

from ..quantity_names import Quantity


class Candidate(NamedTuple):
    """What may be drawn, its unit, and the range that it moves through."""

    name: str
    unit: str
    moved: float


class QuantitySource(Protocol):
    """Quantities by name."""

    def quantity(self, name: str) -> Quantity:
        """SceneError with the nearest name where there is none of this one."""
        ...


class PlotSource(QuantitySource, Protocol):
    """Quantities by name over the times `t` (n,) in s."""

    @property
    def t(self) -> Array: ...

    def candidates(self) -> list[Candidate]:
        """What may be drawn if nobody chose, the most telling kinds first."""
        ...
