"""`mstmm.write_report`: self-contained HTML report of a run, as one page."""

from __future__ import annotations

import re
from base64 import b64encode
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from ...argument_validation import abbreviate, optional_text, require_path, require_texts
from ...display import collapsible, text
from ...errors import ElementError, SceneError
from ...scene.checks.user_types import used_types
from . import summary_tables
from .curves import curves_html

if TYPE_CHECKING:
    from ...runtime.result.result import Result
    from ...runtime.result.scene3d.view import SceneView
    from ...scene import Scene

#: Number of times in the strip of pictures.
_PICTURE_COUNT = 6


def write_report(
    result: Result,
    path: str | Path,
    *,
    title: str | None = None,
    quantities: Sequence[str] = (),
    trails: Sequence[str] = (),
) -> Path:
    """Write a self-contained HTML report of a run, and return its path.

    It has the verdict, an animation, curves, the certificate, the equations of the elements and the
    provenance.  It needs no network.

    Extras: plot, and view for the animation.  `quantities` are those of the curves; default: those
    of `Result.plot`, and the energy.  `trails` as in `Result.view`.  SceneError for a path that
    does not end in .html and for unknown names; EnvironmentFailure without the extras.
    """
    if not hasattr(result, "certificate"):
        raise SceneError(f"report: expected a result, found {abbreviate(result)}")
    path = require_path("report", path)
    if path.suffix.lower() not in (".html", ".htm"):
        raise SceneError(f'report "{path}": expected a name ending in .html')
    from ...runtime.platform_support.safe_files import write_text

    title = optional_text("title", title) or path.stem
    quantities = require_texts("quantities", quantities, "energy")
    view = result.view(title=title, trails=trails) if len(result.t) else None
    style, formulas = _equations_html(result.model.scene)
    sections = (
        ("mechanism", "The mechanism", _view_html(view) + summary_tables.mechanism_html(result)),
        ("run", "The run", summary_tables.settings_html(result)),
        ("curves", "Curves", curves_html(result, quantities)),
        ("certificate", "The certificate", summary_tables.certificate_html(result)),
        ("equations", "The equations", formulas),
        ("provenance", "Provenance", summary_tables.provenance_html(result)),
    )
    page = _page_html(title, style, sections, summary_tables.verdict_html(result))
    write_text(path, page)
    return path


def _view_html(view: SceneView | None) -> str:
    """HTML of a strip of pictures, and of the animation embedded in the page."""
    if view is None:
        return ""
    picture = b64encode(view.strip_png(_PICTURE_COUNT)).decode("ascii")
    strip = (
        f'<img alt="the mechanism at {_PICTURE_COUNT} times" '
        f'src="data:image/png;base64,{picture}"/>'
    )
    animation = (
        '<iframe title="animation of the run" data-theme="light" '
        f'srcdoc="{escape(view.html)}"></iframe>'
    )
    return f'<div class="strip">{strip}</div>{animation}'


def _equations_html(scene: Scene) -> tuple[str, str]:
    """(style, body) with the equations of the built-in element types of a scene, collapsed.

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


# --- page -----------------------------------------------------------------------------------------

#: Nothing is loaded from elsewhere: scripts and pictures are part of the page.  The animation needs
#: 'unsafe-eval' for the decoder of viser, which is compiled to WebAssembly.
_CONTENT_SECURITY_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval' blob: data:; "
    "style-src 'unsafe-inline'; img-src data: blob:; font-src data:; worker-src blob:; "
    "connect-src data: blob:; frame-src 'self'"
)

_STYLE = """
.verdict { border-left: .45rem solid var(--mark); background: var(--block); padding: .7rem 1rem;
  border-radius: 4px; margin: 1rem 0; } .verdict b { color: var(--mark); }
.good { --mark: #2d7d46; } .open { --mark: #a06a00; } .bad { --mark: #b3261e; }
.wide { overflow-x: auto; } nav { font-size: .92rem; } nav a { margin-right: 1.1em; }
table.rows { border-collapse: collapse; font-size: .93rem; }
table.rows th { text-align: left; font-weight: 600; color: var(--soft); white-space: nowrap; }
table.rows th, table.rows td { padding: .28rem 1rem .28rem 0; vertical-align: baseline;
  border-bottom: 1px solid var(--line); }
:root { color-scheme: light; }
iframe { width: 100%; height: 30rem; border: 1px solid var(--line); border-radius: 6px; }
.strip img { width: 100%; height: auto; } .curves { min-height: 10rem; overflow: hidden; }
ul { padding-left: 1.2rem; margin: .4rem 0; } li { margin: .2rem 0; }
details { margin: .6rem 0; } summary { cursor: pointer; color: var(--accent); }
details > h1 { font-size: 1.2rem; margin-top: .8rem; }
a { color: var(--accent); }
@media (max-width: 40rem) {
  .long tr { display: grid; grid-template-columns: repeat(3, auto); border-bottom: 1px solid
    var(--line); padding: .2rem 0; }
  .long tr > :last-child { grid-column: 1 / -1; } .long tr > * { border: 0 !important; }
}
"""


def _page_html(title: str, style: str, sections: Sequence[tuple[str, str, str]], head: str) -> str:
    """Build the whole page from sections (name, title, body); empty bodies are left out.

    The name of a section is the target of links.
    """
    filled_sections = [entry for entry in sections if entry[2]]
    links = "".join(
        f'<a href="#{name}">{text(heading)}</a>' for name, heading, _ in filled_sections
    )
    body = "\n".join(
        f'<section id="{name}"><h2>{text(heading)}</h2>\n{content}</section>'
        for name, heading, content in filled_sections
    )
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8"/>\n'
        f'<meta http-equiv="Content-Security-Policy" content="{_CONTENT_SECURITY_POLICY}"/>\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1"/>\n'
        f"<title>{text(title)}</title>\n<style>{style}{_STYLE}</style>\n</head>\n<body>\n<main>\n"
        f"<h1>{text(title)}</h1>\n{head}\n<nav>{links}</nav>\n{body}\n</main>\n</body>\n</html>\n"
    )
