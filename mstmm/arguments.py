"""Validation of arguments other than numbers: paths, texts, lists of texts, truth values."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from .errors import SceneError


def number_in(text: Any) -> float:
    """Parse a number; unlike in Python, underscores in it are not allowed.

    Raises ValueError or TypeError for anything else.
    """
    if isinstance(text, str) and "_" in text:
        raise ValueError(f"{text!r} is not a number")
    return float(text)


def path_of(what: str, value: Any) -> Path:
    """Validate the path of a file, a text or a `Path`; SceneError for anything else."""
    if isinstance(value, str | os.PathLike) and isinstance(os.fspath(value), str) and str(value):
        return Path(value)
    raise SceneError(f"{what} {short(value)}: expected the name of a file, such as 'run'")


def texts_of(what: str, value: Any, such_as: str) -> tuple[str, ...]:
    """Validate a list of texts; a single text is a list of one.  SceneError for anything else."""
    found = (value,) if isinstance(value, str) else value
    there = tuple(found) if isinstance(found, Iterable) else (None,)
    if isinstance(found, Mapping) or not all(isinstance(one, str) for one in there):
        shown = short(value)
        raise SceneError(f"{what} = {shown}: expected a list of names, such as [{such_as!r}]")
    return there


def text_of(what: str, value: Any) -> str | None:
    """Validate an optional text, a text or None; SceneError for anything else."""
    if value is None or isinstance(value, str):
        return value
    raise SceneError(f"{what} = {short(value)}: expected a text")


def word_of(what: str, value: Any, such_as: str) -> str:
    """Validate a text; otherwise SceneError, with `such_as` as the expected values."""
    if isinstance(value, str):
        return value
    raise SceneError(f"{what} = {short(value)}: expected {such_as}")


def yes_or_no(what: str, value: Any) -> bool:
    """Validate a bool, exactly True or False; SceneError for anything else."""
    if isinstance(value, bool):
        return value
    raise SceneError(f"{what} = {short(value)}: expected True or False")


def short(value: Any) -> str:
    """Representation of a value on one line of at most 60 characters, for messages."""
    shown = " ".join(repr(value).split())
    return shown if len(shown) <= 60 else f"{shown[:57]}..."
