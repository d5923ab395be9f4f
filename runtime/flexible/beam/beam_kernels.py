"""The generated kernels of the beam, vectorised over shapes and points along it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib.resources import files

import numpy as np

from mstmm.array_validation import Array
from mstmm.ir import KernelIR
from mstmm.ir.element_spec import element_from_json

from ...kernels import numpy_kernels


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
