"""CSV files in the folder of a scene: named columns of numbers."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path

from ...argument_validation import parse_number
from .scalars_and_vectors import describe_value, problem

#: Largest file in MB.
MAX_FILE_SIZE_MB = 64


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
        (number, [cell.strip() for cell in line.split(_separator_of(line))])
        for number, line in enumerate(_read_text(path, folder).splitlines(), 1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    names = rows.pop(0)[1] if rows and _parse_number(rows[0][1][0]) is None else []
    column_index = _column_index(path, column, names, len(rows[0][1]) if rows else 0)
    if not rows:
        raise problem(
            f"{describe_value(path)}: expected rows of numbers, times in s first, found none"
        )
    first_column, second_column = list[float](), list[float]()
    for line, cells in rows:
        if len(cells) <= column_index:
            raise problem(
                f"{describe_value(path)}: row {line}: expected {column_index + 1} columns or "
                f"more, found {len(cells)}"
            )
        for cell, numbers in ((cells[0], first_column), (cells[column_index], second_column)):
            value = _parse_number(cell)
            if value is None or not math.isfinite(value):
                raise problem(
                    f"{describe_value(path)}: row {line}: expected a number, found "
                    f"{describe_value(cell)}"
                )
            numbers.append(value)
    return Columns(tuple(first_column), tuple(second_column), tuple(line for line, _ in rows))


def _separator_of(line: str) -> str:
    return next((mark for mark in ";\t" if mark in line), ",")


def _parse_number(cell: str) -> float | None:
    try:
        return parse_number(cell)
    except ValueError:
        return None


def _column_index(path: str, column: str | int, names: list[str], width: int) -> int:
    if isinstance(column, str):
        if column not in names:
            available_names = ", ".join(names) or "none; give the column number instead"
            raise problem(
                f"{describe_value(path)}: no column {describe_value(column)}; its columns: "
                f"{available_names}"
            )
        return names.index(column)
    if width and column > width:
        raise problem(f"{describe_value(path)}: no column {column}; it has {width} columns")
    return column - 1


def _read_text(path: str, folder: str) -> str:
    """Text of a file in or below the folder."""
    folder_path = Path(folder or os.curdir).resolve()
    file_path = (folder_path / path).resolve()
    if Path(path).is_absolute() or not file_path.is_relative_to(folder_path):
        raise problem(
            f"expected a file in the folder of the scene, found {describe_value(path)}; copy it "
            "there, or give its numbers as times and values"
        )
    try:
        if not file_path.is_file():
            raise problem(
                f"{describe_value(path)}: there is no such file in the folder of the scene"
            )
        if file_path.stat().st_size > MAX_FILE_SIZE_MB * 2**20:
            raise problem(
                f"{describe_value(path)}: the file is larger than {MAX_FILE_SIZE_MB} MB; reduce "
                f"its number of rows"
            )
        return file_path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise problem(f"{describe_value(path)}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise problem(f"{describe_value(path)}: not UTF-8 text; save it as CSV in UTF-8") from None
