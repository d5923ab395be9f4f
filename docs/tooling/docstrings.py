"""Docstrings are plain text: |v| is a length, and an indented line is a display."""

from __future__ import annotations

import re
from typing import Any


def plain_text(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Turn the lines of a docstring into reStructuredText that says the same."""
    out: list[str] = []
    display = False
    for line in lines:
        if line[:1].isspace() and not display:
            out += ["", ".. code-block:: text", ""]
        display = line[:1].isspace() or (display and not line)
        if not display:
            if out and out[-1][:1].isspace():
                out.append("")
            line = _escaped(line)
        out.append(line)
    lines[:] = [*out, ""]


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
