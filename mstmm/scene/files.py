"""Scene files: reading TOML and JSON, with a message for each kind of failure, and writing TOML."""

from __future__ import annotations

import json
import os
import re
import stat
import tomllib
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import SceneError
from ..ir.hinge_properties import builtin_hinges
from .validators.constant_expressions import WrittenNumber, is_number
from .validators.validation_messages import TABLES, did_you_mean

if TYPE_CHECKING:
    from .tables.scene_tables import SceneTables

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
        hint = _similar_file_hint(path, limits)
        raise SceneError(f"{where}: there is no such file{hint}") from None
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


# --- writing --------------------------------------------------------------------------------------


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
        # TOML has no null, and an empty list is always the default.
        written = {k: v for k, v in value.items() if v is not None and v != ()}
        entries_text = ", ".join(f"{k} = {_toml_value(v, evaluated)}" for k, v in written.items())
        return "{ " + entries_text + " }" if entries_text else "{}"
    return "[" + ", ".join(_toml_value(v, evaluated) for v in value) + "]"


def _toml_string(text: str) -> str:
    """Text as a basic string of TOML."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(c if c.isprintable() else f"\\u{ord(c):04x}" for c in escaped) + '"'
