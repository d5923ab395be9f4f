"""Sections of a flexible body seen from its floating frame, and slices that carry its mass."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mstmm.array_validation import Array


@dataclass(frozen=True)
class ModalPort:
    """One end of a flexible body, or any other section of it, seen from the floating frame.

    The section's pose is R = exp(Psi~) rotation with Psi = theta eta - 1/2 eta^T h eta and
    d = position + phi eta - 1/2 eta^T g eta, where `second_order` holds g and then h.
    """

    position: Array  #: (3,) the point at rest, frame axes, m
    rotation: Array  #: (3, 3) axes of the end at rest -> frame axes
    phi: Array  #: (3, n) displacement of the point per mode
    theta: Array  #: (3, n) rotation vector of the section per mode
    second_order: Array  #: (6, n, n) symmetric in the last two; zeros where linear

    @property
    def moves(self) -> bool:
        """False where the section never leaves its pose in the floating frame."""
        return bool(np.any(self.phi) or np.any(self.theta) or np.any(self.second_order))


@dataclass(frozen=True)
class MassPoint:
    """A slice of the body that carries its mass as a rigid body (quadrature variant).

    `inertia` (3, 3) is about the point, in the section's axes, kg m^2.
    """

    mass: float
    inertia: Array
    port: ModalPort
