"""Checks of constraints and couplings: smooth curves and rows, free coordinates, no duplicates."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from typing import TYPE_CHECKING

from ...errors import ExpressionError
from ...expression.derivatives import (
    dependency_parts,
    expression_derivatives,
    motion,
    motion_at,
    node_value,
)
from ...expression.expression import Expression, Name
from ...expression.parser import context_of_name
from ...ir.graph import Graph
from ..tables.closures import DISTANCE
from ..tables.hinge import drive_problems
from ..validators.scalars_and_vectors import Location, describe_value
from ..validators.validation_messages import Problem
from .connectivity import resolve_coordinate
from .expression_names import index_problem, modal_names
from .inputs import switching_term

if TYPE_CHECKING:
    from ..tables.closures import Coupling
    from ..tables.hinge import Hinge
    from ..tables.scene_tables import SceneTables


def constraint_problems(scene: SceneTables) -> Iterator[Problem]:
    """Problems of constraints: curves that cannot be followed, and duplicates."""
    for i, constraint in enumerate(scene.constraint):
        if constraint.curve is not None:
            start = constraint.start or 0.0
            yield from _curve_problems(constraint.curve, start, ("constraint", i, "curve"))
    first_indices: dict[tuple[object, ...], int] = {}
    for i, one in enumerate(scene.constraint):
        ends = (one.from_, one.to)
        end_key = tuple(sorted(ends)) if one.type == DISTANCE else ends
        curve = tuple(entry.text for entry in one.curve or ())
        key = (one.type, end_key, one.position, one.unit_normal, curve)
        first_index = first_indices.setdefault(key, i)
        if first_index != i:
            yield ("constraint", i), f"repeats constraint number {first_index + 1}; leave one out"


def _curve_problems(
    curve: tuple[Expression, ...], start: float, place: Location
) -> Iterator[Problem]:
    """Problems of a curve: other names than s, kinks, or no direction at its start."""
    derivatives = []
    for k, entry in enumerate(curve):
        other_names = [name.text for name in entry.names if name.text != "s"]
        switch_text = switching_term(entry, {"s"})
        if other_names:
            text = f"expected a function of s only, found {other_names[0]!r}; leave it out"
            yield (*place, k), text
        elif switch_text:
            text = f"no derivative where {switch_text!r} switches; use a smooth expression"
            yield (*place, k), text
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


# --- couplings ------------------------------------------------------------------------------------


def coupling_problems(scene: SceneTables) -> Iterator[Problem]:
    """Problems of couplings, as far as the types of their hinges are defined."""
    first_indices: dict[str, int] = {}
    for i, coupling in enumerate(scene.coupling):
        location: Location = ("coupling", i, coupling.key)
        name_problems = [
            (location, message)
            for name in coupling.names
            if (message := _unknown_name_message(scene, name, coupling.key)) is not None
        ]
        yield from name_problems
        names = () if name_problems else coupling.names
        if names and all(scene.hinges.by_name[name.hinge].facts is not None for name in names):
            messages = _row_messages(scene, coupling)
            yield from ((location, message) for message in messages if message is not None)
        yield from _right_side_problems(coupling, ("coupling", i, "equals"))
        first_index = first_indices.setdefault(coupling.row.text.replace(" ", ""), i)
        if first_index != i:
            yield location, f"repeats coupling number {first_index + 1}; leave one out"


def _right_side_problems(coupling: Coupling, place: Location) -> Iterator[Problem]:
    equals = coupling.equals
    if equals is None:
        return
    other_names = [name for name in equals.names if name.text != "t"]
    if other_names:
        named_text = f"{other_names[0].text!r}{context_of_name(equals.text, other_names[0])}"
        yield place, f"expected a function of t only, found {named_text}; move it to the coupling"
    else:
        yield from drive_problems(equals, place)


# --- names ----------------------------------------------------------------------------------------


def _unknown_name_message(scene: SceneTables, name: Name, key: str) -> str | None:
    """Message about a name that is no coordinate or speed of a hinge; None for others."""
    if name.text == "t" or name.text in scene.channels:
        return f"{name.text!r} is no coordinate of a hinge; write functions of time in equals"
    if len(name.parts) == 1:
        return f"{name.text!r} is no coordinate; write the name of a hinge and .q or .u"
    if name.owner in modal_names(scene):
        return f"{name.text!r} is no coordinate of a hinge; couplings accept only those of hinges"
    number = scene.hinges.find(name.hinge)
    if number is None:
        return scene.hinges.missing(name.hinge, repr(name.hinge))
    if key == "expression" and name.quantity == "u":
        return f"{name.text!r} is a speed; use speeds in place of expression"
    return _missing_entry_message(scene.hinges[number], name, key)


def _missing_entry_message(hinge: Hinge, name: Name, key: str) -> str | None:
    """Message about a coordinate or speed that a hinge does not have; None for others."""
    facts = hinge.facts
    if facts is None:
        return None
    coordinate_names = [coordinate_info.name for coordinate_info in facts.coordinates]
    entry = name.index or 0
    if name.quantity in ("q", "u"):
        entries = facts.coordinates if name.quantity == "q" else facts.speeds
        problem = index_problem(name, hinge.name, len(entries))
        if problem is not None:
            return problem
    elif name.quantity not in coordinate_names or name.index is not None:
        known = "".join(f", {hinge.name}.{coordinate}" for coordinate in coordinate_names)
        return f"{name.text!r} is unknown; this hinge has {hinge.name}.q{known}"
    else:
        entry = coordinate_names.index(name.quantity)
    first = facts.quaternion
    if key == "expression" and first is not None and first <= entry < first + 4:
        return (
            f"{name.text!r} is an entry of a quaternion, not an angle; use universal or "
            "gimbal hinges, or couple speeds"
        )
    return None


# --- rows -----------------------------------------------------------------------------------------


def _row_messages(scene: SceneTables, coupling: Coupling) -> Iterator[str | None]:
    """Reasons why an expression of existing coordinates and speeds gives no constraint row."""
    row, names = coupling.row, coupling.names
    has_speeds = coupling.speeds is not None
    coupled_names = [name for name in names if not has_speeds or name.quantity == "u"]
    switch_text = switching_term(row, {name.text for name in names})
    if switch_text:
        yield f"no derivative where {switch_text!r} switches; use a smooth expression"
        return
    if not coupled_names:
        row_text = describe_value(row.text)
        yield f"{row_text} has no speed, as in cart.u; use expression in place of speeds"
        return
    dependencies, has_remainder = dependency_parts(row, coupled_names)
    if None in dependencies:
        ineffective = coupled_names[dependencies.index(None)]
        yield f"{ineffective.text!r} has no effect; leave it out"
    if has_speeds and any(set(found or ()) & set(coupled_names) for found in dependencies):
        yield "not linear in the speeds; write a sum of speeds with factors that contain none"
    elif has_speeds and has_remainder:
        yield "a term has no speed; move it to equals"
    else:
        yield _derivative_message(scene, row, coupled_names)
        yield _all_driven_message(scene, coupled_names)


def _derivative_message(scene: SceneTables, row: Expression, kept: Collection[Name]) -> str | None:
    """Message about a row that is not finite or has no derivatives at the start."""
    start_values = {name: _start_value(scene, name) for name in row.names}
    derivatives = expression_derivatives(row, start_values.__getitem__)
    start_text = ", ".join(f"{name.text} = {start_values[name]:g}" for name in row.names[:4])
    if not all(map(math.isfinite, (row.evaluate(start_values.__getitem__), *derivatives.values()))):
        return (
            f"the expression or one of its derivatives is not finite at the start ({start_text}); "
            "use another initial state"
        )
    if not any(derivatives[name] for name in kept):
        return (
            f"all derivatives are 0 at the start ({start_text}), so the direction of motion is "
            "undefined; use another initial state, or an expression without the square"
        )
    return None


def _start_value(scene: SceneTables, name: Name) -> float:
    number, quantity, entry = resolve_coordinate(scene, name)
    hinge = scene.hinges[number]
    drive = (hinge.drive or ())[entry : entry + 1]
    if hinge.initial is None and drive and drive[0] is not None:
        if not drive[0].depends_on_time_only:
            return 0.0
        return motion_at(drive[0], 0.0)[0 if quantity == "q" else 1]
    initial_values = hinge.initial and (hinge.initial.q if quantity == "q" else hinge.initial.u)
    return initial_values[entry] if initial_values and entry < len(initial_values) else 0.0


def _all_driven_message(scene: SceneTables, names: list[Name]) -> str | None:
    """Message about a coupling of driven coordinates only; released hinges are not driven."""
    released_hinges = {event.hinge for event in scene.event}
    for name in names:
        number, _, entry = resolve_coordinate(scene, name)
        hinge = scene.hinges[number]
        is_released = hinge.is_released or hinge.name in released_hinges
        if is_released or not any((hinge.drive or ())[entry : entry + 1]):
            return None
    names_text = " and ".join(dict.fromkeys(name.text for name in names))
    return f"drives already prescribe {names_text}; leave out one drive or the coupling"
