"""Rename bodies, ends and hinges in the references and expressions of a scene."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from mstmm.expression.expression import Expression, Name, parse
from mstmm.scene import Scene

from ...chart.model_levels import with_tables
from ..measure_renaming import rename_reference

#: Keys of each table that refer to a body or end, and keys that refer to a hinge.
_PLACE_KEYS: dict[str, tuple[str, ...]] = {
    "hinge": ("inboard", "outboard"), "chain": ("inboard",), "load": ("on", "axes"),
    "spring": ("from_", "to"), "bushing": ("from_", "to"), "event": (), "output": (),
    "constraint": ("from_", "to"), "coupling": (),
}  # fmt: skip
_HINGE_KEYS: dict[str, tuple[str, ...]] = {"event": ("hinge",)}

#: Values of `axes` of a load other than the name of a body.
OWN_AXES, INERTIAL = "body", "inertial"

#: Quantities of hinges in expressions.
_HINGE_QUANTITIES = ("q", "u")


def with_references(
    scene: Scene, places: Mapping[str, str], hinges: Mapping[str, str] | None = None
) -> Scene:
    """Rename bodies, ends and hinges in references and expressions.

    The tables of these elements keep their names.
    """
    names = (places, hinges or {})
    return with_tables(
        scene,
        **{
            table: tuple(
                _rename_in_element(element, table, names) for element in getattr(scene, table)
            )
            for table in _PLACE_KEYS
        },
    )


def _rename_in_element(
    element: Any, table: str, names: tuple[Mapping[str, str], Mapping[str, str]]
) -> Any:
    update: dict[str, Any] = {}
    for keys, new_names in ((_PLACE_KEYS[table], names[0]), (_HINGE_KEYS.get(table, ()), names[1])):
        for key in keys:
            old = getattr(element, key)
            if (
                old is not None
                and old not in (OWN_AXES, INERTIAL)
                and rename_reference(old, new_names) != old
            ):
                update[key] = rename_reference(old, new_names)
    renamed = _rename_in_value(element, names)
    return renamed.model_copy(update=update) if update else renamed


def _rename_in_value(value: Any, names: tuple[Mapping[str, str], Mapping[str, str]]) -> Any:
    """Rename in the expressions of a value; returns the same object if nothing changes."""
    if isinstance(value, Expression):
        return _rename_in_expression(value, names)
    if isinstance(value, tuple):
        renamed = tuple(_rename_in_value(item, names) for item in value)
        return renamed if _is_changed(renamed, value) else value
    if hasattr(type(value), "model_fields"):
        old = {key: getattr(value, key) for key in type(value).model_fields}
        new = {key: _rename_in_value(item, names) for key, item in old.items()}
        changed = {key: item for key, item in new.items() if item is not old[key]}
        return value.model_copy(update=changed) if changed else value
    return value


def _is_changed(new: Iterable[Any], old: Iterable[Any]) -> bool:
    return any(a is not b for a, b in zip(new, old, strict=True))


def _rename_in_expression(
    expression: Expression, names: tuple[Mapping[str, str], Mapping[str, str]]
) -> Expression:
    text = expression.text
    names_by_position: dict[int, Name] = {
        term.name.position: term.name
        for term in expression.terms
        if term.name is not None and len(term.name.parts) > 1
    }
    for position, name in sorted(names_by_position.items(), reverse=True):
        old = ".".join(name.parts)
        new = rename_reference(old, names[1 if name.quantity in _HINGE_QUANTITIES else 0])
        text = text[:position] + new + text[position + len(old) :]
    if text == expression.text:
        return expression
    return parse(text, constants=dict(expression.constants))
