"""Validation of arguments other than numbers: paths, texts, lists of texts, truth values."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from .errors import SceneError


def parse_number(text: Any) -> float:
    """Parse a number; unlike in Python, underscores in it are not allowed.

    Raises ValueError or TypeError for anything else.
    """
    if isinstance(text, str) and "_" in text:
        raise ValueError(f"{text!r} is not a number")
    return float(text)


def require_path(what: str, value: Any) -> Path:
    """Validate the path of a file, a text or a `Path`; SceneError for anything else."""
    if isinstance(value, str | os.PathLike) and isinstance(os.fspath(value), str) and str(value):
        return Path(value)
    raise SceneError(f"{what} {abbreviate(value)}: expected the name of a file, such as 'run'")


def require_texts(what: str, value: Any, such_as: str) -> tuple[str, ...]:
    """Validate a list of texts; a single text is a list of one.  SceneError for anything else."""
    entries = (value,) if isinstance(value, str) else value
    texts = tuple(entries) if isinstance(entries, Iterable) else (None,)
    if isinstance(entries, Mapping) or not all(isinstance(entry, str) for entry in texts):
        shown = abbreviate(value)
        raise SceneError(f"{what} = {shown}: expected a list of names, such as [{such_as!r}]")
    return texts


def optional_text(what: str, value: Any) -> str | None:
    """Validate an optional text, a text or None; SceneError for anything else."""
    if value is None or isinstance(value, str):
        return value
    raise SceneError(f"{what} = {abbreviate(value)}: expected a text")


def require_word(what: str, value: Any, such_as: str) -> str:
    """Validate a text; otherwise SceneError, with `such_as` as the expected values."""
    if isinstance(value, str):
        return value
    raise SceneError(f"{what} = {abbreviate(value)}: expected {such_as}")


def require_bool(what: str, value: Any) -> bool:
    """Validate a bool, exactly True or False; SceneError for anything else."""
    if isinstance(value, bool):
        return value
    raise SceneError(f"{what} = {abbreviate(value)}: expected True or False")


def abbreviate(value: Any) -> str:
    """Representation of a value on one line of at most 60 characters, for messages."""
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else f"{text[:57]}..."
