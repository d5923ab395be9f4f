"""Colours and marks: methods by their family, levels of model by their rank."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, pi, sin

from .method_families import FAMILIES, family

#: Lightest and darkest colour of each family, in the order of FAMILIES.
_RANGES = (
    ("#111111", "#111111"), ("#f7b267", "#9a3c00"), ("#f28b95", "#8c0f1f"), ("#b58fd6", "#5e3c99"),
    ("#a3d39c", "#14622f"), ("#00868b", "#00868b"), ("#c8a165", "#7a5a1e"), ("#9cc3e6", "#17457a"),
    ("#a9a9a9", "#5f5f5f"),
)  # fmt: skip

#: Marks by name as matplotlib has them, and as corners on a circle of radius 1 (y downwards).
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
_MARK_OF = ("*", "s", "o", "p", "^", "v", "h", "D", "P")

#: Levels of model from the smallest to the richest, and planar ones (Okabe and Ito 2008, darkened).
_LEVELS = ("#7a7a7a", "#c98a00", "#3a9bd9", "#c0392b", "#1f7a4d")


@dataclass(frozen=True)
class PlotStyle:
    """Colour, and a key of MARKS."""

    colour: str
    mark: str


def of_methods(methods: Sequence[str]) -> dict[str, PlotStyle]:
    """A look for each method; those of a family go from light to dark."""
    found = {}
    for name, (light, dark), mark in zip(FAMILIES, _RANGES, _MARK_OF, strict=True):
        own = [method for method in methods if family(method) == name]
        for i, method in enumerate(own):
            part = i / (len(own) - 1) if len(own) > 1 else 1.0
            found[method] = PlotStyle(_between(light, dark, part), mark)
    return found


def of_levels(levels: Sequence[str]) -> dict[str, str]:
    """A colour for each level of model: one for each kind, darker with more shapes."""
    kinds = list(dict.fromkeys(map(_kind, levels)))
    found = {}
    for kind in kinds:
        own = [level for level in levels if _kind(level) == kind]
        base = _LEVELS[_RANK.get(kind, 0)]
        for i, level in enumerate(own):
            part = (len(own) - 1 - i) / max(1, len(own))
            found[level] = _between(base, "#ffffff", 0.6 * part)
    return found


_RANK = {"rigid": 0, "one-way": 1, "linear": 2, "stiffened": 3, "planar": 4}


def _kind(level: str) -> str:
    return level.partition(",")[0]


def mark_of(method: str) -> str:
    """The mark of a method's family."""
    return _MARK_OF[FAMILIES.index(family(method))]


def _between(a: str, b: str, part: float) -> str:
    """The colour between two, by parts of red, green and blue."""
    ends = zip(_rgb(a), _rgb(b), strict=True)
    return "#" + "".join(f"{round(x + part * (y - x)):02x}" for x, y in ends)


def _rgb(colour: str) -> tuple[int, int, int]:
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return red, green, blue
