"""Reading of scene files: TOML or JSON by suffix, with a message for each kind of failure."""

from __future__ import annotations

import json
import os
import re
import stat
import tomllib
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from ...errors import SceneError
from ..validators.validation_messages import did_you_mean

#: Largest file in MB by suffix: read and validated within about half a minute.
MAX_FILE_SIZE_MB = {".toml": 8, ".json": 64}
_BUILD_IN_PYTHON = "; build large scenes in Python, or use [[chain]] for repeated bodies"
#: Remedy for a file that is too large, by suffix.
_SIZE_REMEDIES = {
    ".toml": f"{_BUILD_IN_PYTHON}, or write JSON, up to {MAX_FILE_SIZE_MB['.json']} MB",
    ".json": _BUILD_IN_PYTHON,
}
#: Most parts of a dotted key: tables nest four deep, and the cost of a key grows quadratically.
MAX_KEY_PARTS = 64
_LONG_KEY = re.compile(
    rf"""(?<![\w-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){{{MAX_KEY_PARTS},}}+"""
)


def read_tables(path: str | os.PathLike[str]) -> tuple[str, dict[str, Any]]:
    """Read the tables of a scene file without validation: (path for messages, tables).

    Raises SceneError.
    """
    where, content = read_content(path, MAX_FILE_SIZE_MB, "a scene file")
    text = _decode_text(content, where)
    data = _parse_json(text, where) if _suffix(path) == ".json" else _parse_toml(text, where)
    return where, data


def read_content(
    path: str | os.PathLike[str], limits: Mapping[str, int], what: str
) -> tuple[str, bytes]:
    """Read a file: (path for messages, bytes).

    `limits` maps accepted suffixes to the largest file size in MB.  Raises SceneError.
    """
    try:
        shown_path = os.fsdecode(os.fspath(path))
    except TypeError:
        raise SceneError(f"expected the path of {what}, found {path!r:.60}") from None
    where = shown_path if shown_path.isprintable() else ascii(shown_path)
    if _suffix(shown_path) not in limits:
        raise SceneError(
            f"{where}: expected {what} ending in {' or '.join(limits)}; rename it if it is one"
        )
    return where, _read_bytes(Path(shown_path), where, limits)


def _suffix(path: str | os.PathLike[str]) -> str:
    return Path(os.fsdecode(path)).suffix.lower()


def _decode_text(content: bytes, where: str) -> str:
    if not content.strip():
        raise SceneError(f"{where}: the file is empty; begin with gravity = [0, -9.81, 0]")
    if b"\0" in content:
        raise SceneError(f"{where}: expected text (TOML or JSON), found a binary file")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        number = content[: error.start].count(b"\n") + 1
        raise SceneError(
            f"{where}: line {number} is not UTF-8 text; save the file as UTF-8"
        ) from None


def _read_bytes(path: Path, where: str, limits: Mapping[str, int]) -> bytes:
    try:
        status = path.stat()
        if stat.S_ISDIR(status.st_mode):
            raise SceneError(f"{where}: this is a folder; give the path of a file in it")
        if not stat.S_ISREG(status.st_mode):
            raise SceneError(f"{where}: this is not a regular file; give the path of one")
        suffix = path.suffix.lower()
        limit = limits[suffix]
        if status.st_size > limit * 2**20:
            raise SceneError(
                f"{where}: the file has {status.st_size / 2**20:.0f} MB, the limit is {limit} MB"
                + _SIZE_REMEDIES.get(suffix, "")
            )
        with path.open("rb") as file:
            return file.read(limit * 2**20 + 1)
    except FileNotFoundError:
        raise SceneError(
            f"{where}: there is no such file{_similar_file_hint(path, limits)}"
        ) from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise SceneError(f"{where}: cannot be read: {reason}") from None


def _similar_file_hint(path: Path, endings: Collection[str]) -> str:
    """Suggestion of a file with a similar name in the same folder."""
    try:
        names = [p.name for p in path.parent.iterdir() if p.suffix.lower() in endings]
    except OSError:
        return "; check the folder"
    hint = did_you_mean(path.name, names)
    return hint if "did you mean" in hint else "; check the path"


def _parse_toml(text: str, where: str) -> dict[str, Any]:
    if long_key := _LONG_KEY.search(text):
        raise SceneError(
            f"{where}: line {text.count(chr(10), 0, long_key.start()) + 1}: a key has more than "
            f"{MAX_KEY_PARTS} parts, {long_key.group()[:20]}...; tables of a scene nest four deep "
            f"at most"
        )
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        is_redefinition = "Cannot overwrite a value" in str(error)
        hint = "; repeated tables need two brackets, as in [[hinge]]" if is_redefinition else ""
        raise SceneError(f"{where}: not valid TOML: {error}{hint}") from None
    except RecursionError:
        raise SceneError(f"{where}: lists or tables are nested too deeply") from None
    except ValueError as error:
        raise SceneError(f"{where}: not valid TOML: {error}") from None


def _parse_json(text: str, where: str) -> dict[str, Any]:
    def unique_table(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        table: dict[str, Any] = {}
        for key, value in pairs:
            if key in table:
                raise SceneError(f"{where}: the key {key!r:.60} appears twice in one table")
            table[key] = value
        return table

    try:
        data = json.loads(text, object_pairs_hook=unique_table, parse_constant=float)
    except json.JSONDecodeError as error:
        raise SceneError(f"{where}: not valid JSON: {error}") from None
    except RecursionError:
        raise SceneError(f"{where}: lists or tables are nested too deeply") from None
    except ValueError as error:
        raise SceneError(f"{where}: not valid JSON: {error}") from None
    if not isinstance(data, dict):
        raise SceneError(f"{where}: expected one table (an object in braces) with gravity and body")
    return data
