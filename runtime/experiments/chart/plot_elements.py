"""Layout of the plot of a chart, independent of the backend (matplotlib or SVG).

Positions are (log10 error, log10 CPU time in s); the error decreases to the right.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from math import cos, pi, sin
from textwrap import wrap

from ..method_families import FAMILIES, family
from .chart_record import ChartRecord, Point, pareto_front

# --- colours and markers: by family of methods, and by model level --------------------------------

#: Lightest and darkest colour of each family, in the order of FAMILIES.
_RANGES = (
    ("#111111", "#111111"), ("#f7b267", "#9a3c00"), ("#f28b95", "#8c0f1f"), ("#b58fd6", "#5e3c99"),
    ("#a3d39c", "#14622f"), ("#00868b", "#00868b"), ("#c8a165", "#7a5a1e"), ("#9cc3e6", "#17457a"),
    ("#a9a9a9", "#5f5f5f"),
)  # fmt: skip

#: Markers by their matplotlib name, as corners in units of the marker radius (y downwards); a
#: circle has none.
MARKS: dict[str, tuple[tuple[float, float], ...]] = {
    "o": (),
    "s": ((-0.85, -0.85), (0.85, -0.85), (0.85, 0.85), (-0.85, 0.85)),
    "^": ((0.0, -1.1), (1.05, 0.8), (-1.05, 0.8)),
    "D": ((0.0, -1.15), (1.15, 0.0), (0.0, 1.15), (-1.15, 0.0)),
    "v": ((0.0, 1.1), (1.05, -0.8), (-1.05, -0.8)),
    "p": ((0.0, -1.1), (1.05, -0.34), (0.65, 0.89), (-0.65, 0.89), (-1.05, -0.34)),
    "*": tuple((r * sin(k * pi / 5), -r * cos(k * pi / 5)) for k, r in enumerate((1.35, 0.55) * 5)),
    "P": (
        (-0.4, -1.1),
        (0.4, -1.1),
        (0.4, -0.4),
        (1.1, -0.4),
        (1.1, 0.4),
        (0.4, 0.4),
        (0.4, 1.1),
        (-0.4, 1.1),
        (-0.4, 0.4),
        (-1.1, 0.4),
        (-1.1, -0.4),
        (-0.4, -0.4),
    ),
    "h": ((0.0, -1.1), (0.95, -0.55), (0.95, 0.55), (0.0, 1.1), (-0.95, 0.55), (-0.95, -0.55)),
}
_FAMILY_MARKS = ("*", "s", "o", "p", "^", "v", "h", "D", "P")

#: Colours by `_COLOUR_INDEX` of the model level (Okabe and Ito 2008, darkened).
_LEVEL_COLOURS = ("#7a7a7a", "#c98a00", "#3a9bd9", "#c0392b", "#1f7a4d")


@dataclass(frozen=True)
class PlotStyle:
    """Colour, and marker as a key of MARKS."""

    colour: str
    mark: str


def method_styles(methods: Sequence[str]) -> dict[str, PlotStyle]:
    """Style of each method; the colours of a family go from light to dark."""
    styles = {}
    for name, (light, dark), mark in zip(FAMILIES, _RANGES, _FAMILY_MARKS, strict=True):
        family_methods = [method for method in methods if family(method) == name]
        for i, method in enumerate(family_methods):
            fraction = i / (len(family_methods) - 1) if len(family_methods) > 1 else 1.0
            styles[method] = PlotStyle(_mix_colours(light, dark, fraction), mark)
    return styles


def level_colours(levels: Sequence[str]) -> dict[str, str]:
    """Colour of each model level: one per kind, darker with more shapes."""
    kinds = list(dict.fromkeys(map(_level_kind, levels)))
    colours = {}
    for kind in kinds:
        kind_levels = [level for level in levels if _level_kind(level) == kind]
        base = _LEVEL_COLOURS[_COLOUR_INDEX.get(kind, 0)]
        for i, level in enumerate(kind_levels):
            fraction = (len(kind_levels) - 1 - i) / max(1, len(kind_levels))
            colours[level] = _mix_colours(base, "#ffffff", 0.6 * fraction)
    return colours


_COLOUR_INDEX = {"rigid": 0, "one-way": 1, "linear": 2, "stiffened": 3, "planar": 4}


def _level_kind(level: str) -> str:
    return level.partition(",")[0]


def family_mark(method: str) -> str:
    """Marker of the family of a method."""
    return _FAMILY_MARKS[FAMILIES.index(family(method))]


def _mix_colours(a: str, b: str, fraction: float) -> str:
    """Colour at a fraction between two, in red, green and blue."""
    ends = zip(_rgb(a), _rgb(b), strict=True)
    return "#" + "".join(f"{round(x + fraction * (y - x)):02x}" for x, y in ends)


def _rgb(colour: str) -> tuple[int, int, int]:
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return red, green, blue


# --- layout ---------------------------------------------------------------------------------------

Position = tuple[float, float]

#: Points with an error above this many times the median error of the first points of all curves are
#: outside the plot.
_OUTLIER_FACTOR = 1e3
#: Margin beyond the outermost points, decades.
_MARGIN = 0.25
#: Size of the plot area and of a character, for labels that must not overlap, in points (1/72 in).
_PLOT_SIZE, _CHARACTER_SIZE = (450.0, 370.0), (5.3, 11.0)
#: Height reserved for the bars at the bottom, in points (1/72 in).
_BAR_HEIGHT = 14.0
#: Smallest distance between two labels with the same text, in points (1/72 in).
_REPEAT_DISTANCE = 170.0
#: Characters in a row of the legend.
_LEGEND_COLUMNS = 30
#: Offsets (right, down) from a point to its label in the order of preference, in points (1/72 in).
_LABEL_OFFSETS = (
    (0, 15), (24, 15), (-24, 15), (8, 26), (-30, 26), (34, 24), (-16, 36), (24, 36), (-50, 28),
    (0, 46),
)  # fmt: skip


@dataclass(frozen=True)
class Line:
    """Points with the same style; `is_connected` by a line, and `is_emphasised` if emphasised."""

    name: str
    style: PlotStyle
    points: tuple[tuple[Position, Point], ...]
    is_connected: bool
    is_emphasised: bool


@dataclass(frozen=True)
class Label:
    """Text near the point at `position`; its centre is offset by `at` (right, down), in 1/72 in."""

    text: str
    position: Position
    at: tuple[float, float]


@dataclass(frozen=True)
class Entry:
    """Row of the legend: a name with a style; without style a heading if `strong`, else a note."""

    text: str
    style: PlotStyle | None = None
    strong: bool = True


@dataclass
class Drawing:
    """All elements of the plot; `x` goes from the largest to the smallest log10 error."""

    x: tuple[float, float]
    y: tuple[float, float]
    lines: list[Line]
    pareto_front: list[Position]
    floor: float
    labels: list[Label]
    legend: list[Entry]
    title: str
    below: str
    x_label: str
    y_label: str = "CPU time of the whole call"
    beyond: int = 0
    empty: str = ""  # reason why there is nothing to plot
    own: list[tuple[float, str, str]] = field(
        default_factory=list
    )  # of levels: log10 error, colour, name


def build_drawing(chart: ChartRecord) -> Drawing:
    """Lay out a chart; its Pareto front and the methods on it are emphasised."""
    positions = {
        id(p): position for p in chart.points if (position := plot_position(p)) is not None
    }
    shown = [p for p in chart.points if id(p) in positions]
    x, y = _limits(shown, positions, chart.reference.smallest_resolved_error)
    kept = [p for p in shown if positions[id(p)][0] <= x[0] + 1e-9]
    levels = [level.name for level in chart.model_levels]
    has_levels = len(levels) > 1
    front = [p for p in chart.pareto_front if id(p) in positions and p in kept]
    lines = (
        _level_lines(kept, positions, levels, chart)
        if has_levels
        else _method_lines(kept, positions, front)
    )
    front_positions = [positions[id(p)] for p in front]
    front_names = [p.model if has_levels else p.method for p in front]
    colours = level_colours(levels)
    reference = chart.reference
    unit = "" if reference.unit == "1" else f" in {reference.unit}"
    return Drawing(
        x, y, lines, front_positions, math.log10(reference.smallest_resolved_error)
        if reference.smallest_resolved_error > 0
        else -math.inf, _labels(front_positions, front_names, x, y),
        _legend(lines, chart.points, levels), chart.title or "work-precision chart",
        _subtitle(chart),
        f"largest error of {reference.measure}{unit}" + ("" if unit else " (scaled)"),
        beyond=len(shown) - len(kept), empty=_empty_reason(chart, shown),
        own=[
            (math.log10(level.error), colours[level.name], level.name)
            for level in chart.model_levels
            if has_levels and level.error and level.name != reference.model
        ],
    )  # fmt: skip


def _subtitle(chart: ChartRecord) -> str:
    """Simulated time and reference of a chart."""
    reference = chart.reference
    until = f", {reference.stop_event}" if reference.stop_event else ""
    return (
        f"{chart.t_end:g} s of motion{until}; reference: {reference.made_by}, its own error "
        f"{reference.error:.1e}"
    )


def _empty_reason(chart: ChartRecord, shown: Sequence[Point]) -> str:
    """Reason why there is nothing to plot, "" if there is something."""
    if shown:
        return ""
    if chart.reference.is_static:
        return "the scene has no degrees of freedom"
    errors = [point.error for point in chart.points if point.error is not None]
    return "no run has an error above zero" if errors else "no run was completed"


def plot_position(point: Point) -> Position | None:
    """(log10 error, log10 s); None for a failed run, or without error or CPU time above 0."""
    if not point.error or not point.cpu_s:
        return None
    return math.log10(point.error), math.log10(point.cpu_s)


def _limits(
    shown: Sequence[Point], positions: dict[int, Position], floor: float
) -> tuple[Position, Position]:
    """Limits (x, y) of the axes; `floor` is the smallest error that the reference resolves."""
    if not shown:
        return (0.0, -12.0), (-4.0, 0.0)
    first_errors: dict[tuple[str, str], float] = {}
    for point in shown:
        first_errors.setdefault(point.curve, positions[id(point)][0])
    median = sorted(first_errors.values())[len(first_errors) // 2]
    errors = [positions[id(p)][0] for p in shown]
    times = [positions[id(p)][1] for p in shown]
    largest = min(max(errors), median + math.log10(_OUTLIER_FACTOR))
    smallest = min(errors)
    if floor > 0:
        smallest = max(min(smallest, math.log10(floor)), math.log10(floor) - 1.0)
    if largest - smallest < 1.0:
        largest, smallest = largest + 0.5, smallest - 0.5
    return (
        (largest + _MARGIN, smallest - _MARGIN),
        (min(times) - 3 * _MARGIN, max(times) + _MARGIN),
    )


def _method_lines(
    points: Sequence[Point], positions: dict[int, Position], front: Sequence[Point]
) -> list[Line]:
    """One line per method; methods with a point on the Pareto front are strong."""
    methods = _sorted_by_family(p.method for p in points)
    styles, strong_methods = method_styles(methods), {p.method for p in front}
    lines = []
    for method in methods:
        path = tuple((positions[id(p)], p) for p in points if p.method == method)
        lines.append(Line(method, styles[method], path, True, method in strong_methods))
    return sorted(lines, key=lambda line: line.is_emphasised)


def _level_lines(
    points: Sequence[Point],
    positions: dict[int, Position],
    levels: Sequence[str],
    chart: ChartRecord,
) -> list[Line]:
    """Per model level: faint lines of its methods, and its own Pareto front as a strong line."""
    colours, lines = level_colours(levels), []
    level_errors = {level.name: 1.1 * (level.error or 0.0) for level in chart.model_levels}
    level_errors[chart.reference.model] = 0.0
    for curve in dict.fromkeys(p.curve for p in points):
        path = tuple((positions[id(p)], p) for p in points if p.curve == curve)
        lines.append(Line(curve[0], PlotStyle(colours[curve[0]], ""), path, True, False))
    for strong in (False, True):
        for level in levels:
            level_points = [p for p in points if p.model == level]
            floor = max(level_errors[level], chart.reference.smallest_resolved_error)
            front_ids = {id(p) for p in pareto_front(level_points, floor)}
            for mark in dict.fromkeys(family_mark(p.method) for p in level_points):
                marked = tuple(
                    (positions[id(p)], p)
                    for p in level_points
                    if (id(p) in front_ids) == strong and family_mark(p.method) == mark
                )
                lines.append(Line(level, PlotStyle(colours[level], mark), marked, False, strong))
            if strong:
                path = tuple((positions[id(p)], p) for p in level_points if id(p) in front_ids)
                path = tuple(sorted(path, key=lambda entry: entry[0][1]))
                lines.append(Line(level, PlotStyle(colours[level], ""), path, True, True))
    return [line for line in lines if line.points]


def _sorted_by_family(methods: Iterable[str]) -> list[str]:
    """Methods sorted by family, within a family in the order of first appearance."""
    names = list(dict.fromkeys(methods))
    return sorted(names, key=lambda name: FAMILIES.index(family(name)))


def _labels(
    positions: Sequence[Position], names: Sequence[str], x: Position, y: Position
) -> list[Label]:
    """Labels where the method (or level) of the Pareto front changes, if there is free space.

    A name is repeated only far from its previous label.
    """

    def plot_coordinates(position: Position) -> Position:
        right = (position[0] - x[0]) / (x[1] - x[0]) * _PLOT_SIZE[0]
        return right, (y[1] - position[1]) / (y[1] - y[0]) * _PLOT_SIZE[1]

    points = [plot_coordinates(position) for position in positions]
    boxes: list[tuple[float, float, float, float]] = []
    labels: list[Label] = []
    last: dict[str, float] = {}
    for i, (position, name) in enumerate(zip(positions, names, strict=True)):
        repeated = i > 0 and names[i - 1] == name
        if repeated or points[i][0] - last.get(name, -math.inf) < _REPEAT_DISTANCE:
            continue
        half_width, half_height = _CHARACTER_SIZE[0] * len(name) / 2, _CHARACTER_SIZE[1] / 2
        for right, down in _LABEL_OFFSETS:
            cx, cy = points[i][0] + right, points[i][1] + down
            box = (cx - half_width, cy - half_height, cx + half_width, cy + half_height)
            inside = (
                box[0] > 0
                and box[2] < _PLOT_SIZE[0]
                and box[1] > 0
                and box[3] < _PLOT_SIZE[1] - _BAR_HEIGHT
            )
            if (
                inside
                and not any(_overlap(box, other) for other in boxes)
                and not any(
                    box[0] < px < box[2] and box[1] - 3 < py < box[3] + 3 for px, py in points
                )
            ):
                boxes.append(box)
                last[name] = points[i][0]
                labels.append(Label(name, position, (right, down)))
                break
    return labels


def _overlap(a: tuple[float, ...], b: tuple[float, ...]) -> bool:
    """Whether two boxes (left, top, right, bottom) overlap."""
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def _legend(lines: Sequence[Line], points: Sequence[Point], levels: Sequence[str]) -> list[Entry]:
    """Rows of the legend: methods by family; or model levels, and markers of families."""
    if len(levels) > 1:
        colours = level_colours(levels)
        entries = [Entry("model level")]
        entries += [Entry(level, PlotStyle(colours[level], "s")) for level in levels]
        entries.append(Entry("methods"))
        methods = _sorted_by_family(p.method for p in points)
        for name in dict.fromkeys(map(family, methods)):
            members = [method for method in methods if family(method) == name]
            entries.append(Entry(name, PlotStyle("#555555", family_mark(members[0]))))
            if members != [name]:
                rows = wrap(", ".join(members), _LEGEND_COLUMNS)
                entries += [Entry(row, None, False) for row in rows]
        return [*entries, Entry("bars below: errors of levels", None, False)]
    entries = []
    line_by_method = {line.name: line for line in lines}
    for method in (m for m in _sorted_by_family(p.method for p in points) if m in line_by_method):
        heading = Entry(family(method))
        if heading not in entries:
            entries.append(heading)
        line = line_by_method[method]
        entries.append(Entry(method, line.style, line.is_emphasised))
    return entries


def time_text(power: int) -> str:
    """10^power s as text: "1 ms", "10 ms"."""
    for unit, exponent in (("s", 0), ("ms", -3), ("µs", -6), ("ns", -9)):
        if power >= exponent:
            return f"{10 ** (power - exponent)} {unit}"
    return f"1e{power} s"


def decades(low: float, high: float) -> list[int]:
    """Exponents of the powers of ten between two exponents."""
    first, last = sorted((low, high))
    return list(range(math.ceil(first), math.floor(last) + 1))
