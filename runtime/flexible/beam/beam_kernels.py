"""The generated kernels of the beam, vectorised over shapes and points along it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from importlib.resources import files
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array
from mstmm.ir import KernelIR
from mstmm.ir.element_spec import element_from_json

from ...kernels import numpy_kernels
from ..modal_parts import chunk_slices


@cache
def _kernels() -> dict[str, KernelIR]:
    text = files("mstmm.generated").joinpath("sweep_beam.json").read_text(encoding="utf-8")
    return {kernel.name: kernel for kernel in element_from_json(text).kernels}


def input_size(name: str, port: str) -> int:
    """Number of entries of an input of a kernel."""
    return next(p.length() for p in _kernels()[name].inputs if p.name == port)


def evaluate(name: str, inputs: Mapping[str, Array]) -> dict[str, Array]:
    """Outputs of a kernel of the element "beam".

    In inputs and outputs the axes of a port come first; the axes of points after them broadcast.
    """
    kernel = _kernels()[name]
    leading = {port.name: np.moveaxis(inputs[port.name], 0, -1) for port in kernel.inputs}
    outputs = numpy_kernels.evaluate(kernel, leading)
    ranks = {port.name: len(port.shape) for port in kernel.outputs}
    return {
        key: np.moveaxis(values, range(-ranks[key], 0), range(ranks[key]))
        for key, values in outputs.items()
    }


# --- products of inputs ---------------------------------------------------------------------------
#
# An integrand of two shapes k and l is linear in each group of inputs: those of shape k, of shape
# l, of the section and so on.  One evaluation for unit vectors of all groups gives every
# coefficient, for all beams.  The integrals of all pairs of shapes are then matrix products.


class Term(NamedTuple):
    """Product of `factor` and one entry per group of inputs; entry None stands for 1."""

    factor: float
    entries: tuple[int | None, ...]


#: Terms whose sum is an entry of an output, by the index of the entry.
Terms: TypeAlias = Mapping[tuple[int, ...], tuple[Term, ...]]


@cache
def kernel_terms(kernel: str, *groups: tuple[str, ...]) -> Mapping[str, Terms]:
    """Terms of all outputs of a kernel that is linear in each group of its inputs.

    Entries are numbered through the concatenated inputs of a group.
    """
    widths = [[input_size(kernel, name) for name in group] for group in groups]
    extents = [sum(width) + 1 for width in widths]  # the zero vector, then the units
    unit_indices = np.indices(extents).reshape(len(groups), -1)
    inputs: dict[str, Array] = {}
    for group, width, extent, indices in zip(groups, widths, extents, unit_indices, strict=True):
        units = np.eye(extent)[1:, indices]
        inputs |= zip(group, np.split(units, np.cumsum(width)[:-1]), strict=True)
    terms = {}
    for name, values in evaluate(kernel, inputs).items():
        factors = values.reshape(*values.shape[:-1], *extents)
        for axis in range(-len(groups), 0):
            factors_on_axis = np.moveaxis(factors, axis, 0)
            factors_on_axis[1:] -= factors_on_axis[:1].copy()
        output_indices = np.ndindex(*values.shape[:-1])
        terms[name] = {index: tuple(_nonzero_terms(factors[index])) for index in output_indices}
    return terms


def _nonzero_terms(factors: Array) -> Iterator[Term]:
    for index in np.argwhere(factors):
        yield Term(float(factors[tuple(index)]), tuple(int(k) - 1 if k else None for k in index))


def known_factor(term: Term, *groups: Array) -> Array:
    """Product (m,) of a factor and the entries of the first groups, given (., m) at points."""
    product = np.full(groups[0].shape[1], term.factor)
    for values, entry in zip(groups, term.entries, strict=False):
        product *= 1.0 if entry is None else values[entry]
    return product


#: One input entry of all shapes: indices of the shapes where it is nonzero, and values (., m).
Row: TypeAlias = tuple[NDArray[np.intp], Array]


def shape_rows(values: Array) -> list[Row]:
    """Input entries of n shapes, from their values (entries, n, m) at points."""
    nonzero = (np.flatnonzero(shape_values.any(axis=1)) for shape_values in values)
    return [(k, shape_values[k]) for k, shape_values in zip(nonzero, values, strict=True)]


def add_products(total: Array, row_k: Row, row_l: Row, weights: Array) -> None:
    """Add weighted sums over points of products of one entry of shape k and one of shape l.

    `total` is (p, n, n), `weights` (p, m).
    """
    (indices_k, values_k), (indices_l, values_l) = row_k, row_l
    if not (len(indices_k) and len(indices_l) and weights.any()):
        return
    for chunk in chunk_slices(len(weights), values_k.size):
        weighted = weights[chunk, None, :] * values_k
        total[chunk, indices_k[:, None], indices_l] += weighted @ values_l.T
