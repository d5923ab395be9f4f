"""HTML page of a chart: one file, without scripts or network access."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from mstmm.display import escape_control_characters

from .chart_record import ChartRecord, Skipped
from .plot_elements import Entry, build_drawing
from .svg import chart_svg, marker_svg
from .tables import (
    Table,
    level_table,
    point_table,
    recommendation,
    recommendation_table,
    skip_reasons,
)

_STYLE = """
:root { color-scheme: light; --ink: #1b1f24; --soft: #57606a; --line: #d5dae0; }
* { box-sizing: border-box; }
body { margin: 0; background: #fdfdfc; color: var(--ink); font: 15px/1.5 system-ui, sans-serif; }
main { max-width: 66rem; margin: 0 auto; padding: 1.5rem 1.1rem 3rem; }
h1 { font-size: 1.45rem; margin: 0 0 .3rem; overflow-wrap: anywhere; }
h2 { font-size: 1.1rem; margin: 1.8rem 0 .5rem; }
p { margin: .3rem 0; } .soft { color: var(--soft); font-size: .92rem; }
.chart { display: flex; flex-wrap: wrap; gap: .6rem 1.2rem; align-items: flex-start; }
.plane { flex: 1000 1 34rem; min-width: 0; overflow-x: auto; }
.plane svg { display: block; width: 100%; min-width: 34rem; height: auto;
  font: 12px system-ui, sans-serif; }
.keys { flex: 1 1 9.5rem; columns: 9.5rem auto; max-width: 100%; column-gap: .8rem; margin: 0;
  padding: 0; list-style: none; font-size: .82rem; line-height: 1.45; }
.keys li { break-inside: avoid; white-space: nowrap; }
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
table { border-collapse: collapse; font-size: .88rem; } .wide { overflow-x: auto; }
th { text-align: left; font-weight: 600; color: var(--soft); }
th, td { padding: .2rem .9rem .2rem 0; border-bottom: 1px solid var(--line); white-space: nowrap; }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; }
ul.left { font-size: .88rem; padding-left: 1.1rem; } summary { cursor: pointer; }
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
    reference = chart.reference
    body = [
        f"<h1>{escape(escape_control_characters(drawing.title))}: work-precision chart</h1>",
        f'<p class="soft">{escape(_conditions(chart))}</p>',
        f'<p class="soft">Reference: {escape(reference.made_by)}. Its own error is '
        f"{reference.error:.1e}; errors below {reference.smallest_resolved_error:.1e} are not "
        f"resolved. Scaling: {escape(escape_control_characters(reference.scaling))}.</p>",
        *(f"<p>{escape(escape_control_characters(text))}</p>" for text in _scene_notes(chart)),
        '<div class="chart"><div class="plane">', chart_svg(drawing, keys), "</div>",
        _legend(drawing.legend, keys), "</div>",
    ]  # fmt: skip
    if drawing.beyond:
        body.append(
            f'<p class="soft">{drawing.beyond} points with far larger errors are outside the plot.'
            "</p>"
        )
    text = recommendation(chart)
    text = text[:1].upper() + text[1:]
    body += ["<h2>Recommended settings</h2>", f"<p>{escape(escape_control_characters(text))}</p>"]
    if chart.recommendations():
        body.append(_table_html(recommendation_table(chart)))
    if len(chart.model_levels) > 1:
        body += ["<h2>Model levels</h2>", _table_html(level_table(chart))]
    body += [
        "<h2>All runs</h2>", f"<details><summary>{len(chart.points)} settings</summary>",
        _table_html(point_table(chart)), "</details>", _skipped_html(chart.skipped),
    ]  # fmt: skip
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8"/>\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1"/>\n'
        f"<title>{escape(escape_control_characters(drawing.title))}: work-precision chart</title>\n"
        f"<style>{_STYLE}{hover}</style>\n</head>\n<body>\n<main>\n"
        + "\n".join(part for part in body if part)
        + "\n</main>\n</body>\n</html>\n"
    )


def _conditions(chart: ChartRecord) -> str:
    """Simulated time, error measure, timing and budget of the chart."""
    unit = "" if chart.reference.unit == "1" else f" in {chart.reference.unit}"
    return (
        f"{chart.t_end:g} s of motion. Error: largest error of "
        f"{escape_control_characters(chart.reference.measure)}"
        f"{unit} over {chart.sampling_text}. Time: CPU time of the whole call of simulate, the "
        f"smallest of several. Computed in {chart.elapsed:.0f} s of a budget of {chart.budget:g} "
        "s. Hover over a point or a name of the legend for details."
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
        text = escape(escape_control_characters(entry.text))
        if entry.style is None:
            items.append(f'<li class="{"head" if entry.strong else "note"}">{text}</li>')
            continue
        key = f" e{keys[entry.text]}" if entry.text in keys else ""
        shape = marker_svg(entry.style, 7, 7, 5)
        items.append(
            f'<li class="{"strong" if entry.strong else "faint"}{key}"><svg viewBox="0 0 14 14" '
            f'fill="{entry.style.colour}">{shape}</svg>{text}</li>'
        )
    return f'<ul class="keys">{"".join(items)}</ul>'


def _skipped_html(entries: Sequence[Skipped]) -> str:
    parts = []
    for refused, heading in ((True, "Does not apply"), (False, "Left out")):
        items = [
            f"<li>{escape(escape_control_characters(text))}</li>"
            for text in skip_reasons(entries, refused)
        ]
        if items:
            parts.append(f'<h2>{heading}</h2><ul class="left">{"".join(items)}</ul>')
    return "".join(parts)


def _table_html(table: Table) -> str:
    head, numbers, rows = table

    def cells(row: Sequence[str], tag: str) -> str:
        return "".join(
            f"<{tag}{' class=n' * (i in numbers)}>{escape(escape_control_characters(cell))}</{tag}>"
            for i, cell in enumerate(row)
        )

    lines = [f"<tr>{cells(head, 'th')}</tr>", *(f"<tr>{cells(row, 'td')}</tr>" for row in rows)]
    return f'<div class="wide"><table>{"".join(lines)}</table></div>'
