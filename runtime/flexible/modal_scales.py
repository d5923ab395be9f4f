"""Motions of order one of a flexible body: what a step in its coordinates is small or large
beside."""

from __future__ import annotations

import numpy as np

from mstmm.array_validation import Array

from .modal_body import ModalBody


def modal_sizes(body: ModalBody) -> Array:
    """(n,) modal coordinates at which a section turns by 1 rad, or the mass moves by the body's own
    radius of gyration."""
    radius = radius_of_gyration(body) or 1.0
    moved = np.sqrt(np.abs(np.diag(body.Mff)) / max(float(body.mass), 1e-300))
    turned = np.max([np.abs(p.theta).max(axis=0) for p in body.ports.values()], axis=0)
    if body.shapes is not None:
        inner = body.shapes.at(np.linspace(0.0, body.shapes.length, 2 * body.n + 3)).theta
        turned = np.maximum(turned, np.abs(inner).max(axis=(0, 1)))
    return np.asarray(1.0 / np.maximum(np.maximum(moved / radius, turned), 1e-300))


def radius_of_gyration(body: ModalBody) -> float:
    """Radius of gyration about the origin of the frame, m."""
    return float(np.sqrt(np.trace(body.second) / max(float(body.mass), 1e-300)))
