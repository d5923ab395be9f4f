"""The shapes of one beam together: their values at any section, and the section as a port."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ..modal_body import Array, ModalPort
from ..parts import slices
from . import kernels as beam_kernels
from .data import BeamData, BeamSections
from .gauss import density_of, gauss_between
from .second_order import SecondOrder
from .shapes import Shape

if TYPE_CHECKING:
    from .frames import Frame

#: Directions in the order of the modal coordinates.
DIRECTIONS = ("y", "z", "twist", "axial")
_ROW = {"axial": 0, "y": 1, "z": 2, "twist": 3}


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


class BeamShapes:
    """All shapes of a beam in the floating frame.

    `frames` says for each direction that has shapes where the floating frame is.
    """

    def __init__(
        self,
        data: BeamData,
        modes: tuple[Mode, ...],
        stiffening: bool,
        frames: Mapping[str, Frame],
    ) -> None:
        self.data, self.modes, self.stiffening = data, modes, stiffening
        inner = {x for mode in modes for x in mode.shape.breaks if 0 < x < data.length}
        inner |= {x for x, _ in data.ends.values() if 0 < x < data.length}
        places = sorted({*data.breaks, *inner})
        smallest = 1e-12 * data.length
        self.pieces = tuple(
            b for a, b in zip((-data.length, *places), places, strict=False) if b - a > smallest
        )  #: every place between which all shapes and sections are smooth
        self.density = density_of([mode.shape for mode in modes])
        self.second_order = SecondOrder(self, frames)

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
            values[_ROW[mode.direction], k] = mode.shape(x, d)
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

    # --- values ----------------------------------------------------------------------------------

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

    # --- ports -----------------------------------------------------------------------------------

    def section(self, x: float, rotation: Array | None = None) -> ModalPort:
        """The section at x as a port; exact zeros where the frame's conditions hold it."""
        port = next(self.ports(np.array([x])))
        return port if rotation is None else replace(port, rotation=rotation)

    def ports(self, x: Array) -> Iterator[ModalPort]:
        """The sections at x (m,), turned as the beam is."""
        values = self.at(x)
        for some in slices(len(x), 12 * self.n**2):
            second = self._second(x[some], np.eye(len(x[some])))
            for fields in zip(x[some], values.phi[some], values.theta[some], second, strict=True):
                yield self._port(*fields)

    def mean_section(self, start: float, end: float) -> ModalPort:
        """The mean of all sections between `start` and `end` (m): where a force that is the same
        per length on all of them acts."""
        inner = [x for x in self.pieces if start < x < end]
        x, w = gauss_between((start, *inner, end), self.density)
        w = w / (end - start)
        values = self.at(x)
        phi, theta = (np.einsum("m,mak->ak", w, v) for v in (values.phi, values.theta))
        return self._port((start + end) / 2, phi, theta, self._second(x, w[None])[0])

    def _second(self, x: Array, weights: Array) -> Array:
        """(p, 6, n, n) sums of what is of second order; zeros where the beam is linear."""
        if self.stiffening:
            return self.second_order.sums(x, weights)
        return np.zeros((len(weights), 6, self.n, self.n))

    def _port(self, x: float, phi: Array, theta: Array, second: Array) -> ModalPort:
        """A port from its values, rounding noise set to zero."""
        size, slope, _ = self._scales()
        return ModalPort(
            np.array([x, 0.0, 0.0]), np.eye(3), without_noise(phi, size),
            without_noise(theta, slope), self._cleaned(second),
        )  # fmt: skip

    def _cleaned(self, second: Array) -> Array:
        largest = np.repeat([self.length, 1.0], 3)[:, None, None] * self.second_scale
        return without_noise((second + np.swapaxes(second, 1, 2)) / 2, largest)

    @property
    def second_scale(self) -> Array:
        """(n, n) size of the rotation of second order per pair of modes, by which rounding noise is
        told."""
        return self._scales()[2]

    def _scales(self) -> tuple[Array, Array, Array]:
        """Largest displacement and rotation per mode, and the latter's products."""
        if not hasattr(self, "_largest"):
            x = np.unique(np.concatenate([self.rule()[0], np.asarray(self.pieces)]))
            values, slopes = self.rows(x, 0), self.rows(x, 1)
            size = np.abs(values[:3]).max(axis=(0, 2), initial=0.0)
            slope = np.maximum(np.abs(slopes[1:3]).max(axis=(0, 2), initial=0.0),
                               np.abs(values[3]).max(axis=1, initial=0.0))  # fmt: skip
            steep = np.maximum(slope, np.abs(slopes[0]).max(axis=1, initial=0.0))
            self._largest = (size, slope, np.outer(steep, steep))
        return self._largest


def without_noise(values: Array, scale: Array, share: float = 1e-13) -> Array:
    """Entries below `share` of their scale as exact zeros."""
    return np.where(np.abs(values) <= share * scale, 0.0, values)
