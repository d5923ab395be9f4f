"""The generated kernels of the beam, evaluated for all shapes and points along it at once."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache
from importlib.resources import files

import numpy as np

from mstmm.ir import KernelIR
from mstmm.stored import element_from_json

from ... import vectorized
from ..modal_body import Array


@cache
def _kernels() -> dict[str, KernelIR]:
    text = files("mstmm.generated").joinpath("sweep_beam.json").read_text(encoding="utf-8")
    return {kernel.name: kernel for kernel in element_from_json(text).kernels}


#: Numbers of one array in a batch of points, 8 MB; a kernel holds some hundred of them.
_BATCH = 2**20


def evaluate(name: str, inputs: Mapping[str, Array]) -> dict[str, Array]:
    """Outputs of a kernel of the element "beam"; the axes of the points stand behind those of the
    port, in inputs and outputs, and are broadcast against each other.

    Many points are taken in batches along the last axis: a beam of 60 shapes in either plane has
    14 400 pairs of them at every section.
    """
    kernel = _kernels()[name]
    ranks = {port.name: len(port.shape) for port in kernel.inputs}
    lead = np.broadcast_shapes(*(inputs[key].shape[rank:] for key, rank in ranks.items()))
    points = lead[-1] if lead else 1
    rows = max(1, _BATCH * points // max(1, math.prod(lead)))
    if points <= rows:
        return _evaluated(kernel, inputs)
    parts = [
        _evaluated(kernel, {key: _some(array, first, rows) for key, array in inputs.items()})
        for first in range(0, points, rows)
    ]
    return {key: np.concatenate([part[key] for part in parts], axis=-1) for key in parts[0]}


def _some(array: Array, first: int, rows: int) -> Array:
    """Some of the last axis, or what is the same for all points."""
    return array if array.shape[-1] == 1 else array[..., first : first + rows]


def _evaluated(kernel: KernelIR, inputs: Mapping[str, Array]) -> dict[str, Array]:
    leading = {port.name: np.moveaxis(inputs[port.name], 0, -1) for port in kernel.inputs}
    found = vectorized.evaluate(kernel, leading)
    ranks = {port.name: len(port.shape) for port in kernel.outputs}
    return {
        key: np.moveaxis(a, range(-ranks[key], 0), range(ranks[key])) for key, a in found.items()
    }
