"""Finite-element model of an elastic body before reduction: matrices and nodes.

The discretised body of Rui, Wang, Zhang, section 8.2; the mode matrix of (8.23), (8.24) acts on its
unknowns.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from mstmm.array_validation import Array, Integers
from mstmm.errors import SceneError


class StressStiffness(Protocol):
    """Geometric stiffness of a body under static stresses, between given shapes."""

    def __call__(self, static: Array, shapes: Array) -> Array:
        """Geometric stiffness (loads, n, n), N/m, of shapes (u, n): int sigma_ij u_c,i u_c,j.

        The stresses sigma are those of the displacements `static` (u, loads), tension positive.
        """
        ...


@dataclass(frozen=True)
class ElasticModel:
    """Finite-element model of a free elastic body, axes of its mesh (the body axes), SI units.

    Attributes:
        where: name of the body in messages, such as 'elastic "link" (link.npz)'.
        mass, stiffness: symmetric sparse (u, u), node by node: x, y, z of the first node (and three
            rotations where u = 6 N), then of the second.
        nodes: (N, 3) m.
        scalar_mass: sparse (N, N) kg with mass = scalar_mass (x) 1 over the three directions, if
            it exists: isoparametric solids, lumped masses.
        sets: named sets of nodes.
        stress: the geometric stiffness, None if only matrices are given.
        faces: (m, 3) nodes of triangles on the surface, for meshes.
        definite: whether the matrices are positive semidefinite by construction.
        notes, warnings: sentences.
    """

    where: str
    mass: Any
    stiffness: Any
    nodes: Array
    scalar_mass: Any = None
    sets: Mapping[str, Integers] = field(default_factory=dict)
    stress: StressStiffness | None = None
    faces: Integers | None = None
    definite: bool = False
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    @property
    def unknowns(self) -> int:
        """Number of unknowns per node: 3, or 6 with rotations."""
        return int(self.mass.shape[0] // len(self.nodes))

    @cached_property
    def rigid_displacements(self) -> Array:
        """Unknowns T (u, 6) in unit translations, then unit rotations about the origin."""
        return rigid_columns(self.nodes, self.unknowns)

    @cached_property
    def inertia(self) -> Array:
        """Spatial inertia (6, 6) about the origin, T^T mass T with T the rigid displacements."""
        return np.asarray(self.rigid_displacements.T @ (self.mass @ self.rigid_displacements))

    @property
    def size(self) -> float:
        """Diagonal of the bounding box of the nodes, m."""
        return float(np.linalg.norm(np.ptp(self.nodes, axis=0)))

    def components(self, shapes: Array) -> Array:
        """Displacements (3, N, n) along x, y, z of shapes (u, n)."""
        by_node = shapes.reshape(len(self.nodes), self.unknowns, -1)
        return np.ascontiguousarray(by_node[:, :3].transpose(1, 0, 2))

    def body_load(self, direction: int, weight: Array) -> Array:
        """Inertia load (u,) of an acceleration field: `weight` (N,) along one direction."""
        acceleration = np.zeros((len(self.nodes), self.unknowns))
        acceleration[:, direction] = weight
        return np.asarray(self.mass @ acceleration.reshape(-1))

    def error(self, what: str) -> SceneError:
        """Error about this body."""
        return SceneError(f"{self.where}: {what}")


def rigid_columns(points: Array, unknowns: int) -> Array:
    """Rigid motions u = d + theta x r at points, as columns (points * unknowns, 6)."""
    n = len(points)
    columns = np.zeros((n, unknowns, 6))
    columns[:, :3, :3] = np.eye(3)
    for axis, unit in enumerate(np.eye(3)):
        columns[:, :3, 3 + axis] = np.cross(unit, points)
    if unknowns == 6:
        columns[:, 3:, 3:] = np.eye(3)
    return columns.reshape(n * unknowns, 6)
