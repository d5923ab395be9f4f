"""Energies of a flexible body by mode, and its modal frequencies."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array

from .motion import Motion

if TYPE_CHECKING:
    from ...flexible.modal_body import ModalBody


def modal_mass(body: ModalBody) -> Array:
    """Modal mass matrix (n, n), int rho phi . phi in kg; for mass points, their sum."""
    if not body.points:
        return np.einsum("aakl->kl", body.F)
    total = np.zeros_like(body.K)
    for point in body.points:
        phi, theta = point.port.phi, point.port.theta
        total += point.mass * phi.T @ phi + theta.T @ point.inertia @ theta
    return total


def strain_shares(motion: Motion) -> Array:
    """Strain energy (n, modes) in J by mode, 1/2 eta_k (K eta)_k; the sum is the strain energy."""
    return 0.5 * motion.eta * (motion.eta @ motion.body.K)


def modal_energy(motion: Motion) -> Array:
    """Energy (n, modes) in J by mode: strain energy plus kinetic energy in the floating frame.

    1/2 eta_k (K eta)_k + 1/2 etad_k (M etad)_k.
    """
    kinetic = 0.5 * motion.etad * (motion.etad @ modal_mass(motion.body))
    return strain_shares(motion) + kinetic


def strain_energy(motion: Motion) -> Array:
    """Strain energy (n,) in J, 1/2 eta^T K eta."""
    return strain_shares(motion).sum(axis=1)


def modal_frequencies(body: ModalBody) -> Array:
    """Modal frequencies (n,) in rad/s with a fixed floating frame, ascending.

    Zeros where the modal mass cannot be distinguished from rounding.
    """
    try:
        lower = np.linalg.cholesky(modal_mass(body))
        half = np.linalg.solve(lower, body.K)
        squares = np.linalg.eigvalsh(np.linalg.solve(lower, half.T))
    except np.linalg.LinAlgError:
        squares = np.zeros(body.n)
    return np.sqrt(np.maximum(squares, 0.0))
