"""A short text table of a result for the terminal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ..names import Quantity
    from ..record import Record

#: Columns of a table nobody chose the columns of.
_DEFAULT_COLUMNS = 6

#: A tip that moves by less than this part of the middle is held by the floating frame.
_HELD = 1e-9

#: Hinges among which these are looked for.
_LOOKED_AT = 10_000


def default_names(result: Record, most: int = _DEFAULT_COLUMNS) -> list[str]:
    """Outputs of the scene; where there are none, the first hinge coordinates, without quaternions,
    and deflections of the last end of the first flexible bodies."""
    outputs = result._quantities.outputs()
    if outputs:
        return outputs[:most]
    layout, bent = result.model.layout, list(_deflections(result, most // 2))
    names = (
        f"{hinge.name}.{name}"
        for hinge in islice(layout.hinges.values(), _LOOKED_AT)
        for name, unit in zip(hinge.q_names, hinge.q_units, strict=True)
        if unit
    )
    return [*islice(names, most - len(bent)), *bent]


def default_pictures(result: Record) -> list[str]:
    """What is drawn above the curves if nobody chose: the shapes of flexible bodies."""
    return ["shape"] if result.model.flexible else []


def _deflections(result: Record, most: int) -> Iterator[str]:
    """The larger deflection of the tip of each beam, or the first modal coordinate of a body whose
    frame follows its tip or that is no beam."""
    for name, body in islice(result.model.flexible.items(), most):
        if body.shapes is None:
            yield f"{name}.{body.modes[0]}"
            continue
        across = np.abs(
            np.nan_to_num(result.deflection(name, np.array([0.5, 1.0]) * body.shapes.length))
        )
        middle, tip = np.max(across[:, :, 1:], axis=0, initial=0.0)
        if tip.max() <= _HELD * middle.max():
            yield f"{name}.{body.modes[0]}"
        else:
            yield f"{name}.tip.deflection.{'yz'[int(tip.argmax())]}"


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


def table(result: Record, names: Sequence[str], rows: int) -> str:
    """Aligned columns with a line of units; `rows` samples spread evenly over time."""
    chosen = list(names) or [*default_names(result), "energy"]
    columns = [("t", "s", result.t), *flat([result.quantity(name) for name in chosen])]
    picked = _spread(result.t, rows)
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
