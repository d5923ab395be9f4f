"""Geometric stiffening of an elastic body: its stiffness under the stresses of unit loads.

A modal body's displacement is u = phi eta - 1/2 eta^T g eta.  The virtual work of a load per volume
rho b on the second-order part is -b . int rho g eta deta: the load adds b . int rho g to the
stiffness.  The finite elements give the same stiffness as that of the static stresses under the
load (tension stiffens), so that

    G_a     = int rho g_a       = the stiffness under the load rho e_a
    X_ab    = int rho r0_a g_b  = the stiffness under the load rho r0_a e_b
    g_a at a port               = the stiffness under a unit force along a at the port

and a unit acceleration of the frame along a, whose load is -rho e_a, adds -G_a.  In a tangent frame
the held section carries the reaction.  In a mean frame every load is taken with the acceleration
that the free body would have under it, so that G = 0 and the mass centre stays in its place to
second order.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mstmm.array_validation import Array

from ..truncation import Truncation
from .craig_bampton import Reduction
from .interface_nodes import Port


@dataclass(frozen=True)
class SecondOrder:
    """G (3, n, n) kg, X (3, 3, n, n) kg m, and of every port (6, n, n) displacement of second order
    in 1/m and rotation (zero: the stresses are those of unit forces)."""

    G: Array
    X: Array
    ends: Mapping[str, Array]


def second_order_moments(reduction: Reduction, ports: list[Port]) -> SecondOrder:
    """The second-order fields' moments; zeros where the model has no stresses."""
    model, n = reduction.sections.model, reduction.shapes.shape[1]
    if model.stress is None:
        none = {port.name: np.zeros((6, n, n)) for port in ports}
        return SecondOrder(np.zeros((3, n, n)), np.zeros((3, 3, n, n)), none)
    moving = [p for p in ports if reduction.frame == "mean" or p is not reduction.held]
    loads = np.hstack([_body_loads(reduction), *(_port_loads(reduction, p) for p in moving)])
    if reduction.frame == "mean":
        loads = reduction.sections.relieved(loads, reduction.sections.rigid)
    static = reduction.sections.clamped([reduction.held]).statics(loads)
    families = model.stress(reduction.sections.expand @ static, reduction.shapes)
    families = (families + families.transpose(0, 2, 1)) / 2
    if reduction.frame == "mean":
        families[:3] = 0.0  # rounding: a free body under its own acceleration has no stress
    ends = {port.name: np.zeros((6, n, n)) for port in ports}
    for port, drawn in zip(moving, families[12:].reshape(-1, 3, n, n), strict=True):
        ends[port.name][:3] = drawn
    return SecondOrder(families[:3], families[3:12].reshape(3, 3, n, n), ends)


def truncation(reduction: Reduction, ports: list[Port]) -> Truncation:
    """What the shapes miss of the deflections under the loads that the body may have."""
    sections, shapes = reduction.sections, reduction.shapes
    inertia = -sections.expand.T @ (sections.model.mass @ shapes)
    wrenches = [sections.rows[port.name].toarray().T for port in ports]
    loads = np.hstack([*wrenches, _body_loads(reduction)[:, 3:], inertia])
    loads = sections.relieved(loads, sections.rigid)
    moved = sections.clamped([reduction.held]).statics(loads)
    pushed = sections.unknowns(shapes).T @ loads
    modal = sections.model.inertia[0, 0] * reduction.frequencies**2
    kept = pushed.T @ (pushed / modal[:, None])
    ends = 6 * len(ports)
    return Truncation(tuple(port.name for port in ports), loads[:, :ends].T @ moved, kept[:ends])


def _body_loads(reduction: Reduction) -> Array:
    """(w, 12): rho e_a, then rho r0_a e_b with b running fastest."""
    model = reduction.sections.model
    weights = [np.ones(len(model.nodes)), *model.nodes.T]
    columns = [model.body_load(b, weight) for weight in weights for b in range(3)]
    return np.asarray(reduction.sections.expand.T @ np.stack(columns, axis=1))


def _port_loads(reduction: Reduction, port: Port) -> Array:
    """(w, 3): unit forces at the port's point."""
    return np.asarray(reduction.sections.rows[port.name].toarray().T[:, :3])
