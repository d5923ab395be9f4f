"""Docstrings are plain text: |v| is a length, and an indented line is a display.

Entries of Args, Attributes, Returns and Raises become items of a list.
"""

from __future__ import annotations

import re
from typing import Any

_SECTION = re.compile(r"(Args|Attributes|Returns|Raises):")
_ENTRY = re.compile(r"([\w*]+(?:, [\w*]+)*): (.*)")


def plain_text(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Turn the lines of a docstring into reStructuredText that says the same."""
    out: list[str] = []
    display, i = False, 0
    while i < len(lines):
        line = lines[i]
        entries, end = _entries(lines, i) if _SECTION.fullmatch(line) else ([], i)
        if entries:
            out += ["", line.replace("Args", "Arguments"), "", *entries, ""]
            display, i = False, end
            continue
        if line[:1].isspace() and not display:
            out += ["", ".. code-block:: text", ""]
        display = line[:1].isspace() or (display and not line)
        if not display:
            if out and out[-1][:1].isspace():
                out.append("")
            line = _escaped(line)
        out.append(line)
        i += 1
    lines[:] = [*out, ""]


def _entries(lines: list[str], start: int) -> tuple[list[str], int]:
    """Items of the section that begins at a line, and the line behind it.

    No items if one of its lines is not an entry.
    """
    end = start + 1
    while end < len(lines) and (not lines[end] or lines[end][:1].isspace()):
        end += 1
    block = [line for line in lines[start + 1 : end] if line]
    indent = min((len(line) - len(line.lstrip()) for line in block), default=0)
    items: list[list[str]] = []
    for line in block:
        entry = _ENTRY.fullmatch(line[indent:])
        if entry is not None:
            names = ", ".join(f"``{name}``" for name in entry[1].split(", "))
            items.append([f"* {names}: {_escaped(entry[2])}"])
        elif items and line[indent].isspace():
            items[-1].append("  " + _escaped(line.strip()))
        else:
            return [], start
    return [line for item in items for line in item], end


def _escaped(line: str) -> str:
    """Code in backticks as literals, everything else as it stands."""
    parts = re.split(r"`+([^`]+)`+", line.replace("\\", "\\\\"))
    for i, part in enumerate(parts):
        code = part.replace("\\\\", "\\")
        parts[i] = f"``{code}``" if i % 2 else re.sub(r"([|*_])", r"\\\1", part)
    return "".join(parts)


def setup(app: Any) -> None:
    """Called by Sphinx."""
    app.connect("autodoc-process-docstring", plain_text)
