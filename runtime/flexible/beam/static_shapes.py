"""Static shapes of a beam, and eigenfunctions of a stepped beam, by finite elements.

Cubic elements are exact for beams loaded at nodes only, so that the static shapes are exact for
sections that are constant between nodes.  Eigenfunctions of a stepped beam are computed with a fine
mesh.  As a basis they need no exact values: integrals over the piecewise polynomials are exact.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence

import numpy as np

from mstmm.array_validation import Array

from .beam_data import BeamData
from .shape_functions import Piecewise
from .shear_elements import sheared_shape, timoshenko_matrices

#: Row of `BeamData.stiffness` per direction.
_STIFFNESS = {"axial": 0, "twist": 1, "z": 2, "y": 3}
#: Rows of shear in `BeamData.stiffness` and of rotary inertia in `BeamData.inertia`.
_SHEAR, _ROTARY = {"y": 4, "z": 5}, {"y": 1, "z": 2}
#: Elements per half-wave of the highest shape of a stepped beam.
_ELEMENTS_PER_HALF_WAVE = 8


def direction_stiffness(data: BeamData, direction: str) -> Array:
    """Stiffness EA, GI_t or EI of every piece in one direction."""
    return data.stiffness[_STIFFNESS[direction]]


# --- bending --------------------------------------------------------------------------------------


def bending_static_shapes(
    data: BeamData, direction: str, base: float, others: Sequence[float]
) -> list[Piecewise]:
    """Static bending shapes: unit deflection and unit rotation times length of each interface.

    All other interfaces (x in m) are clamped, as is `base`.
    """
    nodes = np.array(sorted({*data.breaks, base, *others}))
    interface_nodes = [nearest_node(nodes, x) for x in (base, *others)]
    fixed = [dof for i in interface_nodes for dof in (2 * i, 2 * i + 1)]
    k, _ = bending_matrices(data, direction, nodes)
    return [
        _bending_shape(nodes, _static_displacement(k, fixed, dof, size))
        for i in interface_nodes[1:]
        for dof, size in ((2 * i, 1.0), (2 * i + 1, 1.0 / data.length))
    ]


def end_slope_shape(data: BeamData, direction: str, x: float) -> Piecewise:
    """Static shape with unit slope times length at the end x (m) of a simply supported beam."""
    nodes = np.array(data.breaks)
    slope_dof = 2 * nearest_node(nodes, x) + 1
    k, _ = bending_matrices(data, direction, nodes)
    fixed = [0, 2 * len(nodes) - 2, slope_dof]
    return _bending_shape(nodes, _static_displacement(k, fixed, slope_dof, 1.0 / data.length))


def _static_displacement(k: Array, fixed: list[int], dof: int, size: float) -> Array:
    """Static displacements with coordinate `dof` at `size` and the other `fixed` ones at zero."""
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
    """First `count` bending eigenfunctions of a stepped beam after the first `skip`.

    Sections (m) are `clamped` or simply `supported`; the mean square is scaled to one.
    """
    clamped, supported = list(clamped), list(supported)
    nodes = element_nodes(data, count + skip, (*clamped, *supported))
    k, m = bending_matrices(data, direction, nodes)
    fixed = [2 * nearest_node(nodes, x) for x in (*clamped, *supported)]
    fixed += [2 * nearest_node(nodes, x) + 1 for x in clamped]
    vectors = _eigenvectors(k, m, fixed, skip + count)[:, skip:]
    return [_bending_shape(nodes, _normalise(nodes, u)) for u in vectors.T]


def bending_matrices(data: BeamData, direction: str, nodes: Array) -> tuple[Array, Array]:
    """Stiffness and mass matrix of cubic elements; coordinates v, v' per node.

    With shear those of `timoshenko_matrices`: v, psi per node and three per element.
    """
    size = 2 * len(nodes)
    k, m = np.zeros((size, size)), np.zeros((size, size))
    middle = (nodes[1:] + nodes[:-1]) / 2
    pieces = data.piece(middle)
    bending, mass = direction_stiffness(data, direction)[pieces], data.inertia[0][pieces]
    if data.has_shear:
        shear, inertia = data.stiffness[_SHEAR[direction]], data.inertia[_ROTARY[direction]]
        return timoshenko_matrices(nodes, bending, shear[pieces], mass, inertia[pieces])
    for i, h in enumerate(np.diff(nodes)):
        dofs = slice(2 * i, 2 * i + 4)
        k[dofs, dofs] += bending[i] / h**3 * np.array(
            [[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h],
             [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]]
        )  # fmt: skip
        m[dofs, dofs] += mass[i] * h / 420 * np.array(
            [[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h],
             [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h * h, -22 * h, 4 * h * h]]
        )  # fmt: skip
    return k, m


def _bending_shape(nodes: Array, u: Array) -> Piecewise:
    """Shape of the coordinates of `bending_matrices`."""
    return _cubic(nodes, u) if len(u) == 2 * len(nodes) else sheared_shape(nodes, u)


def _cubic(nodes: Array, u: Array) -> Piecewise:
    """Piecewise cubic with values v and slopes v' at the nodes."""
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


