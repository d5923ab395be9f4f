"""Constraints: whether a curve can be followed, and constraints among each other."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from ...errors import ExpressionError
from ...expression.drive import motion, value
from ...expression.expression import Expression
from ...ir.graph import Graph
from ..rules.messages import Problem
from ..rules.values import Location, found
from ..tables.closures import DISTANCE
from .inputs import switching

if TYPE_CHECKING:
    from ..tables.all import SceneTables
    from ..tables.closures import Constraint


def problems(scene: SceneTables) -> Iterator[Problem]:
    """Everything for which a constraint is no row, or none of its own."""
    for i, constraint in enumerate(scene.constraint):
        if constraint.curve is not None:
            yield from _curve(constraint.curve, constraint.start or 0.0, ("constraint", i, "curve"))
    yield from _repeated(scene)


def _curve(
    curve: tuple[Expression, ...], start: float, place: Location
) -> Iterator[tuple[Location, str]]:
    """A curve that does not go by s alone, bends sharply, or has no direction where it starts."""
    slopes = []
    for k, entry in enumerate(curve):
        others = [name.text for name in entry.names if name.text != "s"]
        switch = switching(entry, {"s"})
        if others:
            yield (*place, k), f"a curve goes by s alone, found {others[0]!r}; leave that out"
        elif switch:
            yield (*place, k), f"it has no slope where {switch!r} switches; write it without"
        else:
            try:
                at = _at(entry, start)
            except ExpressionError as error:
                yield (*place, k), str(error)
                continue
            slopes.append(at[1])
            if not all(map(math.isfinite, at)):
                yield (
                    (*place, k),
                    f"{found(entry.text)} or one of its first two slopes is not finite at s = "
                    f"{start:g}; begin elsewhere, with start",
                )
    if len(slopes) == len(curve) and not any(slopes):
        yield place, f"it stands still at s = {start:g}, so it has no direction; begin elsewhere"


def _at(entry: Expression, start: float) -> list[float]:
    """An expression of s and its first two slopes."""
    s = Graph().element("s")
    return [value(node, lambda _: start) for node in motion(entry, s, lambda _: s)]


def _repeated(scene: SceneTables) -> Iterator[Problem]:
    """Constraints between the same points for the second time."""
    seen: dict[tuple[object, ...], int] = {}
    for i, constraint in enumerate(scene.constraint):
        first = seen.setdefault(_same(constraint), i)
        if first != i:
            yield ("constraint", i), f"constraint number {first + 1} says the same; leave one out"


def _same(one: Constraint) -> tuple[object, ...]:
    """What two constraints have in common that ask for the same, or contradict each other."""
    ends = (one.from_, one.to)
    kept = tuple(sorted(ends)) if one.type == DISTANCE else ends
    curve = tuple(entry.text for entry in one.curve or ())
    return one.type, kept, one.position, one.unit_normal, curve
