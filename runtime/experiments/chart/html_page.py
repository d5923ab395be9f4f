"""HTML page of a chart, with its plot as SVG: one file, without scripts or network access."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from mstmm.display import bullets, collapsible, table, text
from mstmm.html_page import html_page

from .chart_record import ChartRecord, Point
from .plot_elements import (
    MARKS,
    Drawing,
    Entry,
    Line,
    PlotStyle,
    Position,
    build_drawing,
    decades,
    time_text,
)
from .tables import (
    Table,
    format_time,
    level_table,
    point_notes,
    point_table,
    recommendation,
    recommendation_table,
    skip_reasons,
)

# --- plot as SVG, styled like the matplotlib plot -------------------------------------------------

#: Size of the drawing and its margins, in SVG user units.
WIDTH, HEIGHT = 760.0, 520.0
_LEFT, _BOTTOM, _TOP, _RIGHT = 64.0, 46.0, 12.0, 14.0
#: Radius of markers of strong lines, and of others.
_STRONG_RADIUS, _FAINT_RADIUS = 4.6, 2.6


class Plane:
    """Mapping from (log10 error, log10 s) to SVG coordinates."""

    def __init__(self, drawing: Drawing) -> None:
        self.x, self.y = drawing.x, drawing.y

    def to_svg(self, place: Position) -> Position:
        """SVG coordinates (x to the right, y down)."""
        right = (place[0] - self.x[0]) / (self.x[1] - self.x[0])
        down = (self.y[1] - place[1]) / (self.y[1] - self.y[0])
        return (
            _LEFT + right * (WIDTH - _LEFT - _RIGHT), _TOP + down * (HEIGHT - _TOP - _BOTTOM)
        )  # fmt: skip


def chart_svg(drawing: Drawing, keys: dict[str, int]) -> str:
    """SVG element of a chart; lines of name `n` have the class `k` + keys[n]."""
    plane = Plane(drawing)
    if drawing.empty:
        return (
            f'<svg viewBox="0 0 {WIDTH:g} 60" role="img" aria-label="{escape(drawing.empty)}">'
            f'<text class="tick mid" x="{WIDTH / 2:g}" y="34">{escape(drawing.empty)}</text></svg>'
        )
    parts = [
        f'<svg viewBox="0 0 {WIDTH:g} {HEIGHT:g}" role="img" '
        f'aria-label="{escape(drawing.y_label)} over {escape(drawing.x_label)}">',
        f'<clipPath id="plane"><rect x="{_LEFT:g}" y="{_TOP - 8:g}" '
        f'width="{WIDTH - _LEFT - _RIGHT + 8:g}" height="{HEIGHT - _TOP - _BOTTOM + 8:g}"/>'
        "</clipPath>",
        *_axes_svg(drawing, plane),
        '<g clip-path="url(#plane)">',
    ]
    if len(drawing.pareto_front) > 1:
        parts.append(
            f'<polyline class="front" points="{_path_points(plane, drawing.pareto_front)}"/>'
        )
    parts += [_line_svg(line, plane, keys[line.name]) for line in drawing.lines]
    for position in drawing.pareto_front:
        x, y = plane.to_svg(position)
        parts.append(f'<circle class="best" cx="{x:.1f}" cy="{y:.1f}" r="7.5"/>')
    for log_error, colour, name in drawing.own:
        x, y = plane.to_svg((log_error, drawing.y[0]))
        parts.append(
            f'<rect x="{x - 2:.1f}" y="{y - 14:.1f}" width="4" height="14" fill="{colour}">'
            f"<title>{escape(name)} has an error of {10**log_error:.2g}</title></rect>"
        )
    parts.append("</g>")
    for label in drawing.labels:
        x, y = plane.to_svg(label.position)
        x, y = x + 1.3 * label.at[0], y + 1.3 * label.at[1] + 4
        parts.append(f'<text class="word" x="{x:.1f}" y="{y:.1f}">{escape(label.text)}</text>')
    return "\n".join([*parts, "</svg>"])


def marker_svg(look: PlotStyle, x: float, y: float, size: float) -> str:
    """SVG element of a marker with its centre at (x, y)."""
    corners = MARKS[look.mark]
    if not corners:
        return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{size:g}"/>'
    points = " ".join(f"{x + size * a:.1f},{y + size * b:.1f}" for a, b in corners)
    return f'<polygon points="{points}"/>'


def tooltip_text(point: Point) -> str:
    """Text of the tooltip of a point."""
    assert point.error is not None and point.cpu_s is not None
    counts = [
        f"{count} {name}"
        for count, name in (
            (point.steps, "steps"), (point.evaluations, "evaluations"),
            (point.factorizations, "factorizations"),
        )
        if count
    ]  # fmt: skip
    note_lines = "".join(f"\n{note}" for note in point_notes(point))
    return (
        f"{point.method}, {point.setting}\n{point.model}\nerror {point.error:.2e}\n"
        f"{format_time(point.cpu_s)} CPU, smallest of {point.repeats}\n"
        f"{', '.join(counts)}{note_lines}"
    )


def _axes_svg(drawing: Drawing, plane: Plane) -> list[str]:
    left, top = plane.to_svg((drawing.x[0], drawing.y[1]))
    right, bottom = plane.to_svg((drawing.x[1], drawing.y[0]))
    parts = []
    if drawing.floor > drawing.x[1]:
        edge = plane.to_svg((drawing.floor, drawing.y[1]))[0]
        parts.append(
            f'<rect class="beyond" x="{edge:.1f}" y="{top:.1f}" width="{right - edge:.1f}" '
            f'height="{bottom - top:.1f}"><title>not resolved by the reference</title></rect>'
        )
    for power in decades(*drawing.x):
        x = plane.to_svg((power, drawing.y[0]))[0]
        parts.append(f'<path class="grid" d="M{x:.1f} {top:.1f}V{bottom:.1f}"/>')
        sup = f'<tspan dy="-5" font-size="9">{power}</tspan>'
        parts.append(f'<text class="tick mid" x="{x:.1f}" y="{bottom + 17:.1f}">10{sup}</text>')
    for power in decades(*drawing.y):
        y = plane.to_svg((drawing.x[0], power))[1]
        parts.append(f'<path class="grid" d="M{left:.1f} {y:.1f}H{right:.1f}"/>')
        parts.append(
            f'<text class="tick end" x="{left - 6:.1f}" y="{y + 4:.1f}">{time_text(power)}</text>'
        )
    parts.append(f'<path class="axis" d="M{left:.1f} {top:.1f}V{bottom:.1f}H{right:.1f}"/>')
    text = f"{drawing.x_label}  (more accurate to the right)"
    parts.append(
        f'<text class="tick mid" x="{(left + right) / 2:.1f}" y="{HEIGHT - 8:g}">{escape(text)}'
        "</text>"
    )
    middle = (top + bottom) / 2
    parts.append(
        f'<text class="tick mid" transform="translate(13 {middle:.1f}) rotate(-90)">'
        f"{escape(drawing.y_label)}</text>"
    )
    return parts


def _line_svg(line: Line, plane: Plane, key: int) -> str:
    strong = "strong" if line.is_emphasised else "faint"
    parts = [f'<g class="{strong} k{key}" stroke="{line.style.colour}" fill="{line.style.colour}">']
    if line.is_connected and len(line.points) > 1:
        parts.append(
            f'<polyline points="{_path_points(plane, [position for position, _ in line.points])}"/>'
        )
    if line.style.mark:
        size = _STRONG_RADIUS if line.is_emphasised else _FAINT_RADIUS
        for position, point in line.points:
            x, y = plane.to_svg(position)
            shape = marker_svg(line.style, x, y, size)
            parts.append(f"<g>{shape}<title>{escape(tooltip_text(point))}</title></g>")
    return "".join([*parts, "</g>"])


def _path_points(plane: Plane, positions: list[Position]) -> str:
    return " ".join("{:.1f},{:.1f}".format(*plane.to_svg(position)) for position in positions)


# --- page -----------------------------------------------------------------------------------------

_STYLE = """
main { max-width: 66rem; }
.chart { display: flex; flex-wrap: wrap; gap: .6rem 1.2rem; align-items: flex-start; }
.plane { flex: 1000 1 34rem; min-width: 0; overflow-x: auto; }
.plane svg { display: block; width: 100%; min-width: 34rem; height: auto;
  font: 12px system-ui, sans-serif; }
