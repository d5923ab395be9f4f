"""Surface of an elastic body for display: nodes, their displacements and triangles."""

from __future__ import annotations

from typing import Any

import numpy as np

from mstmm.array_validation import Array, Integers

from ..modal_body import Skin
from .finite_element_model import ElasticModel

#: Largest number of surface nodes; grid cells along the body at first, and their growth factor.
MAX_NODES = 900
_INITIAL_CELLS, _COARSENING = 120.0, 1.25


def skin(model: ElasticModel, shapes: Array) -> Skin:
    """Surface of a body with shapes (u, n), with at most about MAX_NODES of its nodes."""
    faces = np.zeros((0, 3), dtype=np.int64) if model.faces is None else model.faces
    kept = np.unique(faces) if len(faces) else np.arange(len(model.nodes))
    group = np.arange(len(kept))
    cell = model.size / _INITIAL_CELLS
    while len(np.unique(group)) > MAX_NODES:
        group = _cell_numbers(model.nodes[kept], cell)
        cell *= _COARSENING
    _, first, number = np.unique(group, return_index=True, return_inverse=True)
    index = np.zeros(len(model.nodes), dtype=np.int64)
    index[kept] = number
    triangles = index[faces]
    is_proper = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    nodes = kept[first]
    return Skin(model.nodes[nodes], model.components(shapes)[:, nodes], triangles[is_proper])


def _cell_numbers(points: Array, cell: float) -> Integers:
    """Number (n,) of the grid cell that contains each point."""
    cubes = np.floor((points - points.min(axis=0)) / cell).astype(np.int64)
    counts = cubes.max(axis=0) + 1
    return np.asarray((cubes[:, 0] * counts[1] + cubes[:, 1]) * counts[2] + cubes[:, 2])


def boundary_triangles(mesh: Any, scalar: Any) -> Integers:
    """Triangles (m, 3) of nodes on the surface of a scikit-fem mesh, anticlockwise outside.

    Facets are divided at the midside nodes of their edges.
    """
    facets = mesh.boundary_facets()
    corners = mesh.facets[:, facets].T
    centres = mesh.p[:, mesh.t].mean(axis=1)[:, mesh.f2t[0, facets]].T
    corners = np.take_along_axis(corners, _order_around(mesh.p.T[corners], centres), axis=1)
    nodes = scalar.nodal_dofs[0][corners]
    next_corners = np.roll(corners, -1, axis=1)
    if not len(scalar.edge_dofs):
        return _fan_triangles(nodes)
    midpoints = scalar.edge_dofs[0][_edge_numbers(mesh, corners, next_corners)]
    previous_midpoints = np.roll(midpoints, 1, axis=1)
    corner_triangles = np.stack([nodes, midpoints, previous_midpoints], axis=2).reshape(-1, 3)
    return np.concatenate([corner_triangles, _fan_triangles(midpoints)])


def _order_around(points: Array, inside: Array) -> Integers:
    """Anticlockwise order (m, k) of the corners (m, k, 3) of facets; `inside` (m, 3) is behind."""
    middle = points.mean(axis=1)
    normal, first = middle - inside, points[:, 0] - middle
    second = np.cross(normal, first)
    arms = points - middle[:, None]
    angles = np.arctan2(
        np.einsum("mkc,mc->mk", arms, second) / np.linalg.norm(second, axis=1)[:, None],
        np.einsum("mkc,mc->mk", arms, first) / np.linalg.norm(first, axis=1)[:, None],
    )
    return np.argsort(angles, axis=1)


def _edge_numbers(mesh: Any, starts: Integers, ends: Integers) -> Integers:
    """Numbers of the edges between pairs of corners."""
    count = mesh.p.shape[1]

    def keys(a: Integers, b: Integers) -> Integers:
        return np.minimum(a, b) * count + np.maximum(a, b)

    edge_keys = keys(*mesh.edges)
    order = np.argsort(edge_keys)
    return np.asarray(order[np.searchsorted(edge_keys, keys(starts, ends), sorter=order)])


def _fan_triangles(nodes: Integers) -> Integers:
    """Triangles (., 3) of polygons (m, k)."""
    k = nodes.shape[1]
    parts = [nodes[:, [0, j, j + 1]] for j in range(1, k - 1)]
    return np.concatenate(parts)
