"""ModalBody: the numbers of one flexible body, as the kernels and the results take them.

A point that lies at r0 in the undeformed body is displaced by

    u = phi(r0) eta - 1/2 eta^T g(r0) eta

in the axes of the floating frame F, where phi holds one vector field per mode and g is the
displacement of second order that bending and twist bring with them.  All
integrals are over the mass of the undeformed body.  SI units; eta of bending and axial shapes in
metres, of twist shapes in radians.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .beam.beam_shapes import BeamShapes

Array: TypeAlias = NDArray[np.float64]


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


@dataclass(frozen=True)
class Moments:
    """Integrals of the fields 1, r0, phi, g over a density (frame axes, about F's origin).

    C[a, k] = int phi_a,k;  E[a, b, k] = int r0_a phi_b,k;  F[a, b, k, l] = int phi_a,k phi_b,l;
    G[a, k, l] = int g_a,kl;  X[a, b, k, l] = int r0_a g_b,kl.
    """

    mass: float
    first: Array  #: (3,) int r0
    second: Array  #: (3, 3) int r0 r0^T
    C: Array  #: (3, n)
    E: Array  #: (3, 3, n)
    F: Array  #: (3, 3, n, n)
    G: Array  #: (3, n, n)
    X: Array  #: (3, 3, n, n)


@dataclass(frozen=True)
class ModalBody(Moments):
    """One flexible body: the moments of its mass, stiffness, ports, and what it starts with.

    With `points` (quadrature variant) the mass sits in them and the moments are not used.
    `drag` are the moments of the viscous drag per length (N s/m^2 in place of kg/m; motion of the
    axis only), None without drag.  `frame` says where the floating frame is: "tangent", "chord",
    "mean", or one of them per bending plane ("chord/tangent": of y, of z).
    """

    name: str
    modes: tuple[str, ...]  #: "y1", "z1", "twist1", "axial1", "m1"
    K: Array  #: (n, n)
    D: Array  #: (n, n)
    ports: Mapping[str, ModalPort]
    points: tuple[MassPoint, ...] = ()
    drag: Moments | None = None
    eta: Array = field(default_factory=lambda: np.zeros(0))
    etad: Array = field(default_factory=lambda: np.zeros(0))
    shapes: BeamShapes | None = None
    frame: str = ""
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    @property
    def n(self) -> int:
        """Number of modes."""
        return len(self.modes)

    @property
    def Mff(self) -> Array:
        """(n, n) mass matrix of the modes alone, the frame held."""
        return np.einsum("aakl->kl", self.F)
