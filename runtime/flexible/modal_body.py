"""ModalBody: one flexible body in its floating frame, as kernels and results use it.

A point at r0 of the undeformed body is displaced by

    u = phi(r0) eta - 1/2 eta^T g(r0) eta

in the axes of the floating frame F, where phi holds one vector field per mode and g is the
second-order displacement due to bending and twist.  All integrals are over the mass of the
undeformed body.  SI units; eta of bending and axial shapes in metres, of twist shapes in radians.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from mstmm.array_validation import Array, Integers

from .beam.section_ports import BeamShapes
from .mass_moments import Moments
from .modal_port import MassPoint, ModalPort
from .truncation import Truncation


@dataclass(frozen=True)
class Skin:
    """Surface of a body for display, frame axes.

    Undeformed `nodes` (N, 3) m; `phi` (3, N, n) their displacement per mode; `faces` (m, 3)
    triangles of nodes, none where only nodes are known.
    """

    nodes: Array
    phi: Array
    faces: Integers


@dataclass(frozen=True)
class ModalBody(Moments):
    """One flexible body: mass moments, stiffness, damping, ports and initial deformation.

    With `points` (quadrature variant) the mass sits in them and the moments are not used.
    `drag` are the moments of the viscous drag per length (N s/m^2 in place of kg/m; motion of the
    axis only), None without drag.  `resolved` is the highest frequency (rad/s) that the shapes of
    an elastic body resolve, `truncation` their truncation error in deflections; both None for
    beams.  `frame` is the kind of floating frame: "tangent", "chord", "mean", or one of them per
    bending plane ("chord/tangent": of y, of z).
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
    skin: Skin | None = None
    frame: str = ""
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    resolved: float | None = None
    truncation: Truncation | None = None
    unmoved_frame: str = ""  #: kind of frame with fewer shapes, if it differs

    @property
    def n(self) -> int:
        """Number of modes."""
        return len(self.modes)

    @property
    def Mff(self) -> Array:
        """Modal mass matrix (n, n), with the frame fixed."""
        return np.einsum("aakl->kl", self.F)
