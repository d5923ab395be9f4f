"""The generated kernels of the beam, evaluated for all shapes and points along it at once."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib.resources import files

import numpy as np

from mstmm.array_validation import Array
from mstmm.ir import KernelIR
from mstmm.ir.json_format import element_from_json

from ...kernels import numpy_kernels


@cache
def _kernels() -> dict[str, KernelIR]:
    text = files("mstmm.generated").joinpath("sweep_beam.json").read_text(encoding="utf-8")
    return {kernel.name: kernel for kernel in element_from_json(text).kernels}


def rows(name: str, port: str) -> int:
    """Numbers of an input of a kernel."""
    return next(p.length() for p in _kernels()[name].inputs if p.name == port)


def evaluate(name: str, inputs: Mapping[str, Array]) -> dict[str, Array]:
    """Outputs of a kernel of the element "beam"; the axes of the points stand behind those of the
    port, in inputs and outputs, and are broadcast against each other."""
    kernel = _kernels()[name]
    leading = {port.name: np.moveaxis(inputs[port.name], 0, -1) for port in kernel.inputs}
    found = numpy_kernels.evaluate(kernel, leading)
    ranks = {port.name: len(port.shape) for port in kernel.outputs}
    return {
        key: np.moveaxis(a, range(-ranks[key], 0), range(ranks[key])) for key, a in found.items()
    }
