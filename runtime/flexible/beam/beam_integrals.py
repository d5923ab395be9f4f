"""Mass, drag and stiffness of a beam: integrals of generated integrands, or lumped mass.

Both use Gauss quadrature along the pieces of the beam.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError

from ..modal_parts import MassPoint, Moments
from . import beam_kernels
from .beam_kernels import Row, Term, Terms, add_products, kernel_terms, known_factor, shape_rows
from .gauss_quadrature import gauss_rule
from .section_ports import BeamShapes, without_noise
from .shape_fields import DIRECTIONS


def mass_moments(shapes: BeamShapes) -> Moments:
    """Mass moments, including the rotary inertia of the sections in bending and twist."""
    x, w = shapes.rule()
    return _moments(shapes, shapes.data.inertia[:, shapes.data.piece(x)], x, w)


def drag_moments(shapes: BeamShapes) -> Moments | None:
    """Moments of the viscous drag per length; it acts on the axis alone; None without drag."""
    if shapes.data.drag == 0.0:
        return None
    x, w = shapes.rule()
    density = np.zeros((3, len(x)))
    density[0] = shapes.data.drag
    return _moments(shapes, density, x, w)


def stiffness(shapes: BeamShapes) -> Array:
    """Stiffness matrix K (n, n) from the strain energy."""
    x, w = shapes.rule()
    sections = shapes.data.stiffness[:, shapes.data.piece(x)]
    k = _integrals(shapes, np.concatenate([np.zeros((3, len(x))), sections]), x, w, ("K",))[0][0]
    k = (k + k.T) / 2
    scale = np.sqrt(np.abs(np.diag(k)))
    return without_noise(k, np.outer(scale, scale))


#: Groups of inputs in which the integrand is linear: position, section data, shape k, shape l.
_PAIR_GROUPS = (
    ("x",), ("inertia", "stiffness"),
    ("axis_k", "turn_k", "strain_k"), ("axis_l", "turn_l", "strain_l"),
)  # fmt: skip
#: The same for the second-order integrand; the last group is the second-order field.
_SECOND_ORDER_GROUPS = (("x",), ("inertia",), ("turn_k",), ("turn_l",), ("g", "h_turn"))


def _integrals(
    shapes: BeamShapes, data: Array, x: Array, w: Array, names: tuple[str, ...]
) -> list[Array]:
    """Integrals of the named outputs of the kernel "moments" over the beam.

    They are (..., n, n) for outputs of two shapes and (..., n, 1) for outputs of one.  `data`
    (9, m) are inertia and stiffness of the sections at the quadrature points.
    """
    values, slopes = shapes.rows(x, 0), shapes.rows(x, 1)
    rotations, (curved_y, curved_z) = (shapes.bending_rotations(x, d) for d in range(2))
    strain = np.stack([slopes[0], slopes[3], curved_z, curved_y, *(slopes[1:3] - rotations)])
    rows = shape_rows(np.concatenate([values[:3], shapes.inertia_rotation(x), strain]))
    all_shapes: Row = (np.zeros(1, dtype=np.intp), np.ones((1, len(x))))
    integrals = []
    for output in (kernel_terms("moments", *_PAIR_GROUPS)[name] for name in names):
        is_paired = any(term.entries[-1] is not None for whole in output.values() for term in whole)
        *_, last_index = output
        integral = np.zeros((*(k + 1 for k in last_index), shapes.n, shapes.n if is_paired else 1))
        for index, term in _indexed_terms(output):
            _, _, first, second = term.entries
            assert first is not None
            weights = known_factor(term, x[None], data * w)[None]
            add_products(
                integral[index][None],
                rows[first],
                all_shapes if second is None else rows[second],
                weights,
            )
        integrals.append(integral)
    return integrals


def _moments(shapes: BeamShapes, density: Array, x: Array, w: Array) -> Moments:
    rigid = beam_kernels.evaluate("rigid", {"x": x[None, :], "inertia": density})
    mass = float(rigid["mass"][0] @ w)
    first = rigid["first"] @ w
    second = _from_upper_triangle(rigid["second"] @ w)
    data = np.concatenate([density, np.zeros((len(shapes.data.stiffness), len(x)))])
    c, e, f = _integrals(shapes, data, x, w, ("C", "E", "F"))
    modal = np.sqrt(np.abs(np.einsum("aakk->k", f)))
    lever = np.sqrt(np.abs(np.diag(second)))
    g, moment = (
        second_moments(shapes, density, x, w) if shapes.stiffening else _zero_moments(shapes.n)
    )
    return Moments(
        mass=mass,
        first=first,
        second=second,
        C=without_noise(c[..., 0], np.sqrt(mass) * modal),
        E=without_noise(e[..., 0], lever[:, None, None] * modal),
        F=without_noise(f, np.outer(modal, modal)),
        G=g,
        X=moment,
    )


def second_moments(shapes: BeamShapes, density: Array, x: Array, w: Array) -> tuple[Array, Array]:
    """Moments G (3, n, n) and X (3, 3, n, n) of the second-order field.

    `density` (3, m) is given at the points `x` and weights `w` of a quadrature.
    """
    outputs = kernel_terms("second_moments", *_SECOND_ORDER_GROUPS)
    rotations = shape_rows(shapes.inertia_rotation(x))
    g, x_moment = _zero_moments(shapes.n)
    field_terms: dict[tuple[int | None, ...], list[tuple[Array, Term]]] = {}
    for integral, output in ((g, outputs["G"]), (x_moment, outputs["X"])):
        for index, term in _indexed_terms(output):
            _, _, first, second, field = term.entries
            if field is not None:
                field_terms.setdefault(term.entries[:2], []).append((integral[index], term))
            elif first is not None and second is not None:
                weights = known_factor(term, x[None], density * w)[None]
                add_products(integral[index][None], rotations[first], rotations[second], weights)
    point_weights = np.stack([
        known_factor(Term(1.0, places), x[None], density * w) for places in field_terms
    ])  # fmt: skip
    field_sums = shapes.second_order.sums(x, point_weights, carried=True)
    for entries, field in zip(field_terms.values(), field_sums, strict=True):
        for integral, term in entries:
            integral += term.factor * field[term.entries[-1]]
    rotation, length = shapes.second_scale, shapes.length
    arms = np.array([density[0] @ w * length**2, density[1] @ w, density[2] @ w])
    return (
        without_noise(_symmetrise(g), density[0] @ w * length * rotation),
        without_noise(_symmetrise(x_moment), arms[:, None, None, None] * rotation),
    )


def _indexed_terms(output: Terms) -> Iterator[tuple[tuple[int, ...], Term]]:
    return ((index, term) for index, whole in output.items() for term in whole)


def _symmetrise(pairs: Array) -> Array:
    """Symmetric part in the last two axes."""
    return (pairs + np.swapaxes(pairs, -1, -2)) / 2


def _zero_moments(n: int) -> tuple[Array, Array]:
    return np.zeros((3, n, n)), np.zeros((3, 3, n, n))


def _from_upper_triangle(upper: Array) -> Array:
    """Symmetric (3, 3) matrix from its upper triangle, row by row."""
    full = np.zeros((3, 3))
    full[np.triu_indices(3)] = upper
    return full + np.triu(full, 1).T


# --- lumped mass (quadrature) ---------------------------------------------------------------------

#: Largest count of second-order coefficients at all mass points: a quarter of a gigabyte, which
#: every evaluation of the accelerations reads.
_MAX_COEFFICIENTS = 2**25


def mass_points(shapes: BeamShapes) -> tuple[MassPoint, ...]:
    """Mass points of a beam, at Gauss points.

    There are 3 n + 4 for n shapes in the direction with the most, distributed by length over the
    pieces between section changes and ends.  Raises SceneError where they need too much memory.
    """
    x, lengths = _mass_slices(shapes)
    count = 6 * shapes.n**2 * len(x)
    if count > _MAX_COEFFICIENTS:
        raise SceneError(
            f'beam "{shapes.data.name}": {shapes.n} shapes need {len(x)} mass points (quadrature) '
            f"and {8e-6 * count:.0f} MB of second-order coefficients; expected "
            f"{8e-6 * _MAX_COEFFICIENTS:.0f} MB or less; give fewer shapes"
        )
    mass, yy, zz = shapes.data.inertia[:, shapes.data.piece(x)] * lengths
    inertia = [np.diag(diagonal) for diagonal in np.stack([yy + zz, zz, yy], axis=1)]
    return tuple(
        MassPoint(float(m), tensor, port)
        for m, tensor, port in zip(mass, inertia, shapes.ports(x), strict=True)
    )


def _mass_slices(shapes: BeamShapes) -> tuple[Array, Array]:
    """Positions of the mass points and lengths of their slices, m."""
    n = max((sum(m.direction == d for m in shapes.modes) for d in DIRECTIONS), default=0)
    positions, lengths = [], []
    places = sorted({*shapes.breaks, *(x for x, _ in shapes.data.ends.values())})
    for a, b in pairwise(places):
        nodes, weights = gauss_rule(max(4, int(np.ceil((3 * n + 4) * (b - a) / shapes.length))))
        positions.append(a + (b - a) * nodes)
        lengths.append((b - a) * weights)
    return np.concatenate(positions), np.concatenate(lengths)
