"""Integrals over a beam: the generated integrands by Gauss quadrature along its pieces."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mstmm.array_validation import Array

from ..mass_moments import Moments
from . import beam_kernels
from .multilinear import Row, Term, Terms, add_products, known, rows_of, terms
from .section_ports import BeamShapes, without_noise


def mass_moments(shapes: BeamShapes) -> Moments:
    """Moments of the mass, with what bending and twist turn of the sections' inertia."""
    x, w = shapes.rule()
    return _moments(shapes, shapes.data.inertia[:, shapes.data.piece(x)], x, w)


def drag_moments(shapes: BeamShapes) -> Moments | None:
    """Moments of the viscous drag per length, which acts on the axis alone; None without drag."""
    if shapes.data.drag == 0.0:
        return None
    x, w = shapes.rule()
    density = np.zeros((3, len(x)))
    density[0] = shapes.data.drag
    return _moments(shapes, density, x, w)


def stiffness(shapes: BeamShapes) -> Array:
    """K (n, n) from the strain energy."""
    x, w = shapes.rule()
    data = shapes.data.stiffness[:, shapes.data.piece(x)]
    k = _integrals(shapes, np.concatenate([np.zeros((3, len(x))), data]), x, w, ("K",))[0][0]
    k = (k + k.T) / 2
    size = np.sqrt(np.abs(np.diag(k)))
    return without_noise(k, np.outer(size, size))


#: What the integrand of two shapes is linear in: in the place, the section, shape k and shape l.
_FIRST = (
    ("x",), ("inertia", "stiffness"),
    ("axis_k", "turn_k", "strain_k"), ("axis_l", "turn_l", "strain_l"),
)  # fmt: skip
#: The same of second order; last the displacement and rotation of second order at the section.
_SECOND = (("x",), ("inertia",), ("turn_k",), ("turn_l",), ("g", "h_turn"))


def _integrals(
    shapes: BeamShapes, data: Array, x: Array, w: Array, names: tuple[str, ...]
) -> list[Array]:
    """Integrals (..., n, n) of outputs of the kernel of two shapes, (..., n, 1) of those that one
    shape has alone; `data` (7, m) are inertia and stiffness of the sections."""
    values, slopes, bends = (shapes.rows(x, d) for d in range(3))
    strain = np.stack([slopes[0], slopes[3], bends[2], bends[1]])
    rows = rows_of(np.concatenate([values[:3], shapes.carried(slopes, values[3]), strain]))
    every: Row = (np.zeros(1, dtype=np.intp), np.ones((1, len(x))))
    found = []
    for output in (terms("moments", *_FIRST)[name] for name in names):
        paired = any(term.entries[-1] is not None for whole in output.values() for term in whole)
        *_, last = output
        total = np.zeros((*(k + 1 for k in last), shapes.n, shapes.n if paired else 1))
        for index, term in _entries(output):
            _, _, k, other = term.entries
            assert k is not None
            weights = known(term, x[None], data * w)[None]
            add_products(
                total[index][None], rows[k], every if other is None else rows[other], weights
            )
        found.append(total)
    return found


def _moments(shapes: BeamShapes, density: Array, x: Array, w: Array) -> Moments:
    rigid = beam_kernels.evaluate("rigid", {"x": x[None, :], "inertia": density})
    mass = float(rigid["mass"][0] @ w)
    first = rigid["first"] @ w
    second = _symmetric(rigid["second"] @ w)
    data = np.concatenate([density, np.zeros((4, len(x)))])
    c, e, f = _integrals(shapes, data, x, w, ("C", "E", "F"))
    modal = np.sqrt(np.abs(np.einsum("aakk->k", f)))
    lever = np.sqrt(np.abs(np.diag(second)))
    g, moment = second_moments(shapes, density, x, w) if shapes.stiffening else _none(shapes.n)
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
    """G (3, n, n) and X (3, 3, n, n) of the second-order field under a density (3, m) at the points
    and weights of a quadrature."""
    outputs = terms("second_moments", *_SECOND)
    turn = rows_of(shapes.carried(shapes.rows(x, 1), shapes.rows(x, 0)[3]))
    g, lever = _none(shapes.n)
    of_field: dict[tuple[int | None, ...], list[tuple[Array, Term]]] = {}
    for total, output in ((g, outputs["G"]), (lever, outputs["X"])):
        for index, term in _entries(output):
            _, _, k, other, field = term.entries
            if field is not None:
                of_field.setdefault(term.entries[:2], []).append((total[index], term))
            elif k is not None and other is not None:
                weights = known(term, x[None], density * w)[None]
                add_products(total[index][None], turn[k], turn[other], weights)
    of_places = np.stack([
        known(Term(1.0, places), x[None], density * w) for places in of_field
    ])  # fmt: skip
    sums = shapes.second_order.sums(x, of_places, carried=True)
    for entries, field in zip(of_field.values(), sums, strict=True):
        for total, term in entries:
            total += term.factor * field[term.entries[-1]]
    turned, length = shapes.second_scale, shapes.length
    arms = np.array([density[0] @ w * length**2, density[1] @ w, density[2] @ w])
    return (
        without_noise(_halved(g), density[0] @ w * length * turned),
        without_noise(_halved(lever), arms[:, None, None, None] * turned),
    )


def _entries(output: Terms) -> Iterator[tuple[tuple[int, ...], Term]]:
    return ((index, term) for index, whole in output.items() for term in whole)


def _halved(pairs: Array) -> Array:
    """Symmetric in the last two axes."""
    return (pairs + np.swapaxes(pairs, -1, -2)) / 2


def _none(n: int) -> tuple[Array, Array]:
    return np.zeros((3, n, n)), np.zeros((3, 3, n, n))


def _symmetric(upper: Array) -> Array:
    """3 x 3 from its upper triangle, row by row."""
    full = np.zeros((3, 3))
    full[np.triu_indices(3)] = upper
    return full + np.triu(full, 1).T
