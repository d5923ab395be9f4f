"""CSV files in the folder of a scene: named columns of numbers."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path

from ...arguments import number_in
from .values import found, refuse

#: Largest file in MB.
MAX_SIZE = 64


@dataclass(frozen=True)
class Columns:
    """Two columns of a file: the first and another; `lines` are their line numbers."""

    first: tuple[float, ...]
    other: tuple[float, ...]
    lines: tuple[int, ...]


def read_columns(path: str, folder: str, column: str | int) -> Columns:
    """Read the first column of a CSV file and the one with the given name or number.

    The file is in or below `folder` (empty: the current one).  Columns are separated by commas,
    semicolons or tabs.  The first line may contain their names; empty lines and those that begin
    with # are skipped.  Raises Refused.
    """
    rows = [
        (number, [cell.strip() for cell in line.split(_separator(line))])
        for number, line in enumerate(_text(path, folder).splitlines(), 1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    names = rows.pop(0)[1] if rows and _number(rows[0][1][0]) is None else []
    place = _place(path, column, names, len(rows[0][1]) if rows else 0)
    if not rows:
        raise refuse(f"{found(path)}: expected rows of numbers, times in s first, found none")
    first, other = list[float](), list[float]()
    for line, cells in rows:
        if len(cells) <= place:
            raise refuse(
                f"{found(path)}: row {line}: expected {place + 1} columns or more, found "
                f"{len(cells)}"
            )
        for cell, numbers in ((cells[0], first), (cells[place], other)):
            value = _number(cell)
            if value is None or not math.isfinite(value):
                raise refuse(f"{found(path)}: row {line}: expected a number, found {found(cell)}")
            numbers.append(value)
    return Columns(tuple(first), tuple(other), tuple(line for line, _ in rows))


def _separator(line: str) -> str:
    return next((mark for mark in ";\t" if mark in line), ",")


def _number(cell: str) -> float | None:
    try:
        return number_in(cell)
    except ValueError:
        return None


def _place(path: str, column: str | int, names: list[str], width: int) -> int:
    if isinstance(column, str):
        if column not in names:
            there = ", ".join(names) or "none; give the column number instead"
            raise refuse(f"{found(path)}: no column {found(column)}; its columns: {there}")
        return names.index(column)
    if width and column > width:
        raise refuse(f"{found(path)}: no column {column}; it has {width} columns")
    return column - 1


def _text(path: str, folder: str) -> str:
    """Text of a file in or below the folder."""
    home = Path(folder or os.curdir).resolve()
    place = (home / path).resolve()
    if Path(path).is_absolute() or not place.is_relative_to(home):
        raise refuse(
            f"expected a file in the folder of the scene, found {found(path)}; copy it there, or "
            "give its numbers as times and values"
        )
    try:
        if not place.is_file():
            raise refuse(f"{found(path)}: there is no such file in the folder of the scene")
        if place.stat().st_size > MAX_SIZE * 2**20:
            raise refuse(
                f"{found(path)}: the file is larger than {MAX_SIZE} MB; reduce its number of rows"
            )
        return place.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise refuse(f"{found(path)}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise refuse(f"{found(path)}: not UTF-8 text; save it as CSV in UTF-8") from None
