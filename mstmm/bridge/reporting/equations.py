"""Equations of the elements of a scene, as stated by their definitions."""

from __future__ import annotations

import re

from ...errors import ElementError
from ...markup import folded, text
from ...scene import Scene
from ...scene.checks.types import types


def equations(scene: Scene) -> tuple[str, str]:
    """(style, body) with the equations of every built-in element type, collapsed.

    For other elements the body names the file of their definition.
    """
    from ...derive.show.html import STYLE
    from ...derive.show.page import show_view
    from ...derive.show.subjects import view

    parts = []
    for kind, name in sorted(types(scene)):
        try:
            shown = view(f"{kind}_{name}")
        except ElementError:
            missing = f"{kind} {name}: its equations are in the file of its definition"
            parts.append(f"<p>{text(missing)}</p>")
            continue
        page = show_view(shown, "equations", "html")
        found = re.search(r"<main>\n(.*)\n</main>", page, re.S)
        parts.append(folded(shown.title, found[1] if found else ""))
    return STYLE, "".join(parts)
