"""What a certificate rests on: drifts of what should be kept, and how far springs gave way."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Drift:
    """Largest change of a quantity that should not change, beside the scale it is judged by."""

    name: str
    unit: str
    largest: float
    scale: float
    of_what: str

    @property
    def relative(self) -> float:
        """largest / scale; 0 where both vanish; nan where the quantity is not finite."""
        if not self.known:
            return np.nan
        if self.scale > 0:
            return self.largest / self.scale
        return np.inf if self.largest > 0 else 0.0

    @property
    def known(self) -> bool:
        """False where the quantity is beyond what numbers hold, or no sample gives it."""
        return bool(np.isfinite(self.largest) and np.isfinite(self.scale))

    def __str__(self) -> str:
        if not self.known:
            return f"not determined: no finite {self.unit} in every sample that can be evaluated"
        text = f"{self.largest:.1e} {self.unit} of {self.scale:.3g} {self.unit} {self.of_what}"
        return f"{text} ({self.relative:.1e})"


@dataclass(frozen=True)
class Give:
    """The stiffest spring of a scene: how far its ends were from its rest length, at most.

    Attributes:
        spring: in words, 'spring "loop"' or 'hinge "mount"'.
        stiffness: N/m.
        largest: m, over the samples.
    """

    spring: str
    stiffness: float
    largest: float
