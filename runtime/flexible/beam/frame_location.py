"""Where the floating frame of a beam is, for one direction."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Frame:
    """Where the floating frame of one direction is: "tangent" at `x` (m), "chord" or "mean"."""

    kind: str
    x: float = 0.0

    @property
    def origin(self) -> float | None:
        """Section that does not move along the beam or about it, None for the mean."""
        return {"tangent": self.x, "chord": 0.0, "mean": None}[self.kind]
