"""Dataclasses as plain data for files and JSON output, with keys that outlast the field names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any, TypeVar

T = TypeVar("T")


def stored_as(key: str) -> dict[str, str]:
    """Metadata of a dataclass field that is stored under another key than its name."""
    return {"key": key}


def stored_keys(cls: Any) -> dict[str, str]:
    """Key of each field of a dataclass."""
    return {f.name: f.metadata.get("key", f.name) for f in fields(cls)}


def to_plain(value: Any) -> Any:
    """Convert dataclasses, in mappings and sequences too, to dictionaries by key."""
    if is_dataclass(value):
        return {key: to_plain(getattr(value, name)) for name, key in stored_keys(value).items()}
    if isinstance(value, Mapping):
        return {key: to_plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [to_plain(item) for item in value]
    return value


def from_plain(cls: type[T], data: Mapping[str, Any]) -> T:
    """Create a flat dataclass from its dictionary.  TypeError for unknown and missing keys."""
    names = {key: name for name, key in stored_keys(cls).items()}
    if unknown := data.keys() - names.keys():
        raise TypeError(f"{cls.__name__}: unknown key {min(unknown)!r}")
    return cls(**{names[key]: value for key, value in data.items()})
