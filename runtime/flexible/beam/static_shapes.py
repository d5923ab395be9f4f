"""Shapes of a beam with given sections by cubic elements: static ones, and those of stepped beams.

Cubic elements are exact for beams that are loaded at their nodes only, so that the static shapes
are exact for sections constant between nodes.  Eigenfunctions of a stepped beam are found on a fine
division; they are a basis, and every integral over them is taken exactly of what they are.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence

import numpy as np

from mstmm.array_validation import Array

from .beam_data import BeamData
from .shape_functions import Piecewise

#: Row of `BeamData.stiffness` per direction.
_STIFFNESS = {"axial": 0, "twist": 1, "z": 2, "y": 3}
#: Elements per half-wave of the highest shape of a stepped beam.
_PER_WAVE = 8


def stiffness_of(data: BeamData, direction: str) -> Array:
    """EA, GI_t or EI of every piece in one direction."""
    return data.stiffness[_STIFFNESS[direction]]


# --- bending --------------------------------------------------------------------------------------


def bending_statics(
    data: BeamData, direction: str, base: float, others: Sequence[float]
) -> list[Piecewise]:
    """Unit deflection, then unit rotation times the length, of every other interface in turn.

    All interfaces (x in m) are otherwise held in place and direction; so is `base`.
    """
    nodes = np.array(sorted({*data.breaks, base, *others}))
    held = [node_at(nodes, x) for x in (base, *others)]
    fixed = [dof for i in held for dof in (2 * i, 2 * i + 1)]
    k, _ = bending_matrices(data, direction, nodes)
    return [
        _cubic(nodes, _displaced(k, fixed, dof, size))
        for i in held[1:]
        for dof, size in ((2 * i, 1.0), (2 * i + 1, 1.0 / data.length))
    ]


def end_slope(data: BeamData, direction: str, x: float) -> Piecewise:
    """Unit rotation times the length at the end x; both ends supported, the other free to turn."""
    nodes = np.array(data.breaks)
    turned = 2 * node_at(nodes, x) + 1
    k, _ = bending_matrices(data, direction, nodes)
    fixed = [0, len(k) - 2, turned]
    return _cubic(nodes, _displaced(k, fixed, turned, 1.0 / data.length))


def _displaced(k: Array, fixed: list[int], dof: int, size: float) -> Array:
    """Static displacements with one of the `fixed` coordinates at `size` and the others at zero."""
    u = np.zeros(len(k))
    u[dof] = size
    free = np.setdiff1d(np.arange(len(k)), fixed)
    if free.size:
        u[free] = np.linalg.solve(k[np.ix_(free, free)], -k[free, dof] * size)
    return u


def bending_eigenfunctions(
    data: BeamData, direction: str, count: int, clamped: Iterable[float] = (),
    supported: Iterable[float] = (), skip: int = 0,
) -> list[Piecewise]:  # fmt: skip
    """The first `count` eigenfunctions after `skip` of the stepped beam with sections clamped or
    simply supported; scaled to a mean square of one."""
    clamped, supported = list(clamped), list(supported)
    nodes = divided(data, count + skip, (*clamped, *supported))
    k, m = bending_matrices(data, direction, nodes)
    fixed = [2 * node_at(nodes, x) for x in (*clamped, *supported)]
    fixed += [2 * node_at(nodes, x) + 1 for x in clamped]
    vectors = _eigenvectors(k, m, fixed, skip + count)[:, skip:]
    return [_cubic(nodes, _scaled(nodes, u)) for u in vectors.T]


def bending_matrices(data: BeamData, direction: str, nodes: Array) -> tuple[Array, Array]:
    """Stiffness and mass of cubic elements; coordinates v, v' per node."""
    size = 2 * len(nodes)
    k, m = np.zeros((size, size)), np.zeros((size, size))
    middle = (nodes[1:] + nodes[:-1]) / 2
    at = data.piece(middle)
    bending, mass = stiffness_of(data, direction)[at], data.inertia[0][at]
    for i, h in enumerate(np.diff(nodes)):
        cut = slice(2 * i, 2 * i + 4)
        k[cut, cut] += bending[i] / h**3 * np.array(
            [[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h],
             [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]]
        )  # fmt: skip
        m[cut, cut] += mass[i] * h / 420 * np.array(
            [[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h],
             [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h * h, -22 * h, 4 * h * h]]
        )  # fmt: skip
    return k, m


def _cubic(nodes: Array, u: Array) -> Piecewise:
    """Cubics between nodes from v and v' at them."""
    h, v, s = np.diff(nodes), u[0::2], u[1::2]
    rise = (v[1:] - v[:-1]) / h
    return Piecewise(
        nodes,
        np.stack(
            [
                v[:-1],
                s[:-1],
                (3 * rise - 2 * s[:-1] - s[1:]) / h,
                (s[:-1] + s[1:] - 2 * rise) / h**2,
            ],
            axis=1,
        ),
    )


