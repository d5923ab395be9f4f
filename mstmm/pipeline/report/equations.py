"""Equations of the elements of a scene, as stated by their definitions."""

from __future__ import annotations

import re

from ...errors import ElementError
from ...notebook_html import collapsible, text
from ...scene import Scene
from ...scene.checks.user_types import used_types


def equations_html(scene: Scene) -> tuple[str, str]:
    """(style, body) with the equations of every built-in element type, collapsed.

    For other elements the body names the file of their definition.
    """
    from ...derive.show.mathml import STYLE
    from ...derive.show.show_page import show_view
    from ...derive.show.subjects import element_view

    parts = []
    for kind, name in sorted(used_types(scene)):
        try:
            shown = element_view(f"{kind}_{name}")
        except ElementError:
            notice = f"{kind} {name}: its equations are in the file of its definition"
            parts.append(f"<p>{text(notice)}</p>")
            continue
        page = show_view(shown, "equations", "html")
        match = re.search(r"<main>\n(.*)\n</main>", page, re.S)
        parts.append(collapsible(shown.title, match[1] if match else ""))
    return STYLE, "".join(parts)
