"""Where compiled libraries are kept, and why nobody else can put one there.

What lies in this folder, or in the store of users' elements, is loaded into the process.  So the
folder belongs to the user who runs it and nobody else may write to it; anything else is refused,
with the way out.
"""

from __future__ import annotations

import os
import stat
from pathlib import Path

from mstmm.errors import EnvironmentFailure

VARIABLE = "MSTMM_CACHE"

#: Megabytes that the cache may hold; $MSTMM_CACHE_SIZE overrides.
LIMIT_VARIABLE = "MSTMM_CACHE_SIZE"
DEFAULT_LIMIT = 512.0

#: The user who may put a library where all can read it.
_ROOT = 0

_WAY_OUT = f"set {VARIABLE} to a folder of your own"


def folder() -> Path:
    """The cache: $MSTMM_CACHE, or the user's cache folder.  EnvironmentFailure without a home."""
    named = os.environ.get(VARIABLE)
    if named:
        return Path(named).absolute()
    import platformdirs

    place = Path(platformdirs.user_cache_path("mstmm"))
    if not place.is_absolute():  # no home folder: "~/.cache" would land where we happen to be
        raise EnvironmentFailure(f"this user has no home folder for a cache; {_WAY_OUT}")
    return place


def limit() -> int:
    """Bytes that the cache may hold.  EnvironmentFailure if the variable is no number."""
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
    """The cache, made if it is missing (0700), and checked.

    Raises EnvironmentFailure if it cannot be made, is not ours, or others may write to it.
    """
    place = folder()
    try:
        status = _status(place)
    except OSError as error:
        raise EnvironmentFailure(
            f"the cache folder {place} cannot be used ({error.strerror}); {_WAY_OUT}"
        ) from None
    problem = objection(place, status) or parent_objection(place, "cache", _WAY_OUT)
    if problem:
        raise EnvironmentFailure(problem)
    return place


def _status(place: Path) -> os.stat_result:
    try:
        return os.stat(place)
    except FileNotFoundError:
        place.parent.mkdir(parents=True, exist_ok=True)
        place.mkdir(mode=0o700, exist_ok=True)
        return os.stat(place)


def objection(
    place: Path, status: os.stat_result, what: str = "cache", way_out: str = _WAY_OUT,
    owners: tuple[int, ...] = (),
) -> str:  # fmt: skip
    """Why a folder is no place for libraries; "" if it is one.  `owners` are trusted like us."""
    if not stat.S_ISDIR(status.st_mode):
        return f"the {what} {place} is not a folder; {way_out}"
    if status.st_uid not in (os.geteuid(), *owners):
        return (
            f"the {what} folder {place} belongs to user {status.st_uid}, you are user "
            f"{os.geteuid()}: what it holds could be anybody's; {way_out}"
        )
    if status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        return (
            f"others may write to the {what} folder {place} (mode "
            f"{stat.S_IMODE(status.st_mode):04o}); chmod 700 it after a look, or {way_out}"
        )
    return ""


def parent_objection(place: Path, what: str, way_out: str) -> str:
    """Why somebody else could put another folder into the place of one; "" if nobody can."""
    for parent in place.resolve().parents:
        status = parent.stat()
        shared = status.st_mode & stat.S_IWOTH and not status.st_mode & stat.S_ISVTX
        if shared or status.st_uid not in (os.geteuid(), _ROOT):
            return (
                f"others may replace the {what} folder {place}: its parent {parent} belongs to "
                f"user {status.st_uid} and has mode {stat.S_IMODE(status.st_mode):04o}; {way_out}"
            )
    return ""


def is_private(status: os.stat_result) -> bool:
    """Whether a file or folder, no link, is ours or root's and closed to other writers."""
    kept = stat.S_ISREG(status.st_mode) or stat.S_ISDIR(status.st_mode)
    ours = status.st_uid in (os.geteuid(), _ROOT)
    return kept and ours and not status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
