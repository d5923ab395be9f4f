"""The shapes of one beam together: their values at any section, and the section as a port."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np

from ..modal_body import Array, ModalPort
from . import kernels as beam_kernels
from .data import BeamData, BeamSections
from .shapes import Shape

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
    shortening: Array  #: (m, n, n) along x: u = phi eta - 1/2 eta^T shortening eta


@lru_cache(maxsize=64)
def gauss(points: int) -> tuple[Array, Array]:
    """Nodes and weights of the Gauss rule on 0 to 1."""
    nodes, weights = np.polynomial.legendre.leggauss(points)
    return (nodes + 1.0) / 2.0, weights / 2.0


def gauss_between(places: Iterable[float], density: float) -> tuple[Array, Array]:
    """Gauss points and weights (m) between neighbouring places, for products of two shapes with
    `density` half-waves per metre; long pieces are cut, for rules of high order lose digits."""
    xs, ws = [], []
    for a, b in pairwise(places):
        cuts = max(1, int(np.ceil((b - a) * density / _WAVES)))
        h = (b - a) / cuts
        nodes, weights = gauss(8 + int(np.ceil(3.0 * h * density)))
        xs.append((a + h * (np.arange(cuts)[:, None] + nodes)).ravel())
        ws.append(np.tile(h * weights, cuts))
    return np.concatenate(xs), np.concatenate(ws)


#: Half-waves that one Gauss rule covers at most.
_WAVES = 8.0


class BeamShapes:
    """All shapes of a beam in the floating frame.

    `origin` is the section whose shortening is zero, None where the mean over the mass is.
    """

    def __init__(
        self,
        data: BeamData,
        modes: tuple[Mode, ...],
        stiffening: bool,
        origin: float | None = 0.0,
    ) -> None:
        self.data, self.modes, self.stiffening = data, modes, stiffening
        inner = {x for mode in modes for x in mode.shape.breaks if 0 < x < data.length}
        inner |= {x for x, _ in data.ends.values() if 0 < x < data.length}
        places = sorted({*data.breaks, *inner})
        smallest = 1e-12 * data.length
        self.pieces = tuple(
            b for a, b in zip((-data.length, *places), places, strict=False) if b - a > smallest
        )  #: every place between which all shapes and sections are smooth
        self.density = max((mode.shape.density for mode in modes), default=0.0)
        self._offset = np.zeros((self.n, self.n))
        if origin is None:
            x, w = self.rule()
            mass = w * data.sections(x).mass_per_length
            self._offset = np.einsum("m,mkl->kl", mass, self._shortening(x)) / mass.sum()
        elif origin != 0.0:
            self._offset = self._shortening(np.array([origin]))[0]

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
            self._shortening(x) - self._offset,
        )

    def _shortening(self, x: Array) -> Array:
        """int_0^x of the kernel's shortening rate, (m, n, n)."""
        order = np.argsort(x, kind="stable")
        ends = np.union1d(np.clip(x, 0.0, self.length), self.pieces)
        total, table = np.zeros((self.n, self.n)), {float(ends[0]): np.zeros((self.n, self.n))}
        slopes = self._slopes_between(ends)
        for b, (places, weights) in zip(ends[1:], slopes, strict=True):
            total = total + np.einsum("m,mkl->kl", weights, places)
            table[float(b)] = total
        result = np.zeros((len(x), self.n, self.n))
        for i in order:
            result[i] = table[float(np.clip(x[i], 0.0, self.length))]
        return result

    def _slopes_between(self, ends: Array) -> list[tuple[Array, Array]]:
        """(rate (m, n, n), weights) of each interval between neighbouring ends."""
        rules = [gauss_between(pair, self.density) for pair in pairwise(ends)]
        rates = self.shortening_rate(np.concatenate([places for places, _ in rules]))
        cuts = np.cumsum([len(places) for places, _ in rules])[:-1]
        pieces = np.split(rates, cuts)
        return [(rate, weights) for rate, (_, weights) in zip(pieces, rules, strict=True)]

    def shortening_rate(self, x: Array) -> Array:
        """d shortening / dx by the kernel, (m, n, n)."""
        slopes = self.rows(x, 1)[1:3]
        inputs = {"slope_k": slopes[:, :, None, :], "slope_l": slopes[:, None, :, :]}
        return np.moveaxis(beam_kernels.evaluate("shortening", inputs)["g"][0], 2, 0)

    # --- ports -----------------------------------------------------------------------------------

    def section(self, x: float, rotation: Array | None = None) -> ModalPort:
        """The section at x as a port; exact zeros where the frame's conditions hold it."""
        values = self.at(np.array([x]))
        turn = np.eye(3) if rotation is None else rotation
        return self.port(x, turn, values.phi[0], values.theta[0], values.shortening[0])

    def mean_section(self, start: float, end: float) -> ModalPort:
        """The mean of all sections between `start` and `end` (m): where a force that is the same
        per length on all of them acts."""
        inner = [x for x in self.pieces if start < x < end]
        x, w = gauss_between((start, *inner, end), self.density)
        w = w / (end - start)
        values = self.at(x)
        phi, theta, shortening = (
            np.einsum("m,m...->...", w, v) for v in (values.phi, values.theta, values.shortening)
        )
        return self.port((start + end) / 2, np.eye(3), phi, theta, shortening)

    def port(self, x: float, turn: Array, phi: Array, theta: Array, along: Array) -> ModalPort:
        """A port from its values, rounding noise set to zero."""
        size, slope, short = self._scales()
        shortening = np.zeros((3, self.n, self.n))
        if self.stiffening:
            shortening[0] = without_noise((along + along.T) / 2, short)
        return ModalPort(
            np.array([x, 0.0, 0.0]), turn, without_noise(phi, size), without_noise(theta, slope),
            shortening,
        )  # fmt: skip

    def _scales(self) -> tuple[Array, Array, Array]:
        """Largest displacement, rotation per mode and shortening per pair of modes."""
        if not hasattr(self, "_largest"):
            x = np.unique(np.concatenate([self.rule()[0], np.asarray(self.pieces)]))
            values, slopes = self.rows(x, 0), self.rows(x, 1)
            size = np.abs(values[:3]).max(axis=(0, 2), initial=0.0)
            slope = np.maximum(np.abs(slopes[1:3]).max(axis=(0, 2), initial=0.0),
                               np.abs(values[3]).max(axis=1, initial=0.0))  # fmt: skip
            stretch = np.abs(slopes[1:3]).max(axis=(0, 2), initial=0.0)
            self._largest = (size, slope, self.length * np.outer(stretch, stretch))
        return self._largest


def without_noise(values: Array, scale: Array, share: float = 1e-13) -> Array:
    """Entries below `share` of their scale as exact zeros."""
    return np.where(np.abs(values) <= share * scale, 0.0, values)
