"""The shapes of one beam together: what they are at any section, to first order."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mstmm.array_validation import Array

from . import beam_kernels
from .beam_data import BeamData, BeamSections
from .gauss_quadrature import density_of, gauss_between
from .shape_functions import Shape

#: Directions in the order of the modal coordinates.
DIRECTIONS = ("y", "z", "twist", "axial")
#: Row of a direction in `ShapeFields.rows`.
ROW = {"axial": 0, "y": 1, "z": 2, "twist": 3}


@dataclass(frozen=True)
class Mode:
    """One modal coordinate: what it moves and by which shape.

    `turned` is the rotation (rad) per unit by which the frame's choice turned the whole shape
    back: sections turn by it with their inertia even where rotary inertia is left out.
    """

    name: str
    direction: str
    shape: Shape
    turned: float = 0.0


@dataclass(frozen=True)
class ShapeValues:
    """Values per mode at sections x (m,), frame axes; bending and axial modes per metre of eta."""

    phi: Array  #: (m, 3, n) displacement of the axis
    theta: Array  #: (m, 3, n) rotation vector of the section
    curvature: Array  #: (m, 3, n) d theta / dx: rate of twist, -w'', v''
    stretch: Array  #: (m, n) s'


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
        )  #: every place between which all shapes and sections are smooth
        self.density = density_of([mode.shape for mode in modes])

    @property
    def n(self) -> int:
        """Number of modes."""
        return len(self.modes)

    @property
    def length(self) -> float:
        return self.data.length

    @property
    def breaks(self) -> tuple[float, ...]:
        """Where the section changes, 0 and the length included (m)."""
        return self.data.breaks

    @property
    def rotary(self) -> bool:
        """True when the sections' rotary inertia takes part in bending."""
        return self.data.rotary

    def sections(self, x: Array) -> BeamSections:
        """Section data at every x."""
        return self.data.sections(np.asarray(x, dtype=float))

    def rule(self) -> tuple[Array, Array]:
        """Places and weights (m) of a quadrature along the beam that integrates products of shapes
        to rounding."""
        return gauss_between(self.pieces, self.density)

    def rows(self, x: Array, d: int) -> Array:
        """Derivative number d of s, v, w, psi per mode: (4, n, m)."""
        values = np.zeros((4, self.n, len(x)))
        for k, mode in enumerate(self.modes):
            values[ROW[mode.direction], k] = mode.shape(x, d)
        return values

    def carried(self, slopes: Array, twist: Array) -> Array:
        """Rotation of the sections' inertia per mode, (3, n, m), from d(s, v, w, psi)/dx."""
        turn = np.zeros((3, *twist.shape))
        turn[0] = twist
        if self.data.rotary:
            turn[1], turn[2] = -slopes[2], slopes[1]
            return turn
        for k, mode in enumerate(self.modes):
            if mode.direction in ("y", "z"):
                turn[2 if mode.direction == "y" else 1, k] = mode.turned
        return turn

    def at(self, x: Array) -> ShapeValues:
        """Values at sections x (m,)."""
        x = np.atleast_1d(np.asarray(x, dtype=float))
        values, slopes, bends = (self.rows(x, d) for d in range(3))
        here = beam_kernels.evaluate("section", {"values": values, "slopes": slopes[1:3]})
        change = beam_kernels.evaluate("section", {"values": slopes, "slopes": bends[1:3]})
        return ShapeValues(
            np.moveaxis(here["phi"], 2, 0),
            np.moveaxis(here["theta"], 2, 0),
            np.moveaxis(change["theta"], 2, 0),
            slopes[0].T.copy(),
        )
