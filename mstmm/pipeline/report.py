"""`mstmm.write_report`: self-contained HTML report of a run, as one page."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterator, Sequence
from html import escape
from math import ceil, log10
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from ..argument_validation import abbreviate, optional_text, require_path, require_texts
from ..display import bullets, collapsible, table, text
from ..errors import ElementError, SceneError
from ..html_page import html_page
from ..optional_packages import missing_package_error
from ..scene.checks.user_types import used_types

if TYPE_CHECKING:
    from ..runtime.result.plotting.panels import Panel, Trace
    from ..runtime.result.result import Result
    from ..runtime.result.scene3d.view import SceneView
    from ..runtime.run.error_estimate import ErrorEstimate
    from ..scene import Scene

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
    from ..runtime.platform_support.safe_files import write_text

    title = optional_text("title", title) or path.stem
    quantities = require_texts("quantities", quantities, "energy")
    view = result.view(title=title, trails=trails) if len(result.t) else None
    sections = (
        ("mechanism", "The mechanism", _view_html(view) + mechanism_html(result)),
        ("run", "The run", settings_html(result)),
        ("curves", "Curves", curves_html(result, quantities)),
        ("certificate", "The certificate", certificate_html(result)),
        ("equations", "The equations", _equations_html(result.model.scene)),
        ("provenance", "Provenance", provenance_html(result)),
    )
    write_text(path, _page_html(title, sections, verdict_html(result)))
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


def _equations_html(scene: Scene) -> str:
    """Equations of the built-in element types of a scene, collapsed.

    For other elements there is the file of their definition.
    """
    from ..derive.show.show_page import html_body
    from ..derive.show.subjects import element_view

    parts = []
    for kind, name in sorted(used_types(scene)):
        try:
            shown = element_view(f"{kind}_{name}")
        except ElementError:
            notice = f"{kind} {name}: its equations are in the file of its definition"
            parts.append(f"<p>{text(notice)}</p>")
        else:
            parts.append(collapsible(shown.title, html_body(shown)))
    return "".join(parts)


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
nav { font-size: .92rem; } nav a { margin-right: 1.1em; } table.rows th { white-space: nowrap; }
iframe { width: 100%; height: 30rem; border: 1px solid var(--line); border-radius: 6px; }
.strip img { width: 100%; height: auto; } .curves { min-height: 10rem; overflow: hidden; }
details > h1 { font-size: 1.2rem; margin-top: .8rem; }
@media (max-width: 40rem) {
  .long tr { display: grid; grid-template-columns: repeat(3, auto); border-bottom: 1px solid
    var(--line); padding: .2rem 0; }
  .long tr > :last-child { grid-column: 1 / -1; } .long tr > * { border: 0 !important; }
}
"""


def _page_html(title: str, sections: Sequence[tuple[str, str, str]], head: str) -> str:
    """Build the whole page from sections (name, title, body); empty bodies are left out.

    The name of a section is the target of links.
    """
    from ..derive.show.show_page import STYLE

    filled_sections = [entry for entry in sections if entry[2]]
    links = "".join(
        f'<a href="#{name}">{text(heading)}</a>' for name, heading, _ in filled_sections
    )
    body = "\n".join(
        f'<section id="{name}"><h2>{text(heading)}</h2>\n{content}</section>'
        for name, heading, content in filled_sections
    )
    contents = f"<h1>{text(title)}</h1>\n{head}\n<nav>{links}</nav>\n{body}"
    return html_page(title, contents, STYLE + _STYLE, policy=_CONTENT_SECURITY_POLICY)


# --- interactive curves, in the panels of `Result.plot` (extra: plot) -----------------------------

