"""The plane of a chart as SVG inside a page: no script, words by the pointer, one look with the
picture."""

from __future__ import annotations

from html import escape

from .chart_points import Point
from .plot_elements import Drawing, Line, Place, decades, time_text
from .plot_styles import MARKS, PlotStyle
from .tables import notes, time_of

#: The plane within its box, in units of the picture; room at the left, below, above, at the right.
WIDTH, HEIGHT = 760.0, 520.0
_LEFT, _BELOW, _ABOVE, _RIGHT = 64.0, 46.0, 12.0, 14.0
#: Radius of a mark that is strong, and of others.
_STRONG, _FAINT = 4.6, 2.6


class Plane:
    """From (log10 error, log10 s) to units of the picture."""

    def __init__(self, made: Drawing) -> None:
        self.x, self.y = made.x, made.y

    def at(self, place: Place) -> Place:
        """Right and down."""
        right = (place[0] - self.x[0]) / (self.x[1] - self.x[0])
        down = (self.y[1] - place[1]) / (self.y[1] - self.y[0])
        return (
            _LEFT + right * (WIDTH - _LEFT - _RIGHT), _ABOVE + down * (HEIGHT - _ABOVE - _BELOW)
        )  # fmt: skip


def svg(made: Drawing, keys: dict[str, int]) -> str:
    """The plane; lines of name `n` have the class `k` + keys[n]."""
    plane = Plane(made)
    if made.empty:
        return (
            f'<svg viewBox="0 0 {WIDTH:g} 60" role="img" aria-label="{escape(made.empty)}">'
            f'<text class="tick mid" x="{WIDTH / 2:g}" y="34">{escape(made.empty)}</text></svg>'
        )
    parts = [
        f'<svg viewBox="0 0 {WIDTH:g} {HEIGHT:g}" role="img" '
        f'aria-label="{escape(made.y_label)} over {escape(made.x_label)}">',
        f'<clipPath id="plane"><rect x="{_LEFT:g}" y="{_ABOVE - 8:g}" '
        f'width="{WIDTH - _LEFT - _RIGHT + 8:g}" height="{HEIGHT - _ABOVE - _BELOW + 8:g}"/>'
        "</clipPath>",
        *_axes(made, plane),
        '<g clip-path="url(#plane)">',
    ]
    if len(made.front) > 1:
        parts.append(f'<polyline class="front" points="{_path(plane, made.front)}"/>')
    parts += [_line(line, plane, keys[line.name]) for line in made.lines]
    for place in made.front:
        x, y = plane.at(place)
        parts.append(f'<circle class="best" cx="{x:.1f}" cy="{y:.1f}" r="7.5"/>')
    for at, colour, name in made.own:
        x, y = plane.at((at, made.y[0]))
        parts.append(
            f'<rect x="{x - 2:.1f}" y="{y - 14:.1f}" width="4" height="14" fill="{colour}">'
            f"<title>{escape(name)} errs by {10**at:.2g}</title></rect>"
        )
    parts.append("</g>")
    for label in made.labels:
        x, y = plane.at(label.place)
        x, y = x + 1.3 * label.at[0], y + 1.3 * label.at[1] + 4
        parts.append(f'<text class="word" x="{x:.1f}" y="{y:.1f}">{escape(label.text)}</text>')
    return "\n".join([*parts, "</svg>"])


def mark(look: PlotStyle, x: float, y: float, size: float) -> str:
    """One mark."""
    corners = MARKS[look.mark]
    if not corners:
        return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{size:g}"/>'
    points = " ".join(f"{x + size * a:.1f},{y + size * b:.1f}" for a, b in corners)
    return f'<polygon points="{points}"/>'


def words(point: Point) -> str:
    """What the pointer is told of a point."""
    assert point.error is not None and point.cpu_s is not None
    counts = [
        f"{count} {name}"
        for count, name in (
            (point.steps, "steps"), (point.evaluations, "evaluations"),
            (point.factorizations, "factorizations"),
        )
        if count
    ]  # fmt: skip
    said = "".join(f"\n{note}" for note in notes(point))
    return (
        f"{point.method}, {point.setting}\n{point.model}\nerror {point.error:.2e}\n"
        f"{time_of(point.cpu_s)} CPU, least of {point.repeats}\n{', '.join(counts)}{said}"
    )


def _axes(made: Drawing, plane: Plane) -> list[str]:
    left, top = plane.at((made.x[0], made.y[1]))
    right, bottom = plane.at((made.x[1], made.y[0]))
    parts = []
    if made.floor > made.x[1]:
        edge = plane.at((made.floor, made.y[1]))[0]
        parts.append(
            f'<rect class="beyond" x="{edge:.1f}" y="{top:.1f}" width="{right - edge:.1f}" '
            f'height="{bottom - top:.1f}"><title>below what the reference can tell</title></rect>'
        )
    for power in decades(*made.x):
        x = plane.at((power, made.y[0]))[0]
        parts.append(f'<path class="grid" d="M{x:.1f} {top:.1f}V{bottom:.1f}"/>')
        sup = f'<tspan dy="-5" font-size="9">{power}</tspan>'
        parts.append(f'<text class="tick mid" x="{x:.1f}" y="{bottom + 17:.1f}">10{sup}</text>')
    for power in decades(*made.y):
        y = plane.at((made.x[0], power))[1]
        parts.append(f'<path class="grid" d="M{left:.1f} {y:.1f}H{right:.1f}"/>')
        parts.append(
            f'<text class="tick end" x="{left - 6:.1f}" y="{y + 4:.1f}">{time_text(power)}</text>'
        )
    parts.append(f'<path class="axis" d="M{left:.1f} {top:.1f}V{bottom:.1f}H{right:.1f}"/>')
    text = f"{made.x_label}  (more accurate to the right)"
    parts.append(
        f'<text class="tick mid" x="{(left + right) / 2:.1f}" y="{HEIGHT - 8:g}">{escape(text)}'
        "</text>"
    )
    middle = (top + bottom) / 2
    parts.append(
        f'<text class="tick mid" transform="translate(13 {middle:.1f}) rotate(-90)">'
        f"{escape(made.y_label)}</text>"
    )
    return parts


def _line(line: Line, plane: Plane, key: int) -> str:
    strong = "strong" if line.strong else "faint"
    parts = [f'<g class="{strong} k{key}" stroke="{line.look.colour}" fill="{line.look.colour}">']
    if line.joined and len(line.points) > 1:
        parts.append(f'<polyline points="{_path(plane, [at for at, _ in line.points])}"/>')
    if line.look.mark:
        size = _STRONG if line.strong else _FAINT
        for place, point in line.points:
            x, y = plane.at(place)
            shape = mark(line.look, x, y, size)
            parts.append(f"<g>{shape}<title>{escape(words(point))}</title></g>")
    return "".join([*parts, "</g>"])


def _path(plane: Plane, places: list[Place]) -> str:
    return " ".join("{:.1f},{:.1f}".format(*plane.at(place)) for place in places)