# --- twist and tension ----------------------------------------------------------------------------


def rod_statics(
    data: BeamData, direction: str, base: float, others: Sequence[float]
) -> list[Piecewise]:
    """Unit twist or axial displacement of every other interface in turn, the rest held."""
    nodes = np.array(sorted({*data.breaks, base, *others}))
    held = [node_at(nodes, x) for x in (base, *others)]
    compliance = (
        np.diff(nodes) / stiffness_of(data, direction)[data.piece((nodes[1:] + nodes[:-1]) / 2)]
    )
    along = np.concatenate([[0.0], np.cumsum(compliance)])  # straight in this coordinate
    order = np.argsort(nodes[held])
    places = along[np.array(held)[order]]
    shapes = []
    for i in held[1:]:
        at_places = (np.array(held)[order] == i).astype(float)
        values = np.interp(along, places, at_places)
        slopes = np.diff(values) / np.diff(nodes)
        shapes.append(Piecewise(nodes, np.stack([values[:-1], slopes], axis=1)))
    return shapes


def rod_eigenfunctions(
    data: BeamData, direction: str, count: int, fixed: Iterable[float] = (), skip: int = 0
) -> list[Piecewise]:
    """The first `count` eigenfunctions after `skip` of the stepped rod, by parabolic elements."""
    fixed = list(fixed)
    ends = divided(data, count + skip, fixed)
    nodes, k, m = rod_matrices(data, direction, ends)
    vectors = _eigenvectors(k, m, [node_at(nodes, x) for x in fixed], skip + count)[:, skip:]
    return [_parabola(ends, _scaled(ends, u)) for u in vectors.T]


def rod_matrices(data: BeamData, direction: str, ends: Array) -> tuple[Array, Array, Array]:
    """Places of the unknowns, stiffness and mass of parabolic elements between `ends`."""
    nodes = np.empty(2 * len(ends) - 1)
    nodes[0::2], nodes[1::2] = ends, (ends[1:] + ends[:-1]) / 2
    at = data.piece(nodes[1::2])
    mass = data.inertia[0] if direction == "axial" else data.inertia[1] + data.inertia[2]
    k, m = np.zeros((len(nodes), len(nodes))), np.zeros((len(nodes), len(nodes)))
    for i, h in enumerate(np.diff(ends)):
        cut = slice(2 * i, 2 * i + 3)
        k[cut, cut] += stiffness_of(data, direction)[at[i]] / (3 * h) * np.array(
            [[7, -8, 1], [-8, 16, -8], [1, -8, 7]]
        )  # fmt: skip
        m[cut, cut] += mass[at[i]] * h / 30 * np.array([[4, 2, -1], [2, 16, 2], [-1, 2, 4]])
    return nodes, k, m


def _parabola(ends: Array, u: Array) -> Piecewise:
    h, a, b, c = np.diff(ends), u[0:-1:2], u[1::2], u[2::2]
    return Piecewise(
        ends, np.stack([a, (4 * b - 3 * a - c) / h, 2 * (a + c - 2 * b) / h**2], axis=1)
    )


# --- what both need -------------------------------------------------------------------------------


def divided(data: BeamData, count: int, places: Iterable[float]) -> Array:
    """Nodes at all breaks and `places`, fine enough for `count` half-waves."""
    longest = data.length / (_PER_WAVE * (count + 2))
    marks = sorted({*data.breaks, *places})
    parts = [
        np.linspace(a, b, int(np.ceil((b - a) / longest)) + 1)[:-1]
        for a, b in itertools.pairwise(marks)
    ]
    return np.append(np.concatenate(parts), data.length)


def node_at(nodes: Array, x: float) -> int:
    """The node at a place, or nearest to it."""
    return int(np.argmin(np.abs(nodes - x)))


def _eigenvectors(k: Array, m: Array, fixed: Iterable[int], count: int) -> Array:
    """Columns of the `count` lowest eigenvectors with the coordinates `fixed` held."""
    free = np.setdiff1d(np.arange(len(k)), list(fixed))
    lower = np.linalg.cholesky(m[np.ix_(free, free)])
    reduced = np.linalg.solve(lower, np.linalg.solve(lower, k[np.ix_(free, free)]).T)
    _, vectors = np.linalg.eigh((reduced + reduced.T) / 2)
    full = np.zeros((len(k), count))
    full[free] = np.linalg.solve(lower.T, vectors[:, :count])
    return full


def _scaled(nodes: Array, u: Array) -> Array:
    """To a mean square of about one, and positive where the shape first moves."""
    values = u[::2]
    size = np.sqrt(np.trapezoid(values**2, nodes) / (nodes[-1] - nodes[0]))
    moving = np.flatnonzero(np.abs(values) > 1e-3 * np.abs(values).max())
    return u * (np.sign(values[moving[0]]) / size)
