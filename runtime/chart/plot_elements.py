"""The picture of a chart before it is drawn: what stands where, for matplotlib and for SVG alike.

Places are (log10 error, log10 seconds); the error falls to the right.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from textwrap import wrap

from .chart_points import Point
from .chart_record import ChartRecord
from .method_families import FAMILIES, family
from .pareto_front import front
from .plot_styles import PlotStyle, mark_of, of_levels, of_methods

Place = tuple[float, float]

#: Runs whose error is this many times the middle one of all curves' first points are beyond the
#: picture.
_WILD = 1e3
#: Room beyond the outermost points, decades.
_MARGIN = 0.25
#: Size of the plane in points, for labels that must not meet; that of a letter.
_PLANE, _LETTER = (450.0, 370.0), (5.3, 11.0)
#: Room for the bars at the bottom, in points.
_BARS = 14.0
#: A word is not said again nearer than this, in points.
_AGAIN = 170.0
#: Letters of a row of the legend.
_ROW = 30
#: Where a label may stand, in points to the right of its point and below it: there nothing else is.
_BESIDE = (
    (0, 15), (24, 15), (-24, 15), (8, 26), (-30, 26), (34, 24), (-16, 36), (24, 36), (-50, 28),
    (0, 46),
)  # fmt: skip


@dataclass(frozen=True)
class Line:
    """Points with one look; `joined` by a line, and `strong` where they matter most."""

    name: str
    look: PlotStyle
    points: tuple[tuple[Place, Point], ...]
    joined: bool
    strong: bool


@dataclass(frozen=True)
class Label:
    """A word beside the point at `place`; its middle is `at` points to the right and down of it."""

    text: str
    place: Place
    at: tuple[float, float]


@dataclass(frozen=True)
class Entry:
    """A line of the legend: a name with a look; without one a heading, or a remark, not strong."""

    text: str
    look: PlotStyle | None = None
    strong: bool = True


@dataclass
class Drawing:
    """Everything that is drawn; `x` runs from the largest to the smallest error."""

    x: tuple[float, float]
    y: tuple[float, float]
    lines: list[Line]
    front: list[Place]
    floor: float
    labels: list[Label]
    legend: list[Entry]
    title: str
    below: str
    x_label: str
    y_label: str = "CPU time of the whole call"
    beyond: int = 0
    empty: str = ""  # why there is nothing to show
    own: list[tuple[float, str, str]] = field(default_factory=list)  # levels' errors: x, colour


def drawing(chart: ChartRecord) -> Drawing:
    """Lay out a chart.  Its front and the methods on it are strong, the others stand behind."""
    placed = {id(p): at for p in chart.points if (at := place(p)) is not None}
    shown = [p for p in chart.points if id(p) in placed]
    x, y = _limits(shown, placed, chart.reference.floor)
    kept = [p for p in shown if placed[id(p)][0] <= x[0] + 1e-9]
    levels = [level.name for level in chart.levels]
    several = len(levels) > 1
    best = [p for p in chart.front if id(p) in placed and p in kept]
    lines = _by_level(kept, placed, levels, chart) if several else _by_method(kept, placed, best)
    steps = [placed[id(p)] for p in best]
    words = [p.model if several else p.method for p in best]
    colours = of_levels(levels)
    reference = chart.reference
    unit = "" if reference.unit == "1" else f" in {reference.unit}"
    return Drawing(
        x, y, lines, steps, math.log10(reference.floor) if reference.floor > 0 else -math.inf,
        _labels(steps, words, x, y), _legend(lines, chart.points, levels),
        chart.title or "cost against accuracy",
        _below(chart),
        f"largest error of {reference.measure}{unit}" + ("" if unit else " (scaled)"),
        beyond=len(shown) - len(kept), empty=_empty(chart, shown),
        own=[
            (math.log10(level.error), colours[level.name], level.name)
            for level in chart.levels
            if several and level.error and level.name != reference.model
        ],
    )  # fmt: skip


def _below(chart: ChartRecord) -> str:
    """What stands below the title."""
    reference = chart.reference
    until = f", {reference.ended}" if reference.ended else ""
    return (
        f"{chart.t_end:g} s of motion{until}; reference: {reference.made_by}, its own error "
        f"{reference.error:.1e}"
    )


def _empty(chart: ChartRecord, shown: Sequence[Point]) -> str:
    """Why there is nothing to show; "" where there is."""
    if shown:
        return ""
    if chart.reference.still:
        return "nothing moves in this scene"
    errors = [point.error for point in chart.points if point.error is not None]
    return "no run has an error above zero" if errors else "no run came to its end"


def place(point: Point) -> Place | None:
    """(log10 error, log10 s); None for a run that failed or cannot stand on such axes."""
    if not point.error or not point.cpu_s:
        return None
    return math.log10(point.error), math.log10(point.cpu_s)


def _limits(shown: Sequence[Point], placed: dict[int, Place], floor: float) -> tuple[Place, Place]:
    if not shown:
        return (0.0, -12.0), (-4.0, 0.0)
    firsts: dict[tuple[str, str], float] = {}
    for point in shown:
        firsts.setdefault(point.curve, placed[id(point)][0])
    middle = sorted(firsts.values())[len(firsts) // 2]
    errors = [placed[id(p)][0] for p in shown]
    times = [placed[id(p)][1] for p in shown]
    largest = min(max(errors), middle + math.log10(_WILD))
    least = min(errors)
    if floor > 0:
        least = max(min(least, math.log10(floor)), math.log10(floor) - 1.0)
    if largest - least < 1.0:
        largest, least = largest + 0.5, least - 0.5
    return (
        (largest + _MARGIN, least - _MARGIN),
        (min(times) - 3 * _MARGIN, max(times) + _MARGIN),
    )


def _by_method(
    points: Sequence[Point], placed: dict[int, Place], best: Sequence[Point]
) -> list[Line]:
    """A line a method; those with a point on the front are strong."""
    methods = _ordered(p.method for p in points)
    looks, strong = of_methods(methods), {p.method for p in best}
    found = []
    for method in methods:
        own = tuple((placed[id(p)], p) for p in points if p.method == method)
        found.append(Line(method, looks[method], own, True, method in strong))
    return sorted(found, key=lambda line: line.strong)


def _by_level(
    points: Sequence[Point], placed: dict[int, Place], levels: Sequence[str], chart: ChartRecord
) -> list[Line]:
    """For every level of model its own front, joined, before the rest of its points, which are
    joined by their methods."""
    colours, found = of_levels(levels), []
    own_errors = {level.name: 1.1 * (level.error or 0.0) for level in chart.levels}
    own_errors[chart.reference.model] = 0.0
    for curve in dict.fromkeys(p.curve for p in points):
        path = tuple((placed[id(p)], p) for p in points if p.curve == curve)
        found.append(Line(curve[0], PlotStyle(colours[curve[0]], ""), path, True, False))
    for strong in (False, True):
        for level in levels:
            own = [p for p in points if p.model == level]
            edge = {id(p) for p in front(own, max(own_errors[level], chart.reference.floor))}
            for mark in dict.fromkeys(mark_of(p.method) for p in own):
                some = tuple(
                    (placed[id(p)], p)
                    for p in own
                    if (id(p) in edge) == strong and mark_of(p.method) == mark
                )
                found.append(Line(level, PlotStyle(colours[level], mark), some, False, strong))
            if strong:
                path = tuple((placed[id(p)], p) for p in own if id(p) in edge)
                path = tuple(sorted(path, key=lambda one: one[0][1]))
                found.append(Line(level, PlotStyle(colours[level], ""), path, True, True))
    return [line for line in found if line.points]


def _ordered(methods: Iterable[str]) -> list[str]:
    """By family, each in the order of its first appearance."""
    names = list(dict.fromkeys(methods))
    return sorted(names, key=lambda name: FAMILIES.index(family(name)))


def _labels(places: Sequence[Place], words: Sequence[str], x: Place, y: Place) -> list[Label]:
    """A word where the front takes up a method (or level), if it finds room beside the point; again
    only far from where it stood last."""

    def on_plane(at: Place) -> Place:
        right = (at[0] - x[0]) / (x[1] - x[0]) * _PLANE[0]
        return right, (y[1] - at[1]) / (y[1] - y[0]) * _PLANE[1]

    points = [on_plane(at) for at in places]
    boxes: list[tuple[float, float, float, float]] = []
    found: list[Label] = []
    last: dict[str, float] = {}
    for i, (at, word) in enumerate(zip(places, words, strict=True)):
        repeated = i > 0 and words[i - 1] == word
        if repeated or points[i][0] - last.get(word, -math.inf) < _AGAIN:
            continue
        wide, high = _LETTER[0] * len(word) / 2, _LETTER[1] / 2
        for right, down in _BESIDE:
            a, b = points[i][0] + right, points[i][1] + down
            box = (a - wide, b - high, a + wide, b + high)
            inside = box[0] > 0 and box[2] < _PLANE[0] and box[1] > 0 and box[3] < _PLANE[1] - _BARS
            if (
                inside
                and not any(_meet(box, other) for other in boxes)
                and not any(
                    box[0] < px < box[2] and box[1] - 3 < py < box[3] + 3 for px, py in points
                )
            ):
                boxes.append(box)
                last[word] = points[i][0]
                found.append(Label(word, at, (right, down)))
                break
    return found


def _meet(a: tuple[float, ...], b: tuple[float, ...]) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def _legend(lines: Sequence[Line], points: Sequence[Point], levels: Sequence[str]) -> list[Entry]:
    """Methods below their families; or levels of model, and the marks of families."""
    if len(levels) > 1:
        colours = of_levels(levels)
        found = [Entry("level of model")]
        found += [Entry(level, PlotStyle(colours[level], "s")) for level in levels]
        found.append(Entry("methods"))
        methods = _ordered(p.method for p in points)
        for name in dict.fromkeys(map(family, methods)):
            own = [method for method in methods if family(method) == name]
            found.append(Entry(name, PlotStyle("#555555", mark_of(own[0]))))
            if own != [name]:
                found += [Entry(row, None, False) for row in wrap(", ".join(own), _ROW)]
        return [*found, Entry("bars below: errors of levels", None, False)]
    found = []
    known = {line.name: line for line in lines}
    for method in (m for m in _ordered(p.method for p in points) if m in known):
        heading = Entry(family(method))
        if heading not in found:
            found.append(heading)
        found.append(Entry(method, known[method].look, known[method].strong))
    return found


def time_text(power: int) -> str:
    """10^power s in words: 1 ms, 10 ms."""
    for unit, exponent in (("s", 0), ("ms", -3), ("µs", -6), ("ns", -9)):
        if power >= exponent:
            return f"{10 ** (power - exponent)} {unit}"
    return f"1e{power} s"


def decades(low: float, high: float) -> list[int]:
    """Whole powers of ten between two."""
    first, last = sorted((low, high))
    return list(range(math.ceil(first), math.floor(last) + 1))
