"""Formulas as MathML: a browser sets them without a script and without a network."""

from __future__ import annotations

import contextlib
import re
import unicodedata
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.util.logging import getLogger

_SCRIPT = re.compile(r'<mi mathvariant="script">([A-Z])</mi>')


def _inline(translator: Any, node: nodes.math) -> None:
    translator.body.append(_mathml(node, "inline"))
    raise nodes.SkipNode


def _display(translator: Any, node: nodes.math_block) -> None:
    translator.body.append(f'<div class="formula">{_mathml(node, "block")}</div>\n')
    raise nodes.SkipNode


def _mathml(node: nodes.Element, display: str) -> str:
    """The formula of a node; one that cannot be read is a warning at its place."""
    try:
        formula = convert(node.astext(), display=display)
    except Exception as problem:  # the converter's errors have no common class
        getLogger(__name__).warning("%s: %r", node.astext(), problem, location=node)
        return ""
    if "\\" in formula:  # what the converter does not know it leaves as it is
        getLogger(__name__).warning("not understood: %s", node.astext(), location=node)
    return _SCRIPT.sub(_script, formula)


def _script(letter: re.Match[str]) -> str:
    """The letter itself: browsers no longer read the attribute."""
    for block in ("MATHEMATICAL SCRIPT", "SCRIPT"):
        with contextlib.suppress(KeyError):
            return f"<mi>{unicodedata.lookup(f'{block} CAPITAL {letter[1]}')}</mi>"
    raise AssertionError(letter[1])


def setup(app: Any) -> dict[str, bool]:
    """Called by Sphinx."""
    app.add_html_math_renderer("mathml", (_inline, None), (_display, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
