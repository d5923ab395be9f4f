"""Location of the floating frame of a beam, in one direction."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Frame:
    """Location of the floating frame in one direction: "tangent" at `x` (m), "chord" or "mean"."""

    kind: str
    x: float = 0.0

    @property
    def origin(self) -> float | None:
        """Section (m) without axial displacement and twist; None for the mean frame."""
        return {"tangent": self.x, "chord": 0.0, "mean": None}[self.kind]
