"""Characteristic scales of modal coordinates."""

from __future__ import annotations

import numpy as np

from mstmm.array_validation import Array

from .modal_body import ModalBody


def modal_sizes(body: ModalBody) -> Array:
    """Characteristic modal amplitudes (n,), the smaller of two per mode.

    At one of them some section turns by 1 rad, at the other the mass moves (rms) by the radius of
    gyration of the body.
    """
    radius = radius_of_gyration(body) or 1.0
    displacement = np.sqrt(np.abs(np.diag(body.Mff)) / max(float(body.mass), 1e-300))
    rotation = np.max([np.abs(port.theta).max(axis=0) for port in body.ports.values()], axis=0)
    if body.shapes is not None:
        sections = body.shapes.values_at(np.linspace(0.0, body.shapes.length, 2 * body.n + 3)).theta
        rotation = np.maximum(rotation, np.abs(sections).max(axis=(0, 1)))
    return np.asarray(1.0 / np.maximum(np.maximum(displacement / radius, rotation), 1e-300))


def radius_of_gyration(body: ModalBody) -> float:
    """Radius of gyration about the origin of the floating frame, m."""
    return float(np.sqrt(np.trace(body.second) / max(float(body.mass), 1e-300)))
