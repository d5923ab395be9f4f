"""Sources of plots: a result, a file of columns, each run of a batch."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from mstmm.array_validation import Array

from ..quantity_names import Quantity


class Candidate(NamedTuple):
    """Candidate for a plot: name, unit, and range of its values."""

    name: str
    unit: str
    moved: float


class QuantitySource(Protocol):
    """Quantities by name."""

    def quantity(self, name: str) -> Quantity:
        """Quantity of this name; SceneError with the nearest name if there is none."""
        ...


class PlotSource(QuantitySource, Protocol):
    """Quantities by name over the times `t` (n,) in s."""

    @property
    def t(self) -> Array: ...

    def default_quantities(self) -> list[Candidate]:
        """Candidates for default quantities, the most informative kinds first."""
        ...