#: Largest number of curves in one panel, and of points of a curve.
_MAX_CURVES, _MAX_POINTS = 12, 1500
#: Pixels: height of a panel, of a line of its title and of its legend; spaces above the legend and
#: between panels.
_PANEL_HEIGHT, _TITLE_LINE_HEIGHT, _LEGEND_LINE_HEIGHT, _LEGEND_SPACE, _PANEL_SPACE = (
    210,
    19,
    18,
    8,
    28,
)
#: Largest number of characters of a line of a title.
_MAX_TITLE_LENGTH = 42
#: Pixels: width of a legend in narrow windows, of the line of an entry, and of each character.
_LEGEND_WIDTH, _LEGEND_ENTRY_WIDTH, _CHARACTER_WIDTH = 285, 50, 6.0
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#555555", "#8a7a00")
#: Position of a legend: between title and panel, so that it covers no curve in narrow windows.
_LEGEND_STYLE = {
    "x": 0, "xanchor": "left", "yanchor": "bottom", "orientation": "h", "font": {"size": 11},
}  # fmt: skip


def curves_html(result: Result, names: Sequence[str]) -> str:
    """HTML of quantities over time; without names those of `Result.plot`, and the energy.

    SceneError for an unknown name.
    """
    if len(result.t) < 2:
        return ""
    try:
        from plotly import graph_objects, subplots
    except ImportError as error:
        raise missing_package_error("plot", "the curves of a report", error) from None
    from ..runtime.result.plotting.panels import constant_axis_limits

    panels_shown = _select_panels(result, names)
    titles = [wrap(panel.title, _MAX_TITLE_LENGTH) for panel in panels_shown]
    figure = subplots.make_subplots(
        rows=len(panels_shown), cols=1, shared_xaxes=True,
        subplot_titles=["<br>".join(map(text, lines)) for lines in titles],
    )  # fmt: skip
    for row, panel in enumerate(panels_shown, 1):
        legend = f"legend{row if row > 1 else ''}"
        for k, trace in enumerate(panel.traces[:_MAX_CURVES]):
            x, y = _reduce_points(trace)
            figure.add_trace(
                graph_objects.Scatter(
                    x=x, y=y, name=text(trace.label), mode="lines",
                    line={"color": _COLOURS[k % 8]}, legend=legend, hovertemplate="%{y:.6g}",
                ),
                row=row, col=1,
            )  # fmt: skip
        figure.update_yaxes(range=constant_axis_limits(panel), row=row, col=1)
    height = _place_panels(
        figure, [_legend_height(panel) for panel in panels_shown], [*map(len, titles)]
    )
    figure.update_annotations(x=0, xanchor="left", align="left", font={"size": 13})
    figure.update_xaxes(title_text="time (s)", row=len(panels_shown), col=1)
    figure.update_layout(
        height=height + 85, margin={"l": 60, "r": 10, "t": 40, "b": 45},
        hovermode="x unified", template="plotly_white",
    )  # fmt: skip
    plot_html: str = figure.to_html(
        full_html=False, include_plotlyjs=True, config={"displaylogo": False, "responsive": True}
    )
    notes = "".join(f"<p>{text(note)}</p>" for panel in panels_shown for note in panel.notes)
    return f'<div class="curves">{plot_html}</div>{notes}'


def _place_panels(figure: Any, legends: Sequence[int], lines: Sequence[int]) -> int:
    """Place the panels below each other, under title and legend; returns the height in pixels."""
    heads = [
        _TITLE_LINE_HEIGHT * line_count + legend
        for line_count, legend in zip(lines, legends, strict=True)
    ]
    total_height = sum(heads) + _PANEL_HEIGHT * len(heads) + _PANEL_SPACE * (len(heads) - 1)
    height_above = 0
    for row, (head, legend) in enumerate(zip(heads, legends, strict=True), 1):
        top, bottom = (
            1 - (height_above + head) / total_height,
            1 - (height_above + head + _PANEL_HEIGHT) / total_height,
        )
        height_above += head + _PANEL_HEIGHT + _PANEL_SPACE
        figure.update_yaxes(domain=(max(0.0, bottom), top), row=row, col=1)
        figure.layout.annotations[row - 1].update(y=top, yshift=legend)
        name = f"legend{row if row > 1 else ''}"
        figure.update_layout({name: {**_LEGEND_STYLE, "y": top, "visible": legend > 0}})
    return total_height