def rod_static_shapes(
    data: BeamData, direction: str, base: float, others: Sequence[float]
) -> list[Piecewise]:
    """Static twist or axial shapes: unit displacement of each interface, the others fixed."""
    nodes = np.array(sorted({*data.breaks, base, *others}))
    interface_nodes = [nearest_node(nodes, x) for x in (base, *others)]
    stiffness = direction_stiffness(data, direction)[data.piece((nodes[1:] + nodes[:-1]) / 2)]
    # The shapes are piecewise linear in the coordinate int dx / stiffness.
    stretched_x = np.concatenate([[0.0], np.cumsum(np.diff(nodes) / stiffness)])
    order = np.argsort(nodes[interface_nodes])
    interface_x = stretched_x[np.array(interface_nodes)[order]]
    shapes = []
    for i in interface_nodes[1:]:
        interface_values = (np.array(interface_nodes)[order] == i).astype(float)
        values = np.interp(stretched_x, interface_x, interface_values)
        slopes = np.diff(values) / np.diff(nodes)
        shapes.append(Piecewise(nodes, np.stack([values[:-1], slopes], axis=1)))
    return shapes


def rod_eigenfunctions(
    data: BeamData, direction: str, count: int, fixed: Iterable[float] = (), skip: int = 0
) -> list[Piecewise]:
    """First `count` eigenfunctions of a stepped rod after the first `skip`."""
    fixed = list(fixed)
    ends = element_nodes(data, count + skip, fixed)
    nodes, k, m = rod_matrices(data, direction, ends)
    vectors = _eigenvectors(k, m, [nearest_node(nodes, x) for x in fixed], skip + count)[:, skip:]
    return [_parabola(ends, _normalise(ends, u)) for u in vectors.T]


def rod_matrices(data: BeamData, direction: str, ends: Array) -> tuple[Array, Array, Array]:
    """Nodes (m), stiffness and mass matrix of quadratic elements between `ends` (m)."""
    nodes = np.empty(2 * len(ends) - 1)
    nodes[0::2], nodes[1::2] = ends, (ends[1:] + ends[:-1]) / 2
    pieces = data.piece(nodes[1::2])
    mass = data.inertia[0] if direction == "axial" else data.inertia[1] + data.inertia[2]
    k, m = np.zeros((len(nodes), len(nodes))), np.zeros((len(nodes), len(nodes)))
    for i, h in enumerate(np.diff(ends)):
        dofs = slice(2 * i, 2 * i + 3)
        k[dofs, dofs] += direction_stiffness(data, direction)[pieces[i]] / (3 * h) * np.array(
            [[7, -8, 1], [-8, 16, -8], [1, -8, 7]]
        )  # fmt: skip
        m[dofs, dofs] += mass[pieces[i]] * h / 30 * np.array([[4, 2, -1], [2, 16, 2], [-1, 2, 4]])
    return nodes, k, m


def _parabola(ends: Array, u: Array) -> Piecewise:
    h, a, b, c = np.diff(ends), u[0:-1:2], u[1::2], u[2::2]
    return Piecewise(
        ends, np.stack([a, (4 * b - 3 * a - c) / h, 2 * (a + c - 2 * b) / h**2], axis=1)
    )


# --- shared functions -----------------------------------------------------------------------------


def element_nodes(data: BeamData, count: int, places: Iterable[float]) -> Array:
    """Nodes (m) at all breaks and `places`, fine enough for `count` half-waves."""
    longest = data.length / (_ELEMENTS_PER_HALF_WAVE * (count + 2))
    marks = sorted({*data.breaks, *places})
    pieces = [
        np.linspace(a, b, int(np.ceil((b - a) / longest)) + 1)[:-1]
        for a, b in itertools.pairwise(marks)
    ]
    return np.append(np.concatenate(pieces), data.length)


def nearest_node(nodes: Array, x: float) -> int:
    """Index of the node nearest to x (m)."""
    return int(np.argmin(np.abs(nodes - x)))


def _eigenvectors(k: Array, m: Array, fixed: Iterable[int], count: int) -> Array:
    """The `count` lowest eigenvectors as columns, with the coordinates `fixed` at zero."""
    free = np.setdiff1d(np.arange(len(k)), list(fixed))
    lower = np.linalg.cholesky(m[np.ix_(free, free)])
    reduced = np.linalg.solve(lower, np.linalg.solve(lower, k[np.ix_(free, free)]).T)
    _, vectors = np.linalg.eigh((reduced + reduced.T) / 2)
    full = np.zeros((len(k), count))
    full[free] = np.linalg.solve(lower.T, vectors[:, :count])
    return full


def _normalise(nodes: Array, u: Array) -> Array:
    """Nodal values scaled to a mean square of about one, positive where first nonzero."""
    values = u[: 2 * len(nodes) : 2]
    scale = np.sqrt(np.trapezoid(values**2, nodes) / (nodes[-1] - nodes[0]))
    nonzero = np.flatnonzero(np.abs(values) > 1e-3 * np.abs(values).max())
    return u * (np.sign(values[nonzero[0]]) / scale)
