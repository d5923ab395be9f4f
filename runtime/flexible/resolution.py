"""Highest frequency that shapes resolve, by comparison with the modes of a richer model."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mstmm.array_validation import Array

from .beam.boundary_conditions import BoundaryConditions
from .beam.section_ports import BeamShapes
from .beam.shape_fields import ROW
from .beam.shear_elements import condense_statically
from .beam.static_shapes import bending_matrices, element_nodes, nearest_node, rod_matrices

#: Largest relative error (too high) of a natural frequency whose mode counts as resolved.
_TOLERANCE = 0.05
#: Share of the first frequency below which the static response to a load is right to 12 %.
_QUASI_STATIC = 1 / 3


def resolved_frequency(found: Array, expected: Array) -> float:
    """Highest frequency (rad/s) up to which all modes are present and accurate to 5 %.

    `found` (n,) are natural frequencies of the shapes, `expected` those of the richer model, both
    ascending and without rigid motions.  A third of the first one if that is already wrong.
    """
    count = min(len(found), len(expected))
    if not count:
        return 0.0
    accurate = found[:count] <= (1 + _TOLERANCE) * expected[:count]
    resolved_count = count if accurate.all() else int(np.argmin(accurate))
    return (
        float(expected[resolved_count - 1])
        if resolved_count
        else float(_QUASI_STATIC * expected[0])
    )


def ritz_frequencies(stiffness: Array, mass: Array) -> Array:
    """Natural frequencies (m,) in the span of n assumed shapes, rad/s, ascending.

    `stiffness` and `mass` (n, n) are those of the shapes, which may be linearly dependent and
    contain no rigid motion.
    """
    size = 1 / np.sqrt(np.maximum(np.diag(stiffness), 1e-300))
    scale = np.outer(size, size)
    values, vectors = np.linalg.eigh(stiffness * scale)
    independent = values > 1e-12 * values.max(initial=0.0)
    basis = vectors[:, independent] / np.sqrt(values[independent])
    inverse = np.linalg.eigvalsh(basis.T @ (mass * scale) @ basis)
    moving = inverse > 1e-14 * inverse.max(initial=0.0)
    return np.asarray(np.sort(1 / np.sqrt(inverse[moving])))


# --- beams ----------------------------------------------------------------------------------------
#
# Per direction, the natural frequencies of the shapes (with the rigid motions of the beam) are
# compared with those of a fine finite-element model: once with all ends free but the inboard one,
# once with those ends fixed that carry heavy bodies or moments.  The true conditions lie between.


def beam_resolution(shapes: BeamShapes, conditions: BoundaryConditions) -> float:
    """Highest frequency (rad/s) resolved in all directions with shapes; infinite without any."""
    directions = dict.fromkeys(mode.direction for mode in shapes.modes)
    return min((_resolution(shapes, conditions, d) for d in directions), default=np.inf)


def _resolution(shapes: BeamShapes, conditions: BoundaryConditions, direction: str) -> float:
    indices = [k for k, mode in enumerate(shapes.modes) if mode.direction == direction]
    nodes = element_nodes(
        shapes.data, len(indices) + 2, (conditions.x, *(end.x for end in conditions.ends))
    )
    bends = direction in ("y", "z")
    if bends:
        k, m = condense_statically(*bending_matrices(shapes.data, direction, nodes), 2 * len(nodes))
    else:
        nodes, k, m = rod_matrices(shapes.data, direction, nodes)
    columns = _nodal_columns(shapes, indices, direction, nodes)
    lowest = np.inf
    for fixed in _fixed_unknowns(conditions, direction, nodes):
        rigid_count = _null_space(columns[fixed, len(indices) :]).shape[1]
        shapes_only, all_motions = (_frequencies(k, m, span, fixed) for span in (columns, None))
        resolved = resolved_frequency(shapes_only[rigid_count:], all_motions[rigid_count:])
        lowest = min(lowest, resolved or np.inf)
    return lowest


def _nodal_columns(shapes: BeamShapes, indices: list[int], direction: str, nodes: Array) -> Array:
    """Nodal values and bending slopes (unknowns, n) of the shapes, then of the rigid motions."""
    shape_values = shapes.rows(nodes, 0)[ROW[direction], indices].T
    if direction not in ("y", "z"):
        return np.column_stack([shape_values, np.ones(len(nodes))])
    columns = np.zeros((2 * len(nodes), len(indices) + 2))
    columns[0::2, :-2] = shape_values
    columns[1::2, :-2] = shapes.bending_rotations(nodes, 0)[ROW[direction] - 1, indices].T
    columns[0::2, -2], columns[0::2, -1], columns[1::2, -1] = 1.0, nodes, 1.0
    return columns


def _fixed_unknowns(
    conditions: BoundaryConditions, direction: str, nodes: Array
) -> Iterator[list[int]]:
    """Fixed unknowns: by the inboard hinge alone, then also by what the other ends carry."""
    bends = direction in ("y", "z")
    turns_freely = direction in conditions.free_rotations
    held_node = nearest_node(nodes, conditions.x)
    if bends:
        by_hinge = [] if conditions.has_free_translation else [2 * held_node]
        by_hinge += [] if turns_freely else [2 * held_node + 1]
    else:
        free = turns_freely if direction == "twist" else conditions.has_free_translation
        by_hinge = [] if free else [held_node]
    yield by_hinge
    by_loads = list(by_hinge)
    for end in conditions.ends:
        node = nearest_node(nodes, end.x)
        carries_moment = direction in end.moments
        if bends:
            by_loads += [2 * node] if end.is_heavy else []
            by_loads += [2 * node + 1] if carries_moment and end.is_heavy else []
        elif end.is_heavy:
            by_loads.append(node)
    if set(by_loads) != set(by_hinge):
        yield sorted(set(by_loads))


def _frequencies(k: Array, m: Array, columns: Array | None, fixed: list[int]) -> Array:
    """Natural frequencies (rad/s, ascending) with some unknowns fixed, in the span of `columns`.

    `columns` None stands for all motions.
    """
    free = np.setdiff1d(np.arange(len(k)), fixed)
    basis = np.eye(len(k))[:, free] if columns is None else columns @ _null_space(columns[fixed])
    if not basis.shape[1]:
        return np.zeros(0)
    lower = np.linalg.cholesky(basis.T @ m @ basis)
    half = np.linalg.solve(lower, basis.T @ k @ basis)
    squares = np.linalg.eigvalsh(np.linalg.solve(lower, half.T))
    return np.asarray(np.sqrt(np.maximum(squares, 0.0)))


def _null_space(rows: Array) -> Array:
    """Orthonormal null space (n, m) of `rows` (., n)."""
    if not len(rows):
        return np.eye(rows.shape[1])
    _, values, vectors = np.linalg.svd(rows)
    rank = int(np.count_nonzero(values > 1e-9 * values.max(initial=0.0)))
    return np.asarray(vectors[rank:].T)
