"""Checks of constraints: smooth curves, and no constraint twice."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from ...errors import ExpressionError
from ...expression.drive import motion, node_value
from ...expression.expression import Expression
from ...ir.graph import Graph
from ..tables.closures import DISTANCE
from ..validators.scalars_and_vectors import Location, describe_value
from ..validators.validation_messages import Problem
from .inputs import switching_term

if TYPE_CHECKING:
    from ..tables.closures import Constraint
    from ..tables.scene_tables import SceneTables


def problems(scene: SceneTables) -> Iterator[Problem]:
    """Problems of constraints: curves that cannot be followed, and duplicates."""
    for i, constraint in enumerate(scene.constraint):
        if constraint.curve is not None:
            yield from _curve_problems(
                constraint.curve, constraint.start or 0.0, ("constraint", i, "curve")
            )
    yield from _duplicates(scene)


def _curve_problems(
    curve: tuple[Expression, ...], start: float, place: Location
) -> Iterator[tuple[Location, str]]:
    """Problems of a curve: other names than s, kinks, or no direction at its start."""
    derivatives = []
    for k, entry in enumerate(curve):
        other_names = [name.text for name in entry.names if name.text != "s"]
        switch_text = switching_term(entry, {"s"})
        if other_names:
            yield (
                (*place, k),
                f"expected a function of s only, found {other_names[0]!r}; leave it out",
            )
        elif switch_text:
            yield (
                (*place, k),
                f"no derivative where {switch_text!r} switches; use a smooth expression",
            )
        else:
            try:
                start_values = _value_and_derivatives(entry, start)
            except ExpressionError as error:
                yield (*place, k), str(error)
                continue
            derivatives.append(start_values[1])
            if not all(map(math.isfinite, start_values)):
                yield (
                    (*place, k),
                    f"{describe_value(entry.text)} or one of its first two derivatives is not "
                    f"finite at s = {start:g}; set start to another value",
                )
    if len(derivatives) == len(curve) and not any(derivatives):
        yield place, f"all derivatives are 0 at s = {start:g}; set start to another value"


def _value_and_derivatives(entry: Expression, start: float) -> list[float]:
    """Value of an expression of s and its first two derivatives at the start."""
    s = Graph().element("s")
    return [node_value(node, lambda _: start) for node in motion(entry, s, lambda _: s)]


def _duplicates(scene: SceneTables) -> Iterator[Problem]:
    """Problems of constraints that repeat an earlier one."""
    first_indices: dict[tuple[object, ...], int] = {}
    for i, constraint in enumerate(scene.constraint):
        first_index = first_indices.setdefault(_duplicate_key(constraint), i)
        if first_index != i:
            yield ("constraint", i), f"repeats constraint number {first_index + 1}; leave one out"


def _duplicate_key(one: Constraint) -> tuple[object, ...]:
    """Key that is equal for constraints which repeat or contradict each other."""
    ends = (one.from_, one.to)
    end_key = tuple(sorted(ends)) if one.type == DISTANCE else ends
    curve = tuple(entry.text for entry in one.curve or ())
    return one.type, end_key, one.position, one.unit_normal, curve
