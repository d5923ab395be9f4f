"""Sphinx: the pages of this folder (Markdown) and a reference from the docstrings of every module.

python -m sphinx -W docs build/docs
"""

from __future__ import annotations

import re
from typing import Any

project = "mstmm"
author = "mstmm contributors"
copyright = "2026, mstmm contributors"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.apidoc"]
myst_enable_extensions = ["dollarmath", "amsmath", "deflist"]
myst_heading_anchors = 3
apidoc_modules = [
    {
        "path": "../mstmm",
        "destination": "reference/modules",
        "follow_links": True,
        "separate_modules": True,
        "module_first": True,
        "exclude_patterns": ["**/__main__.py"],
    }
]
autodoc_default_options = {"ignore-module-all": True}  # described where it is defined
autodoc_member_order = "bysource"
autodoc_typehints = "description"
suppress_warnings = ["ref.python"]  # short names that several classes share
toc_object_entries = False


def plain_text(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Our docstrings are plain text: |v| is a length, a * b a product, indented lines a display."""
    out: list[str] = []
    display = False
    for line in lines:
        if line[:1].isspace() and not display:
            out += ["", "::", ""]
        display = line[:1].isspace() or (display and not line)
        if not display:
            if out and out[-1][:1].isspace():
                out.append("")
            parts = re.split(r"`+([^`]+)`+", line.replace("\\", "\\\\"))
            for i, part in enumerate(parts):
                code = part.replace("\\\\", "\\")
                parts[i] = f"``{code}``" if i % 2 else re.sub(r"([|*_])", r"\\\1", part)
            line = "".join(parts)
        out.append(line)
    lines[:] = [*out, ""]


def setup(app: Any) -> None:
    """Called by Sphinx."""
    app.connect("autodoc-process-docstring", plain_text)
