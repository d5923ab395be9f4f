"""Formulas as MathML: a browser sets them without a script and without a network."""

from __future__ import annotations

import contextlib
import re
import unicodedata
from typing import Any
from xml.etree import ElementTree

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.transforms.post_transforms import SphinxPostTransform
from sphinx.util.logging import getLogger

#: The converter knows the outer environment alone.
_ALIGNED = re.compile(r"\\(begin|end)\{aligned\}")
#: Elements that a browser draws wrong with any other number of parts.
_PARTS = {"msub": 2, "msup": 2, "munder": 2, "mover": 2, "mfrac": 2, "msubsup": 3, "munderover": 3}
#: "+=" and "-=", which the converter takes apart.
_ASSIGNMENT = re.compile(
    r"<mo>(?:<mrow><mo>)?(&#x0002B;|&#x02212;)</mo>(?:</mrow></mo>)?<mo>&#x0003D;</mo>"
)
#: Punctuation behind a formula, which a browser would move to the next line.
_CLOSING = re.compile(r"[.,;:)]+")
_SCRIPT = re.compile(r'<mi mathvariant="script">([A-Z])</mi>')


def _inline(translator: Any, node: nodes.math) -> None:
    formula, closing = _mathml(node, "inline"), node.get("closing", "")
    body = f'<span class="closed">{formula}{closing}</span>' if closing else formula
    translator.body.append(body)
    raise nodes.SkipNode


def _display(translator: Any, node: nodes.math_block) -> None:
    translator.body.append(f'<div class="formula">{_mathml(node, "block")}</div>\n')
    raise nodes.SkipNode


def _mathml(node: nodes.Element, display: str) -> str:
    """The formula of a node; one that cannot be read is a warning at its place."""
    try:
        return mathml(node.astext(), display)
    except Exception as problem:  # the converter's errors have no common class
        getLogger(__name__).warning("%s: %r", node.astext(), problem, location=node)
        return ""


def mathml(latex: str, display: str = "inline") -> str:
    """A formula as MathML, "inline" or as a "block".

    Raises ValueError for what the converter leaves as it is, or makes of the wrong number of parts,
    and what the converter raises.
    """
    found = convert(_ALIGNED.sub(r"\\\1{align*}", latex), display=display)
    found = _ASSIGNMENT.sub(r"<mo>\1&#x0003D;</mo>", found)
    if "\\" in found:
        raise ValueError("a command of it is not understood")
    try:
        root = ElementTree.fromstring(found)
    except ElementTree.ParseError:
        raise ValueError("an environment of it is not understood") from None
    for element in root.iter():
        name = element.tag.rpartition("}")[2]
        if len(element) != _PARTS.get(name, len(element)):
            raise ValueError(f"{name} of {len(element)} parts; put braces around what carries it")
    return _SCRIPT.sub(_script, found)


def _script(letter: re.Match[str]) -> str:
    """The letter itself: browsers no longer read the attribute."""
    for block in ("MATHEMATICAL SCRIPT", "SCRIPT"):
        with contextlib.suppress(KeyError):
            return f"<mi>{unicodedata.lookup(f'{block} CAPITAL {letter[1]}')}</mi>"
    raise AssertionError(letter[1])


class ClosingPunctuation(SphinxPostTransform):
    """Joins the punctuation behind a formula with it."""

    default_priority = 5
    formats = ("html",)

    def run(self, **kwargs: Any) -> None:
        """Called for each page."""
        for formula in list(self.document.findall(nodes.math)):
            text = formula.next_node(descend=False, siblings=True)
            closing = _CLOSING.match(text) if isinstance(text, nodes.Text) else None
            if closing is not None:
                formula["closing"] = closing[0]
                text.parent.replace(text, nodes.Text(text[closing.end() :]))


def setup(app: Any) -> dict[str, bool]:
    """Called by Sphinx."""
    app.add_post_transform(ClosingPunctuation)
    app.add_html_math_renderer("mathml", (_inline, None), (_display, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