def _legend_height(panel: Panel) -> int:
    """Height of a legend in a narrow window, in pixels; 0 without a legend."""
    labels = [trace.label for trace in panel.traces[:_MAX_CURVES]]
    if len(labels) < 2:
        return 0
    columns = max(
        1, int(_LEGEND_WIDTH / (_LEGEND_ENTRY_WIDTH + _CHARACTER_WIDTH * max(map(len, labels))))
    )
    return _LEGEND_LINE_HEIGHT * ceil(len(labels) / columns) + _LEGEND_SPACE


def _select_panels(result: Result, names: Sequence[str]) -> list[Panel]:
    from ..runtime.result.plotting.panels import PlotSelection, build_panels

    runs = {"run": result}
    if names:
        return build_panels(runs, PlotSelection(tuple(dict.fromkeys(names))))
    return [*build_panels(runs, PlotSelection()), *build_panels(runs, PlotSelection(("energy",)))]


def _reduce_points(trace: Trace) -> tuple[Any, Any]:
    """Points (x, y) of a curve, reduced to as many as can be seen."""
    indices = np.unique(np.linspace(0, len(trace.x) - 1, _MAX_POINTS).round().astype(int))
    return trace.x[indices], trace.y[indices]


# --- sentences and tables that summarise a run ----------------------------------------------------

#: Largest number of bodies and hinges in a list.
_MAX_LISTED = 200
#: Relative error from which on no digits are reported, and largest number of digits reported.
_MAX_ERROR_WITH_DIGITS, _MAX_DIGITS = 0.01, 12
#: Largest number of constraint rows in a list.
_MAX_LISTED_ROWS = 12


def verdict_html(result: Result) -> str:
    """HTML of the verdict: whether, to how many digits and until when the numbers are reliable."""
    verdict = result.certificate.verdict()
    kind = "bad" if verdict.objections else "good" if verdict.trusted else "open"
    parts, _, reason = str(verdict).partition(": ")
    lines = [f"<p><b>{text(parts[0].upper() + parts[1:])}</b>: {text(reason)}.</p>"]
    lines += [f"<p>{text(sentence)}</p>" for sentence in _error_sentences(result)]
    reasons = bullets(verdict.objections) if len(verdict.objections) > 1 else ""
    return f'<div class="verdict {kind}">{"".join(lines)}{reasons}</div>'


def _error_sentences(result: Result) -> Iterator[str]:
    """Sentences on the size of the error, and until when it applies."""
    certificate, estimate = result.certificate, result.achieved_error
    if estimate is not None:
        yield f"Target error: {estimate}"
    error, predictable_until = certificate.error, certificate.predictable_until
    if error is not None:
        end = float(result.t[-1]) if predictable_until is None else predictable_until
        units = ", ".join(f"{v:.1e} {u or '1'}" for u, v in error.largest("q").items())
        yield (
            f"Up to t = {end:.4g} s a second, more accurate run differs by at most {units}"
            f"{_digits_clause(error)}."
        )
    if predictable_until is not None:
        yield (
            f"From t = {predictable_until:.3g} s on accurate runs diverge: later values are one "
            "possible motion, but no prediction."
        )
    if error is not None or estimate is not None:
        yield f"The error refers to {certificate.error_scope}."


def _digits_clause(error: ErrorEstimate) -> str:
    """Clause with the number of reliable digits of coordinates, relative to their excursion."""
    shares = [value / error.excursion.get(unit, 0.0) for unit, value in error.largest("q").items()
              if error.excursion.get(unit, 0.0) > 0]  # fmt: skip
    largest_share = max(shares, default=0.0)
    if not shares or largest_share >= _MAX_ERROR_WITH_DIGITS:
        return ""
    digits = _MAX_DIGITS if largest_share <= 10.0**-_MAX_DIGITS else int(-log10(largest_share))
    suffix = " or more" if digits == _MAX_DIGITS else ""
    return f", which is {digits} digits{suffix} of the largest excursion of coordinates"


