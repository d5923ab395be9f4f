"""All shapes of one beam: first-order displacements and rotations at any section."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mstmm.array_validation import Array

from . import beam_kernels
from .beam_data import BeamData, BeamSections
from .gauss_quadrature import gauss_points, shape_density
from .shape_functions import Shape, section_rotation

#: Directions in the order of the modal coordinates.
DIRECTIONS = ("y", "z", "twist", "axial")
#: Row of a direction in `ShapeFields.rows`.
ROW = {"axial": 0, "y": 1, "z": 2, "twist": 3}


@dataclass(frozen=True)
class Mode:
    """One modal coordinate: direction and shape.

    `frame_rotation` is the rigid rotation (rad) per unit that the frame conditions removed from the
    shape. The inertia of the sections rotates by it even where rotary inertia is neglected.
    """

    name: str
    direction: str
    shape: Shape
    frame_rotation: float = 0.0


@dataclass(frozen=True)
class ShapeValues:
    """Values per mode at sections x (m,), frame axes; bending and axial modes per metre of eta."""

    phi: Array  #: (m, 3, n) displacement of the axis
    theta: Array  #: (m, 3, n) rotation vector of the section
    curvature: Array  #: (m, 3, n) d theta / dx: rate of twist, -psi_w', psi_v'
    axial_strain: Array  #: (m, n) s'


class ShapeFields:
    """All shapes of a beam in the floating frame."""

    def __init__(self, data: BeamData, modes: tuple[Mode, ...]) -> None:
        self.data, self.modes = data, modes
        inner = {x for mode in modes for x in mode.shape.breaks if 0 < x < data.length}
        inner |= {x for x, _ in data.ends.values() if 0 < x < data.length}
        places = sorted({*data.breaks, *inner})
        smallest = 1e-12 * data.length
        self.pieces = tuple(
            b for a, b in zip((-data.length, *places), places, strict=False) if b - a > smallest
        )  #: positions between which all shapes and sections are smooth
        self.density = shape_density([mode.shape for mode in modes])

    @property
    def n(self) -> int:
        """Number of modes."""
        return len(self.modes)

    @property
    def length(self) -> float:
        return self.data.length

    @property
    def breaks(self) -> tuple[float, ...]:
        """Positions (m) of section changes, with 0 and the length."""
        return self.data.breaks

    @property
    def rotary(self) -> bool:
        """Whether bending includes rotary inertia."""
        return self.data.rotary

    def sections(self, x: Array) -> BeamSections:
        """Section data at every x (m)."""
        return self.data.sections(np.asarray(x, dtype=float))

    def rule(self) -> tuple[Array, Array]:
        """Quadrature points and weights (m) along the beam, exact for products of two shapes."""
        return gauss_points(self.pieces, self.density)

    def rows(self, x: Array, d: int) -> Array:
        """Derivatives (4, n, m) of order d of s, v, w, psi per mode."""
        values = np.zeros((4, self.n, len(x)))
        for k, mode in enumerate(self.modes):
            values[ROW[mode.direction], k] = mode.shape(x, d)
        return values

    def bending_rotations(self, x: Array, d: int) -> Array:
        """Derivatives (2, n, m) of order d of psi_v, psi_w per mode: v', w' without shear."""
        rotations = np.zeros((2, self.n, len(x)))
        for k, mode in enumerate(self.modes):
            if mode.direction in ("y", "z"):
                rotations[ROW[mode.direction] - 1, k] = section_rotation(mode.shape, x, d)
        return rotations

    def inertia_rotation(self, x: Array) -> Array:
        """Rotation (3, n, m) of the inertia of sections per mode."""
        rotation = np.zeros((3, self.n, len(x)))
        rotation[0] = self.rows(x, 0)[3]
        if self.data.rotary:
            psi_v, psi_w = self.bending_rotations(x, 0)
            rotation[1], rotation[2] = -psi_w, psi_v
            return rotation
        for k, mode in enumerate(self.modes):
            if mode.direction in ("y", "z"):
                rotation[2 if mode.direction == "y" else 1, k] = mode.frame_rotation
        return rotation

    def values_at(self, x: Array) -> ShapeValues:
        """Displacements and rotations per mode at sections x (m,)."""
        x = np.atleast_1d(np.asarray(x, dtype=float))
        slopes = self.rows(x, 1)
        fields, rates = (
            beam_kernels.evaluate(
                "section", {"values": self.rows(x, d), "slopes": self.bending_rotations(x, d)}
            )
            for d in range(2)
        )
        return ShapeValues(
            np.moveaxis(fields["phi"], 2, 0),
            np.moveaxis(fields["theta"], 2, 0),
            np.moveaxis(rates["theta"], 2, 0),
            slopes[0].T.copy(),
        )
