"""What can be drawn: a result, a file of columns, each run of a batch."""

from __future__ import annotations

from typing import Protocol

from mstmm.arrays import Array

from ..names import Quantity


class Shown(Protocol):
    """Quantities by name over the times `t` (n,) in s."""

    @property
    def t(self) -> Array: ...

    def quantity(self, name: str) -> Quantity:
        """SceneError with the nearest name where there is none of this one."""
        ...

    def candidates(self) -> list[str]:
        """Names of what may be drawn if nobody chose, the most telling kinds first."""
        ...
