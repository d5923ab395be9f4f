"""The generated kernels of the beam, evaluated for all shapes and points along it at once."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

from mstmm.ir import Assign, Constant, Element, KernelIR, Operand, Store, Temporary
from mstmm.stored import element_from_json

from .modal_body import Array

_OPERATIONS: dict[str, Any] = {
    "neg": np.negative, "add": np.add, "sub": np.subtract, "mul": np.multiply, "div": np.divide,
}  # fmt: skip


@cache
def kernel(name: str) -> KernelIR:
    """A kernel of the element "beam" by its name."""
    text = files("mstmm.generated").joinpath("sweep_beam.json").read_text(encoding="utf-8")
    json.loads(text)
    return next(k for k in element_from_json(text).kernels if k.name == name)


def evaluate(name: str, inputs: Mapping[str, Array]) -> dict[str, Array]:
    """Outputs of a kernel; each input is an array of the port's shape with the points behind it.

    The axes behind the port's own are broadcast against each other.
    """
    ir = kernel(name)
    temporaries: dict[int, Any] = {}
    outputs: dict[str, dict[tuple[int, ...], Any]] = {port.name: {} for port in ir.outputs}

    def value(operand: Operand) -> Any:
        if isinstance(operand, Temporary):
            return temporaries[operand.number]
        if isinstance(operand, Constant):
            return operand.number
        assert isinstance(operand, Element)
        return inputs[operand.port][operand.index]

    for statement in ir.statements:
        if isinstance(statement, Assign):
            operation = _OPERATIONS[statement.op]
            temporaries[statement.number] = operation(*(value(a) for a in statement.args))
        else:
            assert isinstance(statement, Store)
            outputs[statement.port][statement.index] = value(statement.value)  # type: ignore[index]
    return {port.name: _gathered(port.shape, outputs[port.name]) for port in ir.outputs}


def _gathered(shape: tuple[Any, ...], entries: Mapping[tuple[int, ...], Any]) -> Array:
    """One array of the port's shape, then that of the points; what is never stored is zero."""
    batch = np.broadcast_shapes(*(np.shape(e) for e in entries.values()))
    whole = np.zeros((*shape, *batch))
    for index, entry in entries.items():
        whole[index] = entry
    return whole
