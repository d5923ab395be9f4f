"""Short text table of a result for the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import integer

from ..plotting.default_quantities import choose_panels

if TYPE_CHECKING:
    from ..plotting.default_quantities import PlotSource
    from ..quantity_names import Quantity

#: Default number of columns of a table.
_DEFAULT_COLUMNS = 6


def default_names(result: PlotSource, most: int = _DEFAULT_COLUMNS) -> list[str]:
    """Names of the default quantities of `plot`, one for each column."""
    return [name for chosen in choose_panels(result, most) for name in chosen.names][:most]


def flat_columns(quantities: Sequence[Quantity]) -> list[tuple[str, str, np.ndarray]]:
    """Name, unit and values (n,) of every column."""
    columns = []
    for quantity in quantities:
        if quantity.values.ndim == 1:
            columns.append((quantity.name, quantity.unit, quantity.values))
            continue
        for k, label in enumerate(quantity.labels):
            columns.append((f"{quantity.name}.{label}", quantity.unit, quantity.values[:, k]))
    return columns


def text_table(
    result: PlotSource, names: Sequence[str], rows: int, beside: Sequence[str] = ("energy",)
) -> str:
    """Aligned columns with a line of units; `rows` samples spread evenly over time.

    Without names, default quantities are chosen, followed by the names in `beside`.
    """
    selected = list(names) or [*default_names(result), *beside]
    columns = [("t", "s", result.t), *flat_columns([result.quantity(name) for name in selected])]
    samples = _evenly_spaced_samples(
        result.t, integer("rows", rows, 2, "a whole number of rows, 2 or more")
    )
    texts = [
        [name, f"[{unit}]" if unit else "", *(f"{value:.6g}" for value in values[samples])]
        for name, unit, values in columns
    ]
    widths = [max(map(len, column)) for column in texts]
    lines = [
        "  ".join(entry.rjust(width) for entry, width in zip(row, widths, strict=True)).rstrip()
        for row in zip(*texts, strict=True)
    ]
    rule = "  ".join("-" * width for width in widths)
    return "\n".join([*lines[:2], rule, *lines[2:]])


def _evenly_spaced_samples(t: np.ndarray, rows: int) -> list[int]:
    """Samples next to `rows` evenly spaced times, including the first and last."""
    if len(t) <= rows:
        return list(range(len(t)))
    targets = np.linspace(t[0], t[-1], max(2, rows))
    right = np.clip(np.searchsorted(t, targets), 1, len(t) - 1)
    nearest = np.where(targets - t[right - 1] < t[right] - targets, right - 1, right)
    return sorted({*nearest.tolist(), len(t) - 1})
