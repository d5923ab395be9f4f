"""Cache entry of one compiled library: a folder with the library, its description and C text.

    fused-0123456789abcdef.../
        fused.so        the library
        entry.json      key, SHA-256 of the library, its recipe and compiler
        fused.c.gz      the text, for the user; no code reads it

The folder appears by one rename when it is complete, so that no process reads an incomplete entry.
The checksum detects later damage before anything is loaded.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .cache_folder import is_private

#: Layout of the folder; an entry of another layout is built again.
FORMAT = 1

DESCRIPTION_FILE = "entry.json"


class DamagedEntryError(Exception):
    """Entry that contradicts its description; the message says how."""


@dataclass(frozen=True)
class Entry:
    """Library whose checksum was correct when it was read, and its description."""

    folder: Path
    about: dict[str, Any]

    @property
    def library(self) -> Path:
        return self.folder / str(self.about["library"])


def read(folder: Path, key: str | None = None) -> Entry | None:
    """Read and verify the entry in `folder`, None if there is none.

    Raises Damaged if it is damaged, or if it is not the entry of `key` (if given).
    """
    description = _read_description(folder)
    if description is None:
        return None
    if key is not None and description["key"] != key:
        raise DamagedEntryError("it belongs to another scene or compiler")
    entry = Entry(folder, description)
    try:
        content = read_private(entry.library)
    except OSError as error:
        raise DamagedEntryError(f"its library cannot be read ({error.strerror})") from None
    if len(content) != description["bytes"]:
        raise DamagedEntryError(f"its library has {len(content)} bytes of {description['bytes']}")
    if hashlib.sha256(content).hexdigest() != description["sha256"]:
        raise DamagedEntryError("the checksum of its library is wrong")
    return entry


def _read_description(folder: Path) -> dict[str, Any] | None:
    try:
        if not is_private(os.lstat(folder)):
            raise DamagedEntryError("others may write to its folder, or it is a link")
        description = json.loads(read_private(folder / DESCRIPTION_FILE))
    except FileNotFoundError:
        if folder.is_dir():
            raise DamagedEntryError("its description is missing") from None
        return None
    except (OSError, ValueError, RecursionError):
        raise DamagedEntryError("its description cannot be read") from None
    expected_types = {"format": int, "key": str, "library": str, "bytes": int, "sha256": str}
    if not isinstance(description, dict) or description.get("format") != FORMAT:
        raise DamagedEntryError("it has another layout")
    if any(
        not isinstance(description.get(name), expected_type)
        for name, expected_type in expected_types.items()
    ):
        raise DamagedEntryError("its description is incomplete")
    if Path(description["library"]).name != description["library"]:
        raise DamagedEntryError("its description names a file in another folder")
    return description


def read_private(path: Path) -> bytes:
    """Read a regular file that no other user may write to.

    Raises Damaged for any other file or a link, OSError if it cannot be read.
    """
    if not is_private(os.lstat(path)):
        raise DamagedEntryError(f"others may write to {path.name}, or it is a link")
    handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW)
    with open(handle, "rb") as file:
        if not is_private(os.fstat(handle)):
            raise DamagedEntryError(f"others may write to {path.name}")
        return file.read()


def write(folder: Path, library: str, about: Mapping[str, Any]) -> Entry:
    """Write the description of the library in `folder`.  Raises OSError."""
    content = (folder / library).read_bytes()
    full_description = {
        "format": FORMAT, "library": library, "bytes": len(content),
        "sha256": hashlib.sha256(content).hexdigest(), **about,
    }  # fmt: skip
    (folder / DESCRIPTION_FILE).write_text(json.dumps(full_description, indent=1), encoding="utf-8")
    (folder / DESCRIPTION_FILE).chmod(0o600)
    return Entry(folder, full_description)


def store_text(folder: Path, sources: Mapping[str, str]) -> None:
    """Write the C text, compressed, into `folder`.  Raises OSError."""
    import gzip

    for name, text in sources.items():
        compressed = gzip.compress(text.encode(), compresslevel=3, mtime=0)
        (folder / f"{name}.gz").write_bytes(compressed)


def mark_used(entry: Entry) -> None:
    """Record that the entry is used now: the least recently used entries are removed first."""
    with contextlib.suppress(OSError):  # a read-only cache is sufficient
        os.utime(entry.folder / DESCRIPTION_FILE)
