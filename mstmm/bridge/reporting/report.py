"""`mstmm.report`: self-contained HTML report of a run."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from ...arguments import path_of, short, text_of, texts_of
from ...errors import SceneError
from . import words
from .curves import curves
from .document import document
from .equations import equations

if TYPE_CHECKING:
    from ...runtime.result.result import Result
    from ...runtime.result.view.view import View

#: Number of times in the strip of pictures.
_MOMENTS = 6


def report(
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
        raise SceneError(f"report: expected a result, found {short(result)}")
    path = path_of("report", path)
    if path.suffix.lower() not in (".html", ".htm"):
        raise SceneError(f'report "{path}": expected a name ending in .html')
    from ...runtime.host.files import write_text

    title = text_of("title", title) or path.stem
    quantities = texts_of("quantities", quantities, "energy")
    seen = result.view(title=title, trails=trails) if len(result.t) else None
    style, formulas = equations(result.model.scene)
    sections = (
        ("mechanism", "The mechanism", _seen(seen) + words.mechanism(result)),
        ("run", "The run", words.made(result)),
        ("curves", "Curves", curves(result, quantities)),
        ("certificate", "The certificate", words.certificate(result)),
        ("equations", "The equations", formulas),
        ("provenance", "Provenance", words.provenance(result)),
    )
    page = document(title, style, sections, words.verdict(result))
    write_text(path, page)
    return path


def _seen(view: View | None) -> str:
    """HTML of a strip of pictures, and of the animation embedded in the page."""
    if view is None:
        return ""
    drawn = b64encode(view.picture(_MOMENTS)).decode("ascii")
    strip = f'<img alt="the mechanism at {_MOMENTS} times" src="data:image/png;base64,{drawn}"/>'
    moving = (
        '<iframe title="animation of the run" data-theme="light" '
        f'srcdoc="{escape(view.html)}"></iframe>'
    )
    return f'<div class="strip">{strip}</div>{moving}'
