"""Conversion of scenes to TOML."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ...ir.facts import builtin_hinges
from ..rules.messages import TABLES
from ..rules.units import is_number
from ..rules.written import Written

if TYPE_CHECKING:
    from ..tables.all import SceneTables

#: The table of name tables, whose keys are written in quotes.
_NAMES = "names"


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
        f"{key} = {_value(value, evaluated)}"
        for key, value in data.items()
        if key not in (*TABLES, _NAMES) and value not in (None, {}, ())
    ]
    for table in TABLES:
        for element in data.get(table, ()):
            named = {"name": element["name"], **element} if "name" in element else element
            lines += ["", f"[[{table}]]"]
            lines += [
                f"{key} = {_value(value, evaluated)}"
                for key, value in named.items() if value is not None and value != {}
            ]  # fmt: skip
    for table, known in data.get(_NAMES, {}).items():
        if known:
            lines += ["", f"[{_NAMES}.{table}]"]
            lines += [f"{_string(name)} = {_string(one)}" for name, one in known.items()]
    return "\n".join(lines) + "\n"


def _value(value: Any, evaluated: bool) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Written):
        if evaluated:
            return repr(float(value))
        return value.text if is_number(value.text) else _string(value.text)
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, int):
        return str(value)
    if isinstance(value, str):
        return _string(value)
    if isinstance(value, dict):
        inside = ", ".join(f"{k} = {_value(v, evaluated)}" for k, v in value.items() if _is_said(v))
        return "{ " + inside + " }" if inside else "{}"
    return "[" + ", ".join(_value(v, evaluated) for v in value) + "]"


def _is_said(value: Any) -> bool:
    """Whether a value is written: TOML has no null, and an empty list is always the default."""
    return value is not None and value != ()


def _string(text: str) -> str:
    """Text as a basic string of TOML."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(c if c.isprintable() else f"\\u{ord(c):04x}" for c in escaped) + '"'
