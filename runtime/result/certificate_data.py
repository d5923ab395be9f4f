"""Data of a certificate: drifts of conserved quantities, deflections of springs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Drift:
    """Largest change of a conserved quantity, with its reference scale."""

    name: str
    unit: str
    largest: float
    scale: float
    of_what: str

    @property
    def relative(self) -> float:
        """Relative drift largest / scale; 0 if both vanish; nan if the quantity is not finite."""
        if not self.is_known:
            return np.nan
        if self.scale > 0:
            return self.largest / self.scale
        return np.inf if self.largest > 0 else 0.0

    @property
    def is_known(self) -> bool:
        """Whether the drift is known: no overflow, and at least one sample has a value."""
        return bool(np.isfinite(self.largest) and np.isfinite(self.scale))

    def __str__(self) -> str:
        if not self.is_known:
            return f"not determined: no sample has a finite value in {self.unit}"
        text = f"{self.largest:.1e} {self.unit} of {self.scale:.3g} {self.unit} {self.of_what}"
        return f"{text} ({self.relative:.1e})"


@dataclass(frozen=True)
class SpringDeflection:
    """Largest deflection of the stiffest spring of a scene.

    Attributes:
        spring: in words, 'spring "loop"' or 'hinge "mount"'.
        stiffness: N/m.
        largest: m, over the samples.
    """

    spring: str
    stiffness: float
    largest: float
