"""CSV and MATLAB tables over time, with a column for every scalar."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mstmm.array_validation import Array, Integers

from ...platform_support.safe_files import replace_atomically
from ..quantity_names import Quantity


def write_table(
    t: Array, event: Integers, quantities: Sequence[Quantity], path: Path, scene: str = ""
) -> Path:
    """Write scalar quantities and events (n,) at the times t (n,) s; the suffix is in `TABLES`."""
    with replace_atomically(path) as temporary:
        TABLES[path.suffix.lower()](t, event, quantities, temporary, scene)
    return path


def column_heading(quantity: Quantity) -> str:
    """Heading of a column: name and unit."""
    return f"{quantity.name} [{quantity.unit}]" if quantity.unit else quantity.name


def matlab_names(names: Sequence[str]) -> list[str]:
    """Unique names valid in MATLAB: letters, digits and _, at most 63 characters."""
    taken, result = {"t", "event", "names", "scene"}, []
    for name in names:
        text = re.sub(r"\W", "_", name)
        text = (text if text[:1].isalpha() else f"x{text}")[:63]
        number = 1
        while text in taken:
            number += 1
            end = f"_{number}"
            text = text[: 63 - len(end)] + end
        taken.add(text)
        result.append(text)
    return result


def _write_csv(
    t: Array, event: Integers, quantities: Sequence[Quantity], path: Path, _: str
) -> None:
    """One row per sample, one column per scalar; the header holds names and units."""
    header = ["time [s]", "event", *map(column_heading, quantities)]
    columns = [t.tolist(), event.tolist(), *(q.values.tolist() for q in quantities)]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(header)
        writer.writerows(zip(*columns, strict=True))


def _write_mat(
    t: Array, event: Integers, quantities: Sequence[Quantity], path: Path, scene: str
) -> None:
    """One variable per scalar; `names` has a row for each: MATLAB's name, original name, unit."""
    from scipy.io import savemat

    keys = matlab_names([quantity.name for quantity in quantities])
    rows = [
        (key, quantity.name, quantity.unit) for key, quantity in zip(keys, quantities, strict=True)
    ]
    names = np.array(rows, dtype=object).reshape(-1, 3)
    data: dict[str, Any] = {
        key: quantity.values[:, None] for key, quantity in zip(keys, quantities, strict=True)
    }
    data |= {"t": t[:, None], "event": event[:, None], "names": names, "scene": scene}
    with path.open("wb") as file:
        savemat(file, data, long_field_names=True, do_compression=True)


#: Writers by file suffix.
TABLES: dict[str, Callable[[Array, Integers, Sequence[Quantity], Path, str], None]] = {
    ".csv": _write_csv, ".mat": _write_mat,
}  # fmt: skip
