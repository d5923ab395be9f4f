"""Checks of constraints: smooth curves, and no constraint twice."""

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
    """Problems of constraints: curves that cannot be followed, and duplicates."""
    for i, constraint in enumerate(scene.constraint):
        if constraint.curve is not None:
            yield from _curve(constraint.curve, constraint.start or 0.0, ("constraint", i, "curve"))
    yield from _repeated(scene)


def _curve(
    curve: tuple[Expression, ...], start: float, place: Location
) -> Iterator[tuple[Location, str]]:
    """Problems of a curve: other names than s, kinks, or no direction at its start."""
    slopes = []
    for k, entry in enumerate(curve):
        others = [name.text for name in entry.names if name.text != "s"]
        switch = switching(entry, {"s"})
        if others:
            yield (*place, k), f"expected a function of s only, found {others[0]!r}; leave it out"
        elif switch:
            yield (*place, k), f"no derivative where {switch!r} switches; use a smooth expression"
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
                    f"{found(entry.text)} or one of its first two derivatives is not finite at "
                    f"s = {start:g}; set start to another value",
                )
    if len(slopes) == len(curve) and not any(slopes):
        yield place, f"all derivatives are 0 at s = {start:g}; set start to another value"


def _at(entry: Expression, start: float) -> list[float]:
    """Value of an expression of s and its first two derivatives at the start."""
    s = Graph().element("s")
    return [value(node, lambda _: start) for node in motion(entry, s, lambda _: s)]


def _repeated(scene: SceneTables) -> Iterator[Problem]:
    """Problems of constraints that repeat an earlier one."""
    seen: dict[tuple[object, ...], int] = {}
    for i, constraint in enumerate(scene.constraint):
        first = seen.setdefault(_same(constraint), i)
        if first != i:
            yield ("constraint", i), f"repeats constraint number {first + 1}; leave one out"


def _same(one: Constraint) -> tuple[object, ...]:
    """Key that is equal for constraints which repeat or contradict each other."""
    ends = (one.from_, one.to)
    kept = tuple(sorted(ends)) if one.type == DISTANCE else ends
    curve = tuple(entry.text for entry in one.curve or ())
    return one.type, kept, one.position, one.unit_normal, curve
