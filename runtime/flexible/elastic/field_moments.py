"""Mass moments of the displacement fields of an elastic body, as in `ModalBody`.

With a scalar mass matrix M_s every moment is a product of M_s with nodal fields, because the
coordinates are fields of the element space too (isoparametric elements).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mstmm.array_validation import Array

from .finite_element_model import ElasticModel

#: Largest difference, relative to the largest entry, of mass matrices that count as equal.
_SAME_MASS = 1e-9


@dataclass(frozen=True)
class FieldMoments:
    """Moments mass (kg), first (3,), second (3, 3), C (3, n), E (3, 3, n), F (3, 3, n, n).

    Defined as in `ModalBody`; `how` describes the source of E and F.
    """

    mass: float
    first: Array
    second: Array
    C: Array
    E: Array
    F: Array
    how: str


def field_moments(model: ElasticModel, shapes: Array) -> FieldMoments:
    """Mass moments of the shapes (u, n) of a model."""
    scalar, exact, how = model.scalar_mass, True, "scalar mass matrix: all moments exact"
    if scalar is None or model.unknowns == 6:
        scalar, exact = averaged_mass(model)
        how = "mass matrix equal in all directions: all moments exact"
    points, fields = model.nodes.T, model.components(shapes)
    weighted = np.stack([scalar @ fields[b] for b in range(3)])
    C = weighted.sum(axis=1)
    E = np.einsum("ai,bik->abk", points, weighted)
    F = np.einsum("aik,bil->abkl", fields, weighted)
    first = np.asarray(points @ scalar.sum(axis=1))
    second = points @ (scalar @ points.T)
    if exact:
        return FieldMoments(float(scalar.sum()), first, second, C, E, F, how)
    how = (
        "mass matrix not scalar: mass, C, int r x phi and the modal masses exact, the rest of E "
        "and F from the average over x, y and z"
    )
    return _correct_moments(model, shapes, E, F, how)


def averaged_mass(model: ElasticModel) -> tuple[Any, bool]:
    """Average (N, N) of the mass along x, y and z, and whether it represents the mass exactly.

    It does if the mass is equal along x, y and z and zero in rotations of nodes.
    """
    d, mass = model.unknowns, model.mass.tocsr()
    blocks = [mass[a::d][:, a::d] for a in range(3)]
    average = (blocks[0] + blocks[1] + blocks[2]) / 3
    largest = float(abs(average).max())
    differences = [abs(block - average).max() for block in blocks]
    differences += [abs(mass[a::d][:, b::d]).max() for a in range(3) for b in range(3) if a != b]
    differences += [abs(mass[a::d]).max() for a in range(3, d)]
    return average, float(max(differences)) <= _SAME_MASS * largest


def _correct_moments(
    model: ElasticModel, shapes: Array, E: Array, F: Array, how: str
) -> FieldMoments:
    """Moments with all parts replaced that rigid-body columns and shapes give exactly."""
    inertia, momentum = model.inertia, model.rigid_displacements.T @ (model.mass @ shapes)
    rotary = inertia[3:, 3:]
    second = np.trace(rotary) / 2 * np.eye(3) - rotary
    first = np.array([inertia[2, 4], inertia[0, 5], inertia[1, 3]]) * [-1, -1, -1]
    E = (E + E.transpose(1, 0, 2)) / 2
    for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        # (int r x phi)_c = E[a, b] - E[b, a]
        E[a, b] += momentum[3 + c] / 2
        E[b, a] -= momentum[3 + c] / 2
    modal = shapes.T @ (model.mass @ shapes)
    missing = ((modal + modal.T) / 2 - np.einsum("aakl->kl", F)) / 3
    F = F + np.eye(3)[:, :, None, None] * missing
    mass = float(np.trace(inertia[:3, :3]) / 3)
    return FieldMoments(mass, first, second, momentum[:3], E, F, how)
