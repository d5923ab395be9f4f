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

from mstmm.printable import printable

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

#: Width of tables, in columns, if the output is no terminal.
PLAIN_WIDTH = 100


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


def discard() -> None:
    """Stop writing to standard output: drop its buffer, so that no error occurs at exit."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, sys.stdout.fileno())
        os.close(null)


def settle_streams() -> None:
    """Flush both streams a last time, so that the interpreter cannot fail at exit."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except (OSError, ValueError):
            discard()


def say(text: str = "") -> None:
    """Print one or more lines on standard output, with control characters escaped."""
    sys.stdout.write(printable(text) + "\n")


def put(text: str) -> None:
    """Write generated text (C, HTML) to standard output unchanged."""
    sys.stdout.write(text + "\n")


def complain(message: str) -> None:
    """Print an error message on standard error."""
    _on_stderr("mstmm: ", printable(message), "31")


def note(message: str) -> None:
    """Print a note, which is no error, on standard error."""
    _on_stderr("", printable(message), "2")


def _on_stderr(head: str, text: str, colour: str) -> None:
    if sys.stderr.isatty():
        width = max(shutil.get_terminal_size().columns, 40)
        text = "\n".join(_folded(line, width, head) for line in text.splitlines())
    if sys.stderr.isatty() and not os.environ.get("NO_COLOR"):
        text = f"\x1b[{colour}m{head}\x1b[0m{text}" if head else f"\x1b[{colour}m{text}\x1b[0m"
    else:
        text = head + text
    sys.stderr.write(text + "\n")
    sys.stderr.flush()


def _folded(line: str, width: int, head: str) -> str:
    """Wrap a line between words to the width of the terminal."""
    return textwrap.fill(
        head + line, width, break_long_words=False, break_on_hyphens=False
    ).removeprefix(head)


def console(file: Any = None) -> Console:
    """Console for tables, as wide as the terminal, or COLUMNS, or PLAIN_WIDTH."""
    from rich.console import Console

    target = sys.stdout if file is None else file
    sized = target.isatty() or os.environ.get("COLUMNS", "").isdigit()
    return Console(
        file=target, width=None if sized and file is None else PLAIN_WIDTH,
        highlight=False, markup=False, emoji=False,
    )  # fmt: skip


#: Longest name, in characters, for which the first column is widened.
_NAMES = 44


def table(title: str, columns: Sequence[str], rows: Iterable[Sequence[str]], **more: Any) -> Table:
    """Build a plain table; columns whose heading ends in ">" are right-aligned.

    The first column holds names, and is not wrapped as long as it leaves space for the others.
    """
    from rich import box
    from rich.table import Table
    from rich.text import Text

    made = Table(
        title=Text(printable(title), style="bold") if title else None,
        title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False, **more,
    )  # fmt: skip
    filled = [tuple(printable(cell) for cell in row) for row in rows]
    longest = max((len(row[0]) for row in filled if row), default=0)
    for number, heading in enumerate(columns):
        right = heading.endswith(">")
        made.add_column(
            Text(heading.rstrip(">")), justify="right" if right else "left", overflow="fold",
            no_wrap=number == 0 and longest <= _NAMES,
        )  # fmt: skip
    for row in filled:
        made.add_row(*map(Text, row))
    return made


def emit_json(data: Any) -> None:
    """Print one JSON document on standard output; see `plain` for the conversion."""
    sys.stdout.write(json.dumps(plain(data), indent=2, allow_nan=False, ensure_ascii=True) + "\n")


def plain(value: Any) -> Any:
    """Convert to JSON values: arrays become lists, numbers that are not finite null."""
    if isinstance(value, dict):
        return {str(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(entry) for entry in value]
    if value is None or isinstance(value, (str, bool, int)):
        return value
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return str(value)
