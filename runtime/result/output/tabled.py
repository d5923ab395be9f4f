"""Tables of numbers over time: CSV and MATLAB's files, a column for every number."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mstmm.arrays import Array, Integers

from ...host.files import replacing
from ..names import Quantity


def write(
    t: Array, event: Integers, quantities: Sequence[Quantity], path: Path, scene: str = ""
) -> Path:
    """Scalar quantities at the times t (n,) s, and events (n,); the suffix is one of TABLES."""
    with replacing(path) as temporary:
        TABLES[path.suffix.lower()](t, event, quantities, temporary, scene)
    return path


def heading(quantity: Quantity) -> str:
    """Name and unit above a column."""
    return f"{quantity.name} [{quantity.unit}]" if quantity.unit else quantity.name


def matlab_names(names: Sequence[str]) -> list[str]:
    """Names that MATLAB takes, no two alike: letters, digits and _, 63 of them at most."""
    taken, found = {"t", "event", "names", "scene"}, []
    for name in names:
        text = re.sub(r"\W", "_", name)
        text = (text if text[:1].isalpha() else f"x{text}")[:63]
        number = 1
        while text in taken:
            number += 1
            end = f"_{number}"
            text = text[: 63 - len(end)] + end
        taken.add(text)
        found.append(text)
    return found


def _csv(t: Array, event: Integers, quantities: Sequence[Quantity], path: Path, _: str) -> None:
    """One row per sample, one column per number; the header holds names and units."""
    header = ["time [s]", "event", *map(heading, quantities)]
    columns = [t.tolist(), event.tolist(), *(q.values.tolist() for q in quantities)]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(header)
        writer.writerows(zip(*columns, strict=True))


def _mat(t: Array, event: Integers, quantities: Sequence[Quantity], path: Path, scene: str) -> None:
    """A variable per number; `names` has a row for each: MATLAB's name, ours, the unit."""
    from scipy.io import savemat

    keys = matlab_names([one.name for one in quantities])
    rows = [(key, one.name, one.unit) for key, one in zip(keys, quantities, strict=True)]
    names = np.array(rows, dtype=object).reshape(-1, 3)
    data: dict[str, Any] = {
        key: one.values[:, None] for key, one in zip(keys, quantities, strict=True)
    }
    data |= {"t": t[:, None], "event": event[:, None], "names": names, "scene": scene}
    with path.open("wb") as file:
        savemat(file, data, long_field_names=True, do_compression=True)


#: Writers by the endings of files.
TABLES: dict[str, Callable[[Array, Integers, Sequence[Quantity], Path, str], None]] = {
    ".csv": _csv, ".mat": _mat,
}  # fmt: skip