def settings_html(result: Result) -> str:
    """HTML of the settings of a run, and of the choices made for it."""
    settings, statistics, model = result.settings, result.statistics, result.model
    accuracy = f"step {settings.step:g} s" if settings.step is not None else (
        f"rtol {settings.rtol:g}, atol {settings.atol:g}"
    )  # fmt: skip
    rows = [
        ("time", f"{settings.t_start:g} to {settings.t_end:g} s, {len(result.t)} samples"),
        ("outcome", result.message), ("method", f"{settings.method}, {accuracy}"),
        ("engine", model.engine_reason or model.engine), ("sweep", model.sweep),
    ]  # fmt: skip
    if statistics is not None:
        rows.append(("steps", f"{statistics.steps}, {statistics.rejected_steps} rejected"))
        rows.append(("evaluations", f"{statistics.evaluations}"))
    method_texts = [str(stretch) for stretch in result.method_history]
    choices = (
        collapsible("Methods chosen, with time and reason", bullets(method_texts))
        if method_texts
        else ""
    )
    return table(rows) + choices + _simplifications_html(result)


def _simplifications_html(result: Result) -> str:
    """HTML of model levels of flexible bodies with their limits, and of simplifications."""
    rows = [
        (name, body.n, body.frame, "; ".join(body.notes) or "nothing")
        for name, body in result.model.flexible_bodies.items()
    ]
    head = ("flexible body", "shapes", "floating frame", "notes")
    html = f'<div class="long">{table(rows, head)}</div>' if rows else ""
    if simplifications := [str(simplification) for simplification in result.model.simplifications]:
        html += collapsible(
            "Simplifications of the scene before compilation", bullets(simplifications)
        )
    return f"<h3>Simplifications</h3>{html}" if html else ""


def mechanism_html(result: Result) -> str:
    """HTML lists of bodies and hinges, and of closed loops."""
    scene = result.model.scene
    hinges = [
        (hinge.name, hinge.type, hinge.inboard, hinge.outboard)
        for hinge in list(scene.hinges[:_MAX_LISTED])
    ]
    bodies = [
        (
            body.name,
            "flexible" if body.name in result.model.flexible_bodies else f"{body.mass:g} kg",
            ", ".join(body.ends) or "none",
        )
        for body in list(scene.skeleton.bodies[:_MAX_LISTED])
    ]
    count = f"{len(scene.skeleton.bodies)} bodies, {len(scene.hinges)} hinges"
    lists = table(hinges, ("hinge", "type", "inboard", "outboard"))
    lists += "<p></p>" + table(bodies, ("body", "mass", "ends"))
    return collapsible(count, lists) + _loops_html(result)


def _loops_html(result: Result) -> str:
    """HTML of closed loops: cut hinges, rank, mobility and indeterminate loads."""
    if result.model.loop_start is None:
        return ""
    loops = result.model.loop_start.loops
    rows = [
        (
            "loops closed by",
            ", ".join(loops.cut_hinges[:_MAX_LISTED_ROWS]) or "constraints and couplings",
        ),
        ("independent rows", f"{loops.rank} of {len(loops.constraint_rows)}"),
        ("mobility", loops.mobility),
        ("redundant rows", loops.redundant_text(_MAX_LISTED_ROWS) or "none"),
        ("indeterminate loads", loops.indeterminate_text or "none"),
    ]
    if loops.singular:
        rows.append(
            ("start", f"singular configuration: {loops.generic_rank} independent rows nearby")
        )
    return "<h3>Closed loops</h3>" + table(rows)


def certificate_html(result: Result) -> str:
    """HTML of all lines of the certificate, and of the risks with their remedies."""
    body = table(result.certificate.as_pairs(verdict=False, warnings=False))
    risks = [(risk.element, risk.description, risk.remedy) for risk in result.risks]
    if risks:
        body += "<h3>Risks</h3>" + table(risks, ("element", "finding", "remedy"))
    return body


def provenance_html(result: Result) -> str:
    """HTML of versions, hashes, and the scene with every default filled in."""
    from ..runtime.kernels.prebuilt_kernels import kernels_hash
    from ..runtime.result.export.provenance import program_versions, scene_hash

    rows = [*program_versions().items(), ("scene, SHA-256", scene_hash(result)),
            ("kernels, SHA-256", kernels_hash(result.model.known))]  # fmt: skip
    scene = result.model.scene.to_toml()
    return table(rows) + collapsible("The scene", f"<pre>{text(scene)}</pre>")
