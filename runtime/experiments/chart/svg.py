"""SVG plot of a chart for its HTML page, without scripts, styled like the matplotlib plot."""

from __future__ import annotations

from html import escape

from .chart_record import Point
from .plot_elements import Drawing, Line, Position, decades, time_text
from .plot_styles import MARKS, PlotStyle
from .tables import format_time, point_notes

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