.keys { flex: 1 1 9.5rem; columns: 9.5rem auto; max-width: 100%; column-gap: .8rem; margin: 0;
  padding: 0; list-style: none; font: .82rem/1.45 system-ui, sans-serif; }
.keys li { break-inside: avoid; white-space: nowrap; margin: 0; }
.keys .head { font-weight: 600; margin-top: .2rem; break-after: avoid; }
.keys svg { width: 1em; height: 1em; vertical-align: -.1em; margin-right: .35em; }
.keys .note { color: var(--soft); padding-left: 1.35em; white-space: normal; }
.keys .faint { color: var(--soft); }
.grid { stroke: #e6e6e6; stroke-width: .8; } .axis { stroke: #555; fill: none; }
.beyond { fill: #f1f1f1; } .tick { fill: #333; } .mid { text-anchor: middle; }
.end { text-anchor: end; }
.word { text-anchor: middle; font-size: 11.5px; paint-order: stroke; stroke: #fff;
  stroke-width: 3px; pointer-events: none; }
polyline { fill: none; stroke-linejoin: round; stroke-linecap: round; pointer-events: none; }
.strong polyline { stroke-width: 1.9; } .faint polyline { stroke-width: .9; }
.strong g, .faint g { stroke: #fff; stroke-width: .7; cursor: default; }
svg .faint { opacity: .55; } .front { stroke: #111; stroke-width: 10; opacity: .15; }
.best { fill: none; stroke: #111; pointer-events: none; }
svg g g:hover { stroke: #111; stroke-width: 1.6; }
.rows th, .rows td { white-space: nowrap; }
"""


def page(chart: ChartRecord) -> str:
    """HTML page of a chart."""
    drawing = build_drawing(chart)
    keys = {name: i for i, name in enumerate(dict.fromkeys(line.name for line in drawing.lines))}
    hover = "".join(
        f".chart:has(.e{i}:hover) .plane g[class*=k]:not(.k{i}){{opacity:.08}}"
        f".chart:has(.e{i}:hover) .plane .k{i}{{opacity:1}}"
        for i in keys.values()
    )
    reference, title = chart.reference, f"{drawing.title}: work-precision chart"
    body = [
        f"<h1>{text(title)}</h1>",
        f'<p class="soft">{text(_conditions(chart))}</p>',
        f'<p class="soft">Reference: {text(reference.made_by)}. Its own error is '
        f"{reference.error:.1e}; errors below {reference.smallest_resolved_error:.1e} are not "
        f"resolved. Scaling: {text(reference.scaling)}.</p>",
        *(f"<p>{text(note)}</p>" for note in _scene_notes(chart)),
        '<div class="chart"><div class="plane">', chart_svg(drawing, keys), "</div>",
        _legend(drawing.legend, keys), "</div>",
    ]  # fmt: skip
    if drawing.beyond:
        body.append(
            f'<p class="soft">{drawing.beyond} points with far larger errors are outside the plot.'
            "</p>"
        )
    advice = recommendation(chart)
    body += ["<h2>Recommended settings</h2>", f"<p>{text(advice[:1].upper() + advice[1:])}</p>"]
    if chart.recommendations():
        body.append(_table_html(recommendation_table(chart)))
    if len(chart.model_levels) > 1:
        body += ["<h2>Model levels</h2>", _table_html(level_table(chart))]
    all_runs = collapsible(f"{len(chart.points)} settings", _table_html(point_table(chart)))
    body += ["<h2>All runs</h2>", all_runs]
    for refused, heading in ((True, "Does not apply"), (False, "Left out")):
        if reasons := skip_reasons(chart.skipped, refused):
            body += [f"<h2>{heading}</h2>", bullets(reasons)]
    return html_page(title, "\n".join(body), _STYLE + hover)


def _table_html(columns: Table) -> str:
    head, numbers, rows = columns
    return table(rows, head, numbers)


def _conditions(chart: ChartRecord) -> str:
    """Simulated time, error measure, timing and budget of the chart."""
    unit = "" if chart.reference.unit == "1" else f" in {chart.reference.unit}"
    return (
        f"{chart.t_end:g} s of motion. Error: largest error of {chart.reference.measure}{unit} "
        f"over {chart.sampling_text}. Time: CPU time of the whole call of simulate, the smallest "
        f"of several. Computed in {chart.elapsed:.0f} s of a budget of {chart.budget:g} s. Hover "
        "over a point or a name of the legend for details."
    )


def _scene_notes(chart: ChartRecord) -> list[str]:
    """Notes that hold for all runs: early end, no motion, warnings of the scene."""
    ended = chart.reference.stop_event
    notes = [f"Runs end before {chart.t_end:g} s: {ended}."] if ended else []
    if chart.reference.is_static:
        notes.append("The scene has no degrees of freedom: no methods are compared.")
    return [*notes, *(f"Warning: {text}" for text in chart.warnings)]


def _legend(entries: Sequence[Entry], keys: dict[str, int]) -> str:
    items = []
    for entry in entries:
        if entry.style is None:
            kind = "head" if entry.strong else "note"
            items.append(f'<li class="{kind}">{text(entry.text)}</li>')
            continue
        key = f" e{keys[entry.text]}" if entry.text in keys else ""
        shape = marker_svg(entry.style, 7, 7, 5)
        items.append(
            f'<li class="{"strong" if entry.strong else "faint"}{key}"><svg viewBox="0 0 14 14" '
            f'fill="{entry.style.colour}">{shape}</svg>{text(entry.text)}</li>'
        )
    return f'<ul class="keys">{"".join(items)}</ul>'
