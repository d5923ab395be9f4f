"""What is seen of an elastic body: its nodes, how its shapes move them, and triangles between."""

from __future__ import annotations

from typing import Any

import numpy as np

from mstmm.array_validation import Array, Integers

from ..modal_body import Skin
from .finite_element_model import ElasticModel

#: Nodes that are kept, and how many cells of a grid are tried along the body at first.
MOST = 900
_FINEST, _COARSER = 120.0, 1.25


def skin(model: ElasticModel, shapes: Array) -> Skin:
    """The outside of a body whose shapes are (u, n), by a part of its nodes where they are many."""
    faces = np.zeros((0, 3), dtype=np.int64) if model.faces is None else model.faces
    kept = np.unique(faces) if len(faces) else np.arange(len(model.nodes))
    group = np.arange(len(kept))
    cell = model.size / _FINEST
    while len(np.unique(group)) > MOST:
        group = _together(model.nodes[kept], cell)
        cell *= _COARSER
    _, first, number = np.unique(group, return_index=True, return_inverse=True)
    place = np.zeros(len(model.nodes), dtype=np.int64)
    place[kept] = number
    moved = place[faces]
    apart = (moved != np.roll(moved, 1, axis=1)).all(axis=1)
    some = kept[first]
    return Skin(model.nodes[some], model.components(shapes)[:, some], moved[apart])


def _together(points: Array, cell: float) -> Integers:
    """(n,) the number of the cube of a grid in which each point lies."""
    cubes = np.floor((points - points.min(axis=0)) / cell).astype(np.int64)
    wide = cubes.max(axis=0) + 1
    return np.asarray((cubes[:, 0] * wide[1] + cubes[:, 1]) * wide[2] + cubes[:, 2])


def boundary_triangles(mesh: Any, scalar: Any) -> Integers:
    """(m, 3) triangles of nodes on the boundary of a mesh of scikit-fem, seen from outside
    anticlockwise; nodes halfway along edges divide them."""
    facets = mesh.boundary_facets()
    corners = mesh.facets[:, facets].T
    centres = mesh.p[:, mesh.t].mean(axis=1)[:, mesh.f2t[0, facets]].T
    corners = np.take_along_axis(corners, _around(mesh.p.T[corners], centres), axis=1)
    nodes = scalar.nodal_dofs[0][corners]
    after = np.roll(corners, -1, axis=1)
    if not len(scalar.edge_dofs):
        return _fan(nodes)
    middle = scalar.edge_dofs[0][_edges(mesh, corners, after)]
    before = np.roll(middle, 1, axis=1)
    cut = np.stack([nodes, middle, before], axis=2).reshape(-1, 3)
    return np.concatenate([cut, _fan(middle)])


def _around(points: Array, inside: Array) -> Integers:
    """(m, k) the order of points (m, k, 3) around their facets, seen from beyond `inside`."""
    middle = points.mean(axis=1)
    normal, first = middle - inside, points[:, 0] - middle
    second = np.cross(normal, first)
    way = points - middle[:, None]
    angles = np.arctan2(
        np.einsum("mkc,mc->mk", way, second) / np.linalg.norm(second, axis=1)[:, None],
        np.einsum("mkc,mc->mk", way, first) / np.linalg.norm(first, axis=1)[:, None],
    )
    return np.argsort(angles, axis=1)


def _edges(mesh: Any, ones: Integers, others: Integers) -> Integers:
    """Numbers of the edges between corners."""
    many = mesh.p.shape[1]

    def keys(a: Integers, b: Integers) -> Integers:
        return np.minimum(a, b) * many + np.maximum(a, b)

    known = keys(*mesh.edges)
    order = np.argsort(known)
    return np.asarray(order[np.searchsorted(known, keys(ones, others), sorter=order)])


def _fan(nodes: Integers) -> Integers:
    """Triangles of polygons (m, k)."""
    k = nodes.shape[1]
    parts = [nodes[:, [0, j, j + 1]] for j in range(1, k - 1)]
    return np.concatenate(parts)
