"""Outputs of a scene: named quantities of a run and expressions of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.expression.expression import Expression, Name
from mstmm.ir import KernelIR, Port
from mstmm.ir.graph import Graph
from mstmm.scene import Output

from ..kernels import numpy_kernels
from .quantity_names import Quantity

#: Lookup of a quantity by name; raises SceneError for an unknown name.
QuantityLookup = Callable[[str], Quantity]


def quantity_of(output: Output, t: Array, known: QuantityLookup) -> Quantity:
    """Evaluate an output at the times t (n,); SceneError for unknown names in it."""
    source = single_quantity_name(output)
    try:
        if source:
            return _with_output_name(output, known(source))
        columns = [_name_values(name, t, known) for name in output.of.names]
    except SceneError as error:
        raise SceneError(f'output "{output.name}": of: {error}') from None
    names = np.stack(columns, axis=1)
    values = numpy_kernels.evaluate(expression_kernel(output.of), {"names": names})["value"][:, 0]
    return Quantity(
        output.name, values, output.unit, _long_name(output), description=f"output {output.name}"
    )


def single_quantity_name(output: Output) -> str:
    """Name of the quantity that an output equals; "" for an expression."""
    names, text = output.of.names, output.of.text
    return text if len(names) == 1 and text == names[0].text != "t" else ""


def component_of(quantity: Quantity, label: str) -> Quantity:
    """Component of a vector quantity by its label."""
    values = quantity.values[:, quantity.labels.index(label)]
    long_name = f"{quantity.long_name}, {label}"
    return replace(
        quantity, name=f"{quantity.name}.{label}", values=values, long_name=long_name, labels=(),
        rates=None,
    )  # fmt: skip


def _with_output_name(output: Output, of: Quantity) -> Quantity:
    long_name = f"{_long_name(output)}, {of.long_name}"
    return replace(
        of, name=output.name, unit=output.unit or of.unit, long_name=long_name,
        description=f"output {output.name}", owner="",
    )  # fmt: skip


def _long_name(output: Output) -> str:
    return f"output {output.name} = {output.of.text}"


def _name_values(name: Name, t: Array, known: QuantityLookup) -> Array:
    """Values (n,) of a name in an expression."""
    if name.text == "t":
        return t
    quantity = known(name.text)
    if quantity.values.ndim > 1:
        raise SceneError(
            f'"{name.text}" has {quantity.values.shape[1]} components; use one of them, such as '
            f"{name.text}.{quantity.labels[0]}"
        )
    return quantity.values


def expression_kernel(expression: Expression) -> KernelIR:
    """Kernel names (k,) -> value (1,) of an expression, with its names in order."""
    graph = Graph()
    indices = {name: k for k, name in enumerate(expression.names)}
    node = expression.build(graph, lambda name: graph.element("names", indices[name]))
    ports = Port("names", (len(indices),)), Port("value", (1,))
    return graph.kernel("output", [ports[0]], [ports[1]], {"value": [node]})
