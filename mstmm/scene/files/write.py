"""Conversion of scenes to TOML."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ...ir.hinge_properties import builtin_hinges
from ..validators.constant_expressions import WrittenNumber
from ..validators.unit_suffixes import is_number
from ..validators.validation_messages import TABLES

if TYPE_CHECKING:
    from ..tables.scene_tables import SceneTables

#: The table of name tables, whose keys are written in quotes.
_NAMES_KEY = "names"


def to_toml(scene: SceneTables, evaluated: bool = False) -> str:
    """Convert a scene to TOML text that loads back to an equal scene.

    With `evaluated`, expressions of named constants are written as numbers.
    """
    data = scene.model_dump(by_alias=True)
    for hinge in data["hinge"]:
        facts = builtin_hinges().get(hinge["type"])
        if facts is not None and facts.frame == "plane":
            hinge["axis"] = None  # written as `normal`
    return as_toml(data, evaluated)


def as_toml(data: Mapping[str, Any], evaluated: bool = False) -> str:
    """Convert the keys of a scene to TOML text, without keys that have no value."""
    lines = [
        f"{key} = {_toml_value(value, evaluated)}"
        for key, value in data.items()
        if key not in (*TABLES, _NAMES_KEY) and value not in (None, {}, ())
    ]
    for table in TABLES:
        for element in data.get(table, ()):
            ordered_element = {"name": element["name"], **element} if "name" in element else element
            lines += ["", f"[[{table}]]"]
            lines += [
                f"{key} = {_toml_value(value, evaluated)}"
                for key, value in ordered_element.items() if value is not None and value != {}
            ]  # fmt: skip
    for table, name_table in data.get(_NAMES_KEY, {}).items():
        if name_table:
            lines += ["", f"[{_NAMES_KEY}.{table}]"]
            lines += [
                f"{_toml_string(name)} = {_toml_string(scene_name)}"
                for name, scene_name in name_table.items()
            ]
    return "\n".join(lines) + "\n"


def _toml_value(value: Any, evaluated: bool) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, WrittenNumber):
        if evaluated:
            return repr(float(value))
        return value.text if is_number(value.text) else _toml_string(value.text)
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, int):
        return str(value)
    if isinstance(value, str):
        return _toml_string(value)
    if isinstance(value, dict):
        entries_text = ", ".join(
            f"{k} = {_toml_value(v, evaluated)}" for k, v in value.items() if _is_written(v)
        )
        return "{ " + entries_text + " }" if entries_text else "{}"
    return "[" + ", ".join(_toml_value(v, evaluated) for v in value) + "]"


def _is_written(value: Any) -> bool:
    """Whether a value is written: TOML has no null, and an empty list is always the default."""
    return value is not None and value != ()


def _toml_string(text: str) -> str:
    """Text as a basic string of TOML."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(c if c.isprintable() else f"\\u{ord(c):04x}" for c in escaped) + '"'
