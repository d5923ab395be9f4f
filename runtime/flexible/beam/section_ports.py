"""Sections of a beam as ports: its shapes to first and second order."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from mstmm.array_validation import Array

from ..modal_parts import ModalPort, chunk_slices
from .beam_data import BeamData, Frame
from .gauss_quadrature import gauss_points
from .second_order import SecondOrder
from .shape_fields import Mode, ShapeFields


class BeamShapes(ShapeFields):
    """All shapes of a beam in the floating frame, and its sections as ports.

    `frames` locates the floating frame for each direction with shapes.
    """

    def __init__(
        self, data: BeamData, modes: tuple[Mode, ...], stiffening: bool, frames: Mapping[str, Frame]
    ) -> None:
        super().__init__(data, modes)
        self.stiffening = stiffening
        self.second_order = SecondOrder(self, frames)

    def section(self, x: float, rotation: Array | None = None) -> ModalPort:
        """Section at x (m) as a port; exactly zero where the frame conditions fix it."""
        port = next(self.ports(np.array([x])))
        return port if rotation is None else replace(port, rotation=rotation)

    def ports(self, x: Array) -> Iterator[ModalPort]:
        """Sections at x (m,) as ports, with the axes of the beam."""
        values = self.values_at(x)
        for chunk in chunk_slices(len(x), 12 * self.n**2):
            second = self._second_order_sums(x[chunk], np.eye(len(x[chunk])))
            phi, theta = values.phi[chunk], values.theta[chunk]
            for fields in zip(x[chunk], phi, theta, second, strict=True):
                yield self._port(*fields)

    def mean_section(self, start: float, end: float) -> ModalPort:
        """Mean of the sections between `start` and `end` (m), on which a uniform line load acts."""
        inner = [x for x in self.pieces if start < x < end]
        x, w = gauss_points((start, *inner, end), self.density)
        w = w / (end - start)
        values = self.values_at(x)
        phi, theta = (np.einsum("m,mak->ak", w, v) for v in (values.phi, values.theta))
        return self._port((start + end) / 2, phi, theta, self._second_order_sums(x, w[None])[0])

    def _second_order_sums(self, x: Array, weights: Array) -> Array:
        """Weighted sums (p, 6, n, n) of the second-order field; zeros for a linear beam."""
        if self.stiffening:
            return self.second_order.sums(x, weights)
        return np.zeros((len(weights), 6, self.n, self.n))

    def _port(self, x: float, phi: Array, theta: Array, second: Array) -> ModalPort:
        """Port with rounding errors set to zero."""
        displacement_scale, rotation_scale, _ = self._noise_scales()
        return ModalPort(
            np.array([x, 0.0, 0.0]), np.eye(3), without_noise(phi, displacement_scale),
            without_noise(theta, rotation_scale), self._clean_second_order(second),
        )  # fmt: skip

    def _clean_second_order(self, second: Array) -> Array:
        scale = np.repeat([self.length, 1.0], 3)[:, None, None] * self.second_scale
        return without_noise((second + np.swapaxes(second, 1, 2)) / 2, scale)

    @property
    def second_scale(self) -> Array:
        """Scale (n, n) of the second-order rotation per pair of modes, for rounding errors."""
        return self._noise_scales()[2]

    def _noise_scales(self) -> tuple[Array, Array, Array]:
        """Largest displacement and rotation per mode, and products of the steepest slopes."""
        if not hasattr(self, "_largest"):
            x = np.unique(np.concatenate([self.rule()[0], np.asarray(self.pieces)]))
            values, slopes = self.rows(x, 0), self.rows(x, 1)
            displacement = np.abs(values[:3]).max(axis=(0, 2), initial=0.0)
            rotation = np.maximum(np.abs(slopes[1:3]).max(axis=(0, 2), initial=0.0),
                               np.abs(values[3]).max(axis=1, initial=0.0))  # fmt: skip
            steepest = np.maximum(rotation, np.abs(slopes[0]).max(axis=1, initial=0.0))
            self._largest = (displacement, rotation, np.outer(steepest, steepest))
        return self._largest


def without_noise(values: Array, scale: Array, share: float = 1e-13) -> Array:
    """Values with entries below `share` of their scale set to zero."""
    return np.where(np.abs(values) <= share * scale, 0.0, values)
