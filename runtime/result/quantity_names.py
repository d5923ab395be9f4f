"""Quantity of a run, name table of one owner, and outputs of a scene."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.expression.expression import Expression, Name
from mstmm.ir import KernelIR, Port
from mstmm.ir.graph import Graph
from mstmm.scene import Output

from ..engine.quantity_registry import EULER_KIND, QuantityKind
from ..kernels import numpy_kernels
from .observations import gimbal_note

Values = Callable[[], Array]


@dataclass(frozen=True)
class Quantity:
    """Values (n,) or (n, k) over time; `labels` has one entry per column.

    `rates` are their time derivatives if these are also quantities. `description` is the noun of an
    `owner`: "angle" of "hinge elbow"; "" without an owner. `note` is a sentence for readers.
    """

    name: str
    values: Array
    unit: str
    long_name: str
    labels: tuple[str, ...] = ()
    rates: Callable[[], Array] | None = field(default=None, compare=False)
    description: str = ""
    owner: str = ""
    note: str = ""


def column_labels(quantity: Quantity) -> list[str]:
    """Labels of the columns of a quantity."""
    return [f"{quantity.name}.{label}" for label in quantity.labels] or [quantity.name]


@dataclass
class Table:
    """Names of one owner: getters, names of all scalar columns, and undivided vectors.

    Files hold the `vector_names` quantities, with vectors undivided. Of equal names the first one
    counts.
    """

    entries: dict[str, Callable[[], Quantity]]
    scalars: list[str]
    vector_names: list[str] = field(default_factory=list)

    def add(
        self, prefix: str, kind: QuantityKind, get: Values, rates: Values | None = None,
        owner: str = "", column: int | None = None,
    ) -> None:  # fmt: skip
        """Add a quantity "prefix.name", and its components "prefix.name.x" or "prefix.vx".

        A component without column in a wide table has a short name there or is not `listed`. A
        scalar may be one `column` of the values that `get` returns.
        """
        name = f"{prefix}.{kind.name}" if prefix else kind.name
        if kind.listed and name not in self.entries:
            self.vector_names.append(name)
        entry = partial(_entry, kind, owner, get, rates)
        if not kind.labels:
            self._add_column(name, entry(name, column=column), kind.listed)
            return
        self.entries.setdefault(name, entry(name))
        for k, label in enumerate(kind.labels):
            short_name = f"{prefix}.{kind.short[k]}" if kind.short else ""
            has_free_short_name = bool(short_name) and short_name not in self.entries
            full_name = f"{name}.{label}"
            is_listed = kind.listed and not has_free_short_name
            self._add_column(full_name, entry(full_name, column=k), is_listed)
            if has_free_short_name:
                self._add_column(short_name, entry(short_name, column=k), kind.listed)

    def _add_column(self, name: str, entry: Callable[[], Quantity], listed: bool) -> None:
        if name not in self.entries and listed:
            self.scalars.append(name)
        self.entries.setdefault(name, entry)


def _entry(
    kind: QuantityKind,
    owner: str,
    get: Values,
    rates: Values | None,
    name: str,
    column: int | None = None,
) -> Callable[[], Quantity]:
    """Getter of a quantity, or of one column of it."""
    long_name = f"{kind.long_name} of {owner}" if owner else kind.long_name
    labels = kind.labels if column is None else ()
    if kind.labels and column is not None:
        long_name = f"{long_name}, {kind.labels[column]}"
    column_rates = rates
    if rates is not None and column is not None:
        column_rates = lambda: rates()[:, column]  # noqa: E731

    def quantity() -> Quantity:
        values = get()
        note = gimbal_note(values) if kind is EULER_KIND else ""
        return Quantity(
            name, values if column is None else values[:, column], kind.unit, long_name, labels,
            column_rates, kind.long_name, owner, note,
        )  # fmt: skip

    return quantity


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
