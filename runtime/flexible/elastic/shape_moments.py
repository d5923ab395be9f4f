"""Mass moments of the shapes of an elastic body, and stiffening by the stresses of unit loads."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mstmm.array_validation import Array

from ..modal_parts import Truncation
from .craig_bampton import Reduction
from .finite_element_model import ElasticModel
from .interface_nodes import Port

# --- mass moments of displacement fields ----------------------------------------------------------
#
# With a scalar mass matrix M_s every moment is a product of M_s with nodal fields, because the
# coordinates are fields of the element space too (isoparametric elements).

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


# --- geometric stiffness --------------------------------------------------------------------------
#
# A modal body's displacement is u = phi eta - 1/2 eta^T g eta.  The virtual work of a load per
# volume rho b on the second-order part is -b . int rho g eta deta: the load adds b . int rho g to
# the stiffness.  The finite elements give it as the geometric stiffness of the static stresses
# under the load (tension stiffens), so that
#
#     G_a     = int rho g_a       = the stiffness under the load rho e_a
#     X_ab    = int rho r0_a g_b  = the stiffness under the load rho r0_a e_b
#     g_a at a port               = the stiffness under a unit force along a at the port
#
# and a unit acceleration of the frame along a, whose load is -rho e_a, adds -G_a.  In a tangent
# frame the held section carries the reaction.  In a mean frame every load is balanced by the
# inertia of the free body, so that G = 0 and the mass centre does not move to second order.


@dataclass(frozen=True)
class SecondOrder:
    """Moments of the second-order field: G (3, n, n) kg and X (3, 3, n, n) kg m.

    `ends` (6, n, n) are second-order displacement in 1/m and rotation of every port; the rotation
    is zero, because only unit forces are applied.
    """

    G: Array
    X: Array
    ends: Mapping[str, Array]


def second_order_moments(reduction: Reduction, ports: list[Port]) -> SecondOrder:
    """Moments of the second-order field; zeros for a model without stresses."""
    model, n = reduction.sections.model, reduction.shapes.shape[1]
    if model.stress is None:
        zeros = {port.name: np.zeros((6, n, n)) for port in ports}
        return SecondOrder(np.zeros((3, n, n)), np.zeros((3, 3, n, n)), zeros)
    moving = [p for p in ports if reduction.frame == "mean" or p is not reduction.held_port]
    loads = np.hstack([_body_loads(reduction), *(_port_loads(reduction, p) for p in moving)])
    if reduction.frame == "mean":
        loads = reduction.sections.relieve_inertia(loads, reduction.sections.rigid_displacements)
    static = reduction.sections.clamp([reduction.held_port]).statics(loads)
    stiffnesses = model.stress(reduction.sections.expand @ static, reduction.shapes)
    stiffnesses = (stiffnesses + stiffnesses.transpose(0, 2, 1)) / 2
    if reduction.frame == "mean":
        stiffnesses[:3] = 0.0  # only rounding: a uniformly accelerated free body is free of stress
    ends = {port.name: np.zeros((6, n, n)) for port in ports}
    for port, port_stiffness in zip(moving, stiffnesses[12:].reshape(-1, 3, n, n), strict=True):
        ends[port.name][:3] = port_stiffness
    return SecondOrder(stiffnesses[:3], stiffnesses[3:12].reshape(3, 3, n, n), ends)


def truncation(reduction: Reduction, ports: list[Port]) -> Truncation:
    """Truncation error of the shapes in the deflections under all loads on the body."""
    sections, shapes = reduction.sections, reduction.shapes
    inertia = -sections.expand.T @ (sections.model.mass @ shapes)
    wrenches = [sections.rows[port.name].toarray().T for port in ports]
    loads = np.hstack([*wrenches, _body_loads(reduction)[:, 3:], inertia])
    loads = sections.relieve_inertia(loads, sections.rigid_displacements)
    displacements = sections.clamp([reduction.held_port]).statics(loads)
    modal_loads = sections.unknowns(shapes).T @ loads
    modal_stiffness = sections.model.inertia[0, 0] * reduction.frequencies**2
    kept = modal_loads.T @ (modal_loads / modal_stiffness[:, None])
    count = 6 * len(ports)
    return Truncation(
        tuple(port.name for port in ports), loads[:, :count].T @ displacements, kept[:count]
    )


def _body_loads(reduction: Reduction) -> Array:
    """Body loads (w, 12): rho e_a, then rho r0_a e_b with b running fastest."""
    model = reduction.sections.model
    weights = [np.ones(len(model.nodes)), *model.nodes.T]
    columns = [model.body_load(b, weight) for weight in weights for b in range(3)]
    return np.asarray(reduction.sections.expand.T @ np.stack(columns, axis=1))


def _port_loads(reduction: Reduction, port: Port) -> Array:
    """Unit forces (w, 3) at the point of a port."""
    return np.asarray(reduction.sections.rows[port.name].toarray().T[:, :3])
