"""What is known of an elastic body before it is reduced: matrices, nodes, and where they came from.

The discretised body of Rui, Wang, Zhang, section 8.2 (the mode matrix of (8.23), (8.24) acts on the
unknowns that are collected here).
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
    """Stiffness of a body under stress, between given shapes."""

    def __call__(self, static: Array, shapes: Array) -> Array:
        """(loads, n, n) N/m: int sigma_ij u_c,i u_c,j of shapes (u, n) under the stresses of the
        static displacements (u, loads), a tension being positive."""
        ...


@dataclass(frozen=True)
class ElasticModel:
    """An elastic body at rest and free, axes of its mesh (the body axes), SI units.

    Attributes:
        where: how messages call it, such as 'elastic "link" (link.npz)'.
        mass, stiffness: symmetric sparse (u, u), node by node: x, y, z of the first node (and three
            rotations where u = 6 N), then of the second.
        nodes: (N, 3) m.
        scalar_mass: sparse (N, N) kg with mass = scalar_mass (x) 1 over the three directions, if
            the mass is of that kind: isoparametric solids, lumped masses.
        sets: named sets of nodes.
        stress: the stiffness under stress, None where the matrices alone are known.
        faces: (m, 3) nodes of triangles on its outside, where there is a mesh.
        definite: True where no form of the matrices can be negative, by the way they were made.
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
        """Unknowns per node: 3, or 6 with rotations."""
        return int(self.mass.shape[0] // len(self.nodes))

    @cached_property
    def rigid(self) -> Array:
        """(u, 6): the unknowns in unit translations, then unit rotations about the origin."""
        return rigid_columns(self.nodes, self.unknowns)

    @cached_property
    def inertia(self) -> Array:
        """(6, 6): mass, first moments and inertia about the origin, as rigid^T mass rigid."""
        return np.asarray(self.rigid.T @ (self.mass @ self.rigid))

    @property
    def size(self) -> float:
        """The diagonal of the box around the nodes, m."""
        return float(np.linalg.norm(np.ptp(self.nodes, axis=0)))

    def components(self, shapes: Array) -> Array:
        """(3, N, n): displacements along x, y, z of shapes (u, n)."""
        by_node = shapes.reshape(len(self.nodes), self.unknowns, -1)
        return np.ascontiguousarray(by_node[:, :3].transpose(1, 0, 2))

    def body_load(self, direction: int, weight: Array) -> Array:
        """(u,): the load of a unit acceleration field, `weight` (N,) times the direction's axis."""
        field_ = np.zeros((len(self.nodes), self.unknowns))
        field_[:, direction] = weight
        return np.asarray(self.mass @ field_.reshape(-1))

    def refuse(self, what: str) -> SceneError:
        """The error that says what is wrong with this body."""
        return SceneError(f"{self.where}: {what}")


def rigid_columns(points: Array, unknowns: int) -> Array:
    """(points * unknowns, 6): u = d + theta x r at each point, its rotation theta (6 unknowns)."""
    n = len(points)
    columns = np.zeros((n, unknowns, 6))
    columns[:, :3, :3] = np.eye(3)
    for axis, unit in enumerate(np.eye(3)):
        columns[:, :3, 3 + axis] = np.cross(unit, points)
    if unknowns == 6:
        columns[:, 3:, 3:] = np.eye(3)
    return columns.reshape(n * unknowns, 6)
