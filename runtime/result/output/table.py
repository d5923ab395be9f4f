"""A short text table of a result for the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from mstmm.arrays import whole

from ..plotting.choice import choose

if TYPE_CHECKING:
    from ..names import Quantity
    from ..plotting.shown import Shown

#: Columns of a table nobody chose the columns of.
_DEFAULT_COLUMNS = 6


def default_names(result: Shown, most: int = _DEFAULT_COLUMNS) -> list[str]:
    """What `plot` draws if nobody chose, a name for each column."""
    return [name for chosen in choose(result, most) for name in chosen.names][:most]


def flat(quantities: Sequence[Quantity]) -> list[tuple[str, str, np.ndarray]]:
    """(name, unit, values (n,)) of every column."""
    columns = []
    for quantity in quantities:
        if quantity.values.ndim == 1:
            columns.append((quantity.name, quantity.unit, quantity.values))
            continue
        for k, label in enumerate(quantity.labels):
            columns.append((f"{quantity.name}.{label}", quantity.unit, quantity.values[:, k]))
    return columns


def table(
    result: Shown, names: Sequence[str], rows: int, beside: Sequence[str] = ("energy",)
) -> str:
    """Aligned columns with a line of units; `rows` samples spread evenly over time.  Where nobody
    chose names, some are chosen, and `beside` stands beside them."""
    chosen = list(names) or [*default_names(result), *beside]
    columns = [("t", "s", result.t), *flat([result.quantity(name) for name in chosen])]
    picked = _spread(result.t, whole("rows", rows, 2, "a whole number of rows, 2 or more"))
    texts = [
        [name, f"[{unit}]" if unit else "", *(f"{value:.6g}" for value in values[picked])]
        for name, unit, values in columns
    ]
    widths = [max(map(len, column)) for column in texts]
    lines = [
        "  ".join(entry.rjust(width) for entry, width in zip(row, widths, strict=True)).rstrip()
        for row in zip(*texts, strict=True)
    ]
    rule = "  ".join("-" * width for width in widths)
    return "\n".join([*lines[:2], rule, *lines[2:]])


def _spread(t: np.ndarray, rows: int) -> list[int]:
    """Samples next to `rows` evenly spaced times, first and last among them."""
    if len(t) <= rows:
        return list(range(len(t)))
    wanted = np.linspace(t[0], t[-1], max(2, rows))
    right = np.clip(np.searchsorted(t, wanted), 1, len(t) - 1)
    nearer = np.where(wanted - t[right - 1] < t[right] - wanted, right - 1, right)
    return sorted({*nearer.tolist(), len(t) - 1})
