"""The sections of a beam as ports: its shapes with what is of second order in them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from mstmm.array_validation import Array

from ..memory_chunks import slices
from ..modal_port import ModalPort
from .beam_data import BeamData
from .frame_location import Frame
from .gauss_quadrature import gauss_between
from .second_order import SecondOrder
from .shape_fields import Mode, ShapeFields


class BeamShapes(ShapeFields):
    """All shapes of a beam in the floating frame, and its sections as ports.

    `frames` says for each direction that has shapes where the floating frame is.
    """

    def __init__(
        self,
        data: BeamData,
        modes: tuple[Mode, ...],
        stiffening: bool,
        frames: Mapping[str, Frame],
    ) -> None:
        super().__init__(data, modes)
        self.stiffening = stiffening
        self.second_order = SecondOrder(self, frames)

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
