"""Files of the cache: the folder, which no other user can write to, and one entry a library.

Libraries in this folder, or in the store of user-defined elements, are loaded into the process.
The folder must therefore belong to the user, and no other user may write to it.  Any other folder
is rejected, with a remedy.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import stat
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mstmm.errors import EnvironmentFailure

VARIABLE = "MSTMM_CACHE"

#: Maximum size of the cache, megabytes; $MSTMM_CACHE_SIZE overrides it.
LIMIT_VARIABLE = "MSTMM_CACHE_SIZE"
DEFAULT_LIMIT = 512.0

#: User who may write libraries to folders that all can read.
_ROOT = 0

_REMEDY = f"set {VARIABLE} to a folder that you own"


def folder() -> Path:
    """Cache folder: $MSTMM_CACHE, or the user's.  EnvironmentFailure without a home folder."""
    configured_folder = os.environ.get(VARIABLE)
    if configured_folder:
        return Path(configured_folder).absolute()
    import platformdirs

    place = Path(platformdirs.user_cache_path("mstmm"))
    if not place.is_absolute():  # no home folder: "~/.cache" would be in the current folder
        raise EnvironmentFailure(f"this user has no home folder for a cache; {_REMEDY}")
    return place


def size_limit() -> int:
    """Maximum size of the cache in bytes.  EnvironmentFailure if the variable is no number."""
    text = os.environ.get(LIMIT_VARIABLE)
    try:
        megabytes = float(text) if text else DEFAULT_LIMIT
    except ValueError:
        megabytes = -1.0
    if not 0 <= megabytes < 1e9:
        raise EnvironmentFailure(
            f"{LIMIT_VARIABLE}={text!r}: expected the size of the cache in megabytes, such as 512"
        )
    return int(megabytes * 1e6)


def private_folder() -> Path:
    """Cache folder, created if it is missing (mode 0700), and checked.

    Raises EnvironmentFailure if it cannot be created, belongs to another user, or others may write
    to it.
    """
    place = folder()
    try:
        status = _folder_status(place)
    except OSError as error:
        raise EnvironmentFailure(
            f"the cache folder {place} cannot be used ({error.strerror}); {_REMEDY}"
        ) from None
    problem = folder_problem(place, status) or parent_problem(place, "cache", _REMEDY)
    if problem:
        raise EnvironmentFailure(problem)
    return place


def _folder_status(place: Path) -> os.stat_result:
    try:
        return os.stat(place)
    except FileNotFoundError:
        place.parent.mkdir(parents=True, exist_ok=True)
        place.mkdir(mode=0o700, exist_ok=True)
        return os.stat(place)


def folder_problem(
    place: Path, status: os.stat_result, what: str = "cache", way_out: str = _REMEDY,
    owners: tuple[int, ...] = (),
) -> str:  # fmt: skip
    """Reason to reject a folder for libraries, or "".  `owners` are further trusted users."""
    if not stat.S_ISDIR(status.st_mode):
        return f"the {what} {place} is not a folder; {way_out}"
    if status.st_uid not in (os.geteuid(), *owners):
        return (
            f"the {what} folder {place} belongs to user {status.st_uid}, you are user "
            f"{os.geteuid()}: its content cannot be trusted; {way_out}"
        )
    if status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        return (
            f"others may write to the {what} folder {place} (mode "
            f"{stat.S_IMODE(status.st_mode):04o}); inspect it and chmod 700 it, or {way_out}"
        )
    return ""


def parent_problem(place: Path, what: str, way_out: str) -> str:
    """Reason that other users could replace a folder, or ""."""
    for parent in place.resolve().parents:
        status = parent.stat()
        is_shared = status.st_mode & stat.S_IWOTH and not status.st_mode & stat.S_ISVTX
        if is_shared or status.st_uid not in (os.geteuid(), _ROOT):
            return (
                f"others may replace the {what} folder {place}: its parent {parent} belongs to "
                f"user {status.st_uid} and has mode {stat.S_IMODE(status.st_mode):04o}; {way_out}"
            )
    return ""


def is_private(status: os.stat_result) -> bool:
    """True for a file or folder, no link, of this user or root that no other user may write to."""
    is_plain = stat.S_ISREG(status.st_mode) or stat.S_ISDIR(status.st_mode)
    is_own = status.st_uid in (os.geteuid(), _ROOT)
    return is_plain and is_own and not status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


# --- entries --------------------------------------------------------------------------------------
#
#     fused-0123456789abcdef.../
#         fused.so        the library
#         entry.json      key, SHA-256 of the library, its recipe and compiler
#         fused.c.gz      the text, for the user; no code reads it
#
# The folder appears by one rename when it is complete, so that no process reads a part of one.
# The checksum detects later damage before anything is loaded.

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


def read_entry(folder: Path, key: str | None = None) -> Entry | None:
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


def write_entry(folder: Path, library: str, about: Mapping[str, Any]) -> Entry:
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
