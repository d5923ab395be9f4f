"""Output to the terminal and to pipes that may close: text, tables, JSON and messages."""

from __future__ import annotations

import contextlib
import json
import math
import os
import shutil
import sys
import textwrap
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from mstmm.display import escape_control_characters

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

#: Width of tables, in columns, if the output is no terminal.
DEFAULT_WIDTH = 100


def prepare_streams() -> None:
    """Make the standard streams robust against unsupported characters and closed streams."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115 - lives as long as the process
        with contextlib.suppress(AttributeError, ValueError):
            getattr(sys, name).reconfigure(errors="backslashreplace")


def flush() -> None:
    """Flush standard output; OSError if that fails (a full disk, a closed pipe)."""
    sys.stdout.flush()


def discard_output() -> None:
    """Stop writing to standard output: drop its buffer, so that no error occurs at exit."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, sys.stdout.fileno())
        os.close(null)


def flush_streams() -> None:
    """Flush both streams a last time, so that the interpreter cannot fail at exit."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except (OSError, ValueError):
            discard_output()


def print_lines(text: str = "") -> None:
    """Print one or more lines on standard output, with control characters escaped."""
    sys.stdout.write(escape_control_characters(text) + "\n")


def write_stdout(text: str) -> None:
    """Write generated text (C, HTML) to standard output unchanged."""
    sys.stdout.write(text + "\n")


def print_error(message: str) -> None:
    """Print an error message on standard error."""
    _write_stderr("mstmm: ", escape_control_characters(message), "31")


def print_note(message: str) -> None:
    """Print a note, which is no error, on standard error."""
    _write_stderr("", escape_control_characters(message), "2")


def _write_stderr(head: str, text: str, colour: str) -> None:
    if sys.stderr.isatty():
        width = max(shutil.get_terminal_size().columns, 40)
        text = "\n".join(_wrap(line, width, head) for line in text.splitlines())
    if sys.stderr.isatty() and not os.environ.get("NO_COLOR"):
        text = f"\x1b[{colour}m{head}\x1b[0m{text}" if head else f"\x1b[{colour}m{text}\x1b[0m"
    else:
        text = head + text
    sys.stderr.write(text + "\n")
    sys.stderr.flush()


def _wrap(line: str, width: int, head: str) -> str:
    """Wrap a line between words to the width of the terminal."""
    return textwrap.fill(
        head + line, width, break_long_words=False, break_on_hyphens=False
    ).removeprefix(head)


def table_console(file: Any = None) -> Console:
    """Console for tables, as wide as the terminal, or COLUMNS, or PLAIN_WIDTH."""
    from rich.console import Console

    target = sys.stdout if file is None else file
    has_known_width = target.isatty() or os.environ.get("COLUMNS", "").isdigit()
    return Console(
        file=target, width=None if has_known_width and file is None else DEFAULT_WIDTH,
        highlight=False, markup=False, emoji=False,
    )  # fmt: skip


#: Longest name, in characters, for which the first column is widened.
_MAX_NAME_WIDTH = 44


def build_table(
    title: str, columns: Sequence[str], rows: Iterable[Sequence[str]], **more: Any
) -> Table:
    """Build a plain table; columns whose heading ends in ">" are right-aligned.

    The first column holds names, and is not wrapped as long as it leaves space for the others.
    """
    from rich import box
    from rich.table import Table
    from rich.text import Text

    result = Table(
        title=Text(escape_control_characters(title), style="bold") if title else None,
        title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False, **more,
    )  # fmt: skip
    cells = [tuple(escape_control_characters(cell) for cell in row) for row in rows]
    longest = max((len(row[0]) for row in cells if row), default=0)
    for number, heading in enumerate(columns):
        is_right_aligned = heading.endswith(">")
        result.add_column(
            Text(heading.rstrip(">")),
            justify="right" if is_right_aligned else "left",
            overflow="fold",
            no_wrap=number == 0 and longest <= _MAX_NAME_WIDTH,
        )
    for row in cells:
        result.add_row(*map(Text, row))
    return result


def print_json(data: Any) -> None:
    """Print one JSON document on standard output; see `to_json_value` for the conversion."""
    sys.stdout.write(
        json.dumps(to_json_value(data), indent=2, allow_nan=False, ensure_ascii=True) + "\n"
    )


def to_json_value(value: Any) -> Any:
    """Convert to JSON values: arrays become lists, numbers that are not finite null."""
    if isinstance(value, dict):
        return {str(key): to_json_value(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [to_json_value(entry) for entry in value]
    if value is None or isinstance(value, (str, bool, int)):
        return value
    if hasattr(value, "tolist"):
        return to_json_value(value.tolist())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return str(value)
