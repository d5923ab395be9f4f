"""Folder of compiled libraries, and the checks that no other user can write to it.

Libraries in this folder, or in the store of user-defined elements, are loaded into the process.
The folder must therefore belong to the user, and no other user may write to it.  Any other folder
is rejected, with a remedy.
"""

from __future__ import annotations

import os
import stat
from pathlib import Path

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
