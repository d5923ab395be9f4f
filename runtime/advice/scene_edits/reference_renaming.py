"""Other names for places and hinges, wherever a scene speaks of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from mstmm.expression.expression import Expression, Name, parse
from mstmm.scene import Scene

from ...chart.model_levels import with_tables
from ..measure_renaming import rename_reference

#: Keys of the tables that refer to a body or to one of its ends, and to a hinge.
_PLACES: dict[str, tuple[str, ...]] = {
    "hinge": ("inboard", "outboard"), "chain": ("inboard",), "load": ("on", "axes"),
    "spring": ("from_", "to"), "bushing": ("from_", "to"), "event": (), "output": (),
    "constraint": ("from_", "to"), "coupling": (),
}  # fmt: skip
_HINGES: dict[str, tuple[str, ...]] = {"event": ("hinge",)}

#: What `axes` of a load may be beside the name of a body.
OWN_AXES, INERTIAL = "body", "inertial"

#: Quantities that an expression takes from a hinge.
_OF_HINGES = ("q", "u")


def with_names(
    scene: Scene, places: Mapping[str, str], hinges: Mapping[str, str] | None = None
) -> Scene:
    """The scene in which bodies and ends, and hinges, have other names in references and in
    expressions.  Their own tables keep theirs."""
    both = (places, hinges or {})
    return with_tables(
        scene,
        **{
            table: tuple(_element(one, table, both) for one in getattr(scene, table))
            for table in _PLACES
        },
    )


def _element(element: Any, table: str, names: tuple[Mapping[str, str], Mapping[str, str]]) -> Any:
    update: dict[str, Any] = {}
    for keys, known in ((_PLACES[table], names[0]), (_HINGES.get(table, ()), names[1])):
        for key in keys:
            old = getattr(element, key)
            if (
                old is not None
                and old not in (OWN_AXES, INERTIAL)
                and rename_reference(old, known) != old
            ):
                update[key] = rename_reference(old, known)
    spoken = _in_expressions(element, names)
    return spoken.model_copy(update=update) if update else spoken


def _in_expressions(value: Any, names: tuple[Mapping[str, str], Mapping[str, str]]) -> Any:
    """A value of a table whose expressions have the new names; itself where they have none."""
    if isinstance(value, Expression):
        return _expression(value, names)
    if isinstance(value, tuple):
        made = tuple(_in_expressions(one, names) for one in value)
        return made if _differ(made, value) else value
    if hasattr(type(value), "model_fields"):
        old = {key: getattr(value, key) for key in type(value).model_fields}
        new = {key: _in_expressions(one, names) for key, one in old.items()}
        changed = {key: one for key, one in new.items() if one is not old[key]}
        return value.model_copy(update=changed) if changed else value
    return value


def _differ(new: Iterable[Any], old: Iterable[Any]) -> bool:
    return any(a is not b for a, b in zip(new, old, strict=True))


def _expression(
    expression: Expression, names: tuple[Mapping[str, str], Mapping[str, str]]
) -> Expression:
    text = expression.text
    found: dict[int, Name] = {
        term.name.position: term.name
        for term in expression.terms
        if term.name is not None and len(term.name.parts) > 1
    }
    for at, name in sorted(found.items(), reverse=True):
        old = ".".join(name.parts)
        new = rename_reference(old, names[1 if name.quantity in _OF_HINGES else 0])
        text = text[:at] + new + text[at + len(old) :]
    if text == expression.text:
        return expression
    return parse(text, constants=dict(expression.constants))
