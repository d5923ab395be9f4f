"""`mstmm.write_report`: self-contained HTML report of a run."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from ...argument_validation import abbreviate, optional_text, require_path, require_texts
from ...errors import SceneError
from . import summary_tables
from .curves import curves_html
from .document import page_html
from .equations import equations_html

if TYPE_CHECKING:
    from ...runtime.result.result import Result
    from ...runtime.result.scene3d.view import SceneView

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
    style, formulas = equations_html(result.model.scene)
    sections = (
        ("mechanism", "The mechanism", _view_html(view) + summary_tables.mechanism_html(result)),
        ("run", "The run", summary_tables.settings_html(result)),
        ("curves", "Curves", curves_html(result, quantities)),
        ("certificate", "The certificate", summary_tables.certificate_html(result)),
        ("equations", "The equations", formulas),
        ("provenance", "Provenance", summary_tables.provenance_html(result)),
    )
    page = page_html(title, style, sections, summary_tables.verdict_html(result))
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
