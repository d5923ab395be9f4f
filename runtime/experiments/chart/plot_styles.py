"""Colours and markers of a chart: by family of methods, and by model level."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, pi, sin

from ..method_families import FAMILIES, family

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
