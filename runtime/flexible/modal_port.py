"""Sections of a flexible body relative to its floating frame, and slices with its mass."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mstmm.array_validation import Array


@dataclass(frozen=True)
class ModalPort:
    """One end, or any other section, of a flexible body relative to its floating frame.

    The section's pose is R = exp(Psi~) rotation with Psi = theta eta - 1/2 eta^T h eta and
    d = position + phi eta - 1/2 eta^T g eta, where `second_order` holds g and then h.
    """

    position: Array  #: (3,) undeformed point, frame axes, m
    rotation: Array  #: (3, 3) undeformed axes of the end -> frame axes
    phi: Array  #: (3, n) displacement of the point per mode
    theta: Array  #: (3, n) rotation vector of the section per mode
    second_order: Array  #: (6, n, n) symmetric in the last two; zeros where linear

    @property
    def can_move(self) -> bool:
        """Whether the section can move relative to the floating frame."""
        return bool(np.any(self.phi) or np.any(self.theta) or np.any(self.second_order))


@dataclass(frozen=True)
class MassPoint:
    """A rigid slice with a part of the mass of a body (quadrature variant).

    `inertia` (3, 3) is about the point, in the section's axes, kg m^2.
    """

    mass: float
    inertia: Array
    port: ModalPort
