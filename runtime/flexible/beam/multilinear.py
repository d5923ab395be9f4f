"""The generated kernels of pairs of shapes as the terms that they are sums of.

An integrand of two shapes k and l is linear in what it takes of shape k, in what it takes of shape
l, in the section's data and so on, each group of inputs by itself.  So one evaluation for the units
of all groups gives every coefficient, for all beams; the integrals of all pairs of shapes are then
products of matrices, and no kernel is evaluated for pairs.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array

from ..memory_chunks import slices
from . import beam_kernels


class Term(NamedTuple):
    """`factor` times one entry of every group; None stands for 1."""

    factor: float
    entries: tuple[int | None, ...]


#: Index in an output -> the terms that it is the sum of.
Terms: TypeAlias = Mapping[tuple[int, ...], tuple[Term, ...]]


@cache
def terms(kernel: str, *groups: tuple[str, ...]) -> Mapping[str, Terms]:
    """The terms of every output of a kernel that is linear in each group of its inputs; entries are
    counted through the inputs of a group."""
    widths = [[beam_kernels.rows(kernel, name) for name in group] for group in groups]
    extents = [sum(width) + 1 for width in widths]  # the zero vector, then the units
    chosen = np.indices(extents).reshape(len(groups), -1)
    inputs: dict[str, Array] = {}
    for group, width, extent, which in zip(groups, widths, extents, chosen, strict=True):
        units = np.eye(extent)[1:, which]
        inputs |= zip(group, np.split(units, np.cumsum(width)[:-1]), strict=True)
    found = {}
    for name, values in beam_kernels.evaluate(kernel, inputs).items():
        factors = values.reshape(*values.shape[:-1], *extents)
        for axis in range(-len(groups), 0):
            along = np.moveaxis(factors, axis, 0)
            along[1:] -= along[:1].copy()
        port = np.ndindex(*values.shape[:-1])
        found[name] = {index: tuple(_terms(factors[index])) for index in port}
    return found


def _terms(factors: Array) -> Iterator[Term]:
    for place in np.argwhere(factors):
        yield Term(float(factors[tuple(place)]), tuple(int(k) - 1 if k else None for k in place))


def known(term: Term, *groups: Array) -> Array:
    """(m,) the factor and the entries of the first groups, which are known (., m) at points."""
    found = np.full(groups[0].shape[1], term.factor)
    for values, entry in zip(groups, term.entries, strict=False):
        found *= 1.0 if entry is None else values[entry]
    return found


#: An entry of all shapes: which of them have it at all, and their values (., m) at points.
Row: TypeAlias = tuple[NDArray[np.intp], Array]


def rows_of(values: Array) -> list[Row]:
    """Every entry of n shapes, from their values (entries, n, m)."""
    having = (np.flatnonzero(of_shapes.any(axis=1)) for of_shapes in values)
    return [(some, of_shapes[some]) for some, of_shapes in zip(having, values, strict=True)]


def add_products(found: Array, of_k: Row, of_l: Row, weights: Array) -> None:
    """To (p, n, n) add sums over points of weights (p, m) times an entry of shape k times one of
    shape l."""
    (some_k, values), (some_l, others) = of_k, of_l
    if not (len(some_k) and len(some_l) and weights.any()):
        return
    for some in slices(len(weights), values.size):
        found[some, some_k[:, None], some_l] += (weights[some, None, :] * values) @ others.T
