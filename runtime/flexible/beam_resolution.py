"""Up to which frequency the shapes of a beam hold, with its ends as the scene has them.

Per direction the natural motions of the shapes, and of the whole beam, are compared with those of a
fine division into elements: once with all ends but the held one free, once with those held by which
others hang that are heavy or take moments.  The true ends lie between.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mstmm.array_validation import Array

from .beam.boundary_conditions import BoundaryConditions
from .beam.section_ports import BeamShapes
from .beam.shape_fields import ROW
from .beam.static_shapes import bending_matrices, divided, node_at, rod_matrices
from .resolution import resolved_frequency


def beam_resolution(shapes: BeamShapes, held: BoundaryConditions) -> float:
    """rad/s up to which the shapes of a beam hold in all directions that it has some in; infinite
    without any."""
    directions = dict.fromkeys(mode.direction for mode in shapes.modes)
    return min((_of_direction(shapes, held, d) for d in directions), default=np.inf)


def _of_direction(shapes: BeamShapes, held: BoundaryConditions, direction: str) -> float:
    own = [k for k, mode in enumerate(shapes.modes) if mode.direction == direction]
    nodes = divided(shapes.data, len(own) + 2, (held.x, *(end.x for end in held.ends)))
    bends = direction in ("y", "z")
    if bends:
        k, m = bending_matrices(shapes.data, direction, nodes)
    else:
        nodes, k, m = rod_matrices(shapes.data, direction, nodes)
    columns = _columns(shapes, own, direction, nodes)
    least = np.inf
    for fixed in _conditions(held, direction, nodes):
        loose = _null_space(columns[fixed, len(own) :]).shape[1]
        both = (_frequencies(k, m, span, fixed)[loose:] for span in (columns, None))
        least = min(least, resolved_frequency(*both) or np.inf)
    return least


def _columns(shapes: BeamShapes, own: list[int], direction: str, nodes: Array) -> Array:
    """(unknowns, shapes and motions of the whole beam): values, and slopes of bending, at nodes."""
    values = shapes.rows(nodes, 0)[ROW[direction], own].T
    if direction not in ("y", "z"):
        return np.column_stack([values, np.ones(len(nodes))])
    found = np.zeros((2 * len(nodes), len(own) + 2))
    found[0::2, :-2], found[1::2, :-2] = values, shapes.rows(nodes, 1)[ROW[direction], own].T
    found[0::2, -2], found[0::2, -1], found[1::2, -1] = 1.0, nodes, 1.0
    return found


def _conditions(held: BoundaryConditions, direction: str, nodes: Array) -> Iterator[list[int]]:
    """Unknowns that are held: by the hinge alone, and by all that hangs on the beam too."""
    bends = direction in ("y", "z")
    turns = direction in held.turns
    first = node_at(nodes, held.x)
    if bends:
        hinge = [] if held.moves else [2 * first]
        hinge += [] if turns else [2 * first + 1]
    else:
        free = turns if direction == "twist" else held.moves
        hinge = [] if free else [first]
    yield hinge
    others = list(hinge)
    for end in held.ends:
        place = node_at(nodes, end.x)
        carries = direction in end.moments
        if bends:
            others += [2 * place] if end.heavy else []
            others += [2 * place + 1] if carries and end.heavy else []
        elif end.heavy:
            others.append(place)
    if set(others) != set(hinge):
        yield sorted(set(others))


def _frequencies(k: Array, m: Array, columns: Array | None, fixed: list[int]) -> Array:
    """rad/s, ascending, of motions that hold the unknowns `fixed`, within the span of `columns`
    (None: all motions)."""
    free = np.setdiff1d(np.arange(len(k)), fixed)
    kept = np.eye(len(k))[:, free] if columns is None else columns @ _null_space(columns[fixed])
    if not kept.shape[1]:
        return np.zeros(0)
    lower = np.linalg.cholesky(kept.T @ m @ kept)
    half = np.linalg.solve(lower, kept.T @ k @ kept)
    squares = np.linalg.eigvalsh(np.linalg.solve(lower, half.T))
    return np.asarray(np.sqrt(np.maximum(squares, 0.0)))


def _null_space(rows: Array) -> Array:
    """(n, m) orthonormal coefficients of n columns whose rows vanish."""
    if not len(rows):
        return np.eye(rows.shape[1])
    _, values, vectors = np.linalg.svd(rows)
    rank = int(np.count_nonzero(values > 1e-9 * values.max(initial=0.0)))
    return np.asarray(vectors[rank:].T)
