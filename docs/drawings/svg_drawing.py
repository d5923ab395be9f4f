"""Strokes of a drawing: pieces of SVG, in points of the page, y downwards, angles in degrees."""

from __future__ import annotations

from math import atan2, cos, degrees, hypot, radians, sin

#: Its colours are those of the browser, light or dark; a page that has its own sets them again.
STYLE = """\
<style>
  .drawing { color: #24292f; --paint: #3b82c4; --push: #c2410c; --turn: #15803d; }
  @media (prefers-color-scheme: dark) {
    .drawing { color: #d8dee4; --paint: #6cb0ee; --push: #fb923c; --turn: #4ade80; }
  }
  .drawing .line, .drawing .thin { stroke: currentColor; fill: none; stroke-width: 1.4; }
  .drawing .thin { stroke-width: 1; stroke-dasharray: 4 3; }
  .drawing .body { fill: var(--paint); fill-opacity: 0.22; stroke: var(--paint); }
  .drawing .joint { fill: currentColor; fill-opacity: 0.12; stroke: currentColor; }
  .drawing .dot, .drawing .line-tip { fill: currentColor; }
  .drawing .push { stroke: var(--push); fill: none; stroke-width: 2; }
  .drawing .push-tip { fill: var(--push); }
  .drawing .turn { stroke: var(--turn); fill: none; stroke-width: 2; }
  .drawing .turn-tip { fill: var(--turn); }
  .drawing text { fill: currentColor; font: 14px system-ui, sans-serif; text-anchor: middle; }
  .drawing .name { font: italic 17px Georgia, serif; }
</style>
"""
_HEAD = 9.0  # of an arrow, long

Point = tuple[float, float]


def page(width: int, height: int, title: str, *pieces: str) -> str:
    """A drawing; its title is read to those who do not see it."""
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" class="drawing" viewBox="0 0 {width} {height}" '
    )
    head += f'width="{width}" role="img" aria-label="{title}">\n'
    return head + STYLE + "\n".join(pieces) + "\n</svg>\n"


def name(at: Point, letter: str, low: str = "", sign: str = "") -> str:
    """A letter of a formula, with what stands below its line."""
    below = f'<tspan dy="4" font-size="12">{low}</tspan>' if low else ""
    return f'<text class="name" x="{at[0]:g}" y="{at[1]:g}">{sign}{letter}{below}</text>'


def words(at: Point, text: str) -> str:
    """A remark."""
    return f'<text x="{at[0]:g}" y="{at[1]:g}">{text}</text>'


def line(*points: Point, kind: str = "line") -> str:
    """Straight from point to point."""
    return f'<path class="{kind}" d="M{_path(*points)}"/>'


def arrow(start: Point, end: Point, kind: str = "push") -> str:
    """A vector: `push` what acts, `line` a way."""
    angle = atan2(end[1] - start[1], end[0] - start[0])
    return _headed(f"M{_path(start)}L", end, angle, kind)


def turn(about: Point, radius: float, first: float, last: float) -> str:
    """A moment or a turn about a point, counted counter-clockwise on the page from the right."""
    way = 1 if last > first else -1
    start, end = (_around(about, radius, a) for a in (first, last))
    ahead = radians(last) + way * radians(90)
    tip = (end[0] + _HEAD * cos(ahead), end[1] - _HEAD * sin(ahead))
    arc = f"M{_path(start)}A{radius:g} {radius:g} 0 {int(abs(last - first) > 180)} {int(way < 0)} "
    return _headed(arc, tip, -ahead, "turn")


def dot(at: Point) -> str:
    """A point that has a name."""
    return f'<circle class="dot" cx="{at[0]:g}" cy="{at[1]:g}" r="3.2"/>'


def joint(at: Point) -> str:
    """A hinge."""
    return f'<circle class="joint" cx="{at[0]:g}" cy="{at[1]:g}" r="8"/>' + dot(at)


def rod(start: Point, end: Point, half: float = 14.0) -> str:
    """A straight body between its ends."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    place = f"translate({start[0]:g} {start[1]:g}) rotate({degrees(atan2(dy, dx)):.2f})"
    return (
        f'<rect class="body" x="{-half:g}" y="{-half:g}" width="{hypot(dx, dy) + 2 * half:.1f}" '
        f'height="{2 * half:g}" rx="{half:g}" transform="{place}"/>'
    )


def blob(*points: Point) -> str:
    """A body of any shape, smooth through its corners' middles."""
    middles = [
        ((a[0] + b[0]) / 2, (a[1] + b[1]) / 2)
        for a, b in zip(points, (*points[1:], points[0]), strict=True)
    ]
    corners = (*points[1:], points[0])
    bends = (f"Q{_path(c, m)}" for c, m in zip(corners, (*middles[1:], middles[0]), strict=True))
    return f'<path class="body" d="M{_path(middles[0])}{"".join(bends)}z"/>'


def ground(at: Point) -> str:
    """A wall on the left of a point."""
    x, y = at
    hatch = (line((x, h), (x - 10, h + 10)) for h in range(int(y) - 30, int(y) + 25, 10))
    return line((x, y - 30), (x, y + 30)) + "".join(hatch)


def axes(at: Point, angle: float, length: float = 46.0) -> str:
    """Two axes at right angles."""
    ends = (_around(at, length, angle), _around(at, length, angle + 90))
    return "".join(arrow(at, end, "line") for end in ends)


def _around(about: Point, radius: float, angle: float) -> Point:
    return about[0] + radius * cos(radians(angle)), about[1] - radius * sin(radians(angle))


def _path(*points: Point) -> str:
    return " ".join(f"{x:.1f} {y:.1f}" for x, y in points)


def _headed(path: str, tip: Point, angle: float, kind: str) -> str:
    """A path up to the head of an arrow whose tip points along `angle`, clockwise on the page."""
    x, y = tip[0] - _HEAD * cos(angle), tip[1] - _HEAD * sin(angle)
    across = 4 * sin(angle), 4 * cos(angle)
    head = _path(tip, (x - across[0], y + across[1]), (x + across[0], y - across[1]))
    return (
        f'<path class="{kind}" d="{path}{_path((x, y))}"/><path class="{kind}-tip" d="M{head}z"/>'
    )
