"""`mstmm.report`: one page that tells a run to somebody who was not there."""

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

#: Moments of the strip.
_MOMENTS = 6


def report(
    result: Result,
    path: str | Path,
    *,
    title: str | None = None,
    quantities: Sequence[str] = (),
    trails: Sequence[str] = (),
) -> Path:
    """Write one page that needs no network: what the run is and whether it can be trusted, how it
    moves, curves, certificate, equations of its elements, provenance; returns the path.

    Extras: plot, and view for what moves.  `quantities` are those of the curves, by default what
    `Result.plot` chooses, and the energy; `trails` as in `Result.view`.  SceneError for a path that
    does not end in .html and for names that there are not; EnvironmentFailure without the extras.
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
        ("provenance", "Where it comes from", words.provenance(result)),
    )
    page = document(title, style, sections, words.verdict(result))
    write_text(path, page)
    return path


def _seen(view: View | None) -> str:
    """A strip of moments, and the page that moves inside this one."""
    if view is None:
        return ""
    drawn = b64encode(view.picture(_MOMENTS)).decode("ascii")
    strip = f'<img alt="the mechanism at {_MOMENTS} moments" src="data:image/png;base64,{drawn}"/>'
    moving = (
        '<iframe title="the run as it moves" data-theme="light" '
        f'srcdoc="{escape(view.html)}"></iframe>'
    )
    return f'<div class="strip">{strip}</div>{moving}'
