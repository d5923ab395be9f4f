"""Files of robots: which endings are read, and by whom."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...arguments import short
from ...errors import SceneError
from ..files.read import content_of
from .convert import BASES, COUPLED, MIMICS, Choices, Imported, converted
from .mjcf import read_mjcf
from .mjcf_files import looked_through
from .units import Units, scaled
from .urdf import read_urdf

#: Endings, and the largest file of each in MB.
ENDINGS = {".urdf": 16, ".xml": 16, ".mjcf": 16}


def is_robot(path: str | os.PathLike[str]) -> bool:
    """Whether the name of a file ends as that of a robot."""
    return os.path.splitext(os.fsdecode(path))[1].lower() in ENDINGS


def import_robot(
    path: str | os.PathLike[str], base: str = "fixed", merge: bool = True,
    stops: float | None = None, mimics: str = COUPLED,
    units: Mapping[str, str] | None = None,
) -> Imported:  # fmt: skip
    """The scene of a robot's file, what became of its names, and notes on what differs.

    URDF is read as it is; MJCF (.xml, .mjcf) by MuJoCo, extra `robot`.

    base: "fixed" on the ground, or "free".  merge: links on fixed joints become part of the body
    that holds them, and their frames ends of it.  stops: stiffness (N/m or N m/rad) of stops at the
    limits of joints; without it there are none.  mimics: joints that go with others are "coupled"
    to them, or "held" where they start, which leaves no loop.  units: those of
    the file where they are not m and kg, as {"length": "mm", "mass": "g"}; times are in s.  Raises
    SceneError, and EnvironmentFailure where MuJoCo is needed and not there.
    """
    if not (isinstance(base, str) and base in BASES):
        raise SceneError(f'base: expected "fixed" or "free", found {short(base)}')
    if not (isinstance(mimics, str) and mimics in MIMICS):
        raise SceneError(f'mimics: expected "coupled" or "held", found {short(mimics)}')
    if stops is not None and not _is_stiffness(stops):
        raise SceneError(f"stops: expected a stiffness above 0 in N m/rad or N/m, found {stops!r}")
    factors = Units.named(units)
    where, content = content_of(path, ENDINGS, "a robot's file")
    full = Path(os.fsdecode(path)).absolute()
    if full.suffix.lower() == ".urdf":
        robot = read_urdf(content, where)
    elif base == "free":
        raise SceneError(f'{where}: base = "free" is for URDF; in MJCF a <freejoint> says so')
    else:
        robot = read_mjcf(str(full), where, looked_through(content, full, where))
    robot = scaled(robot, factors, gravity=full.suffix.lower() != ".urdf")
    return converted(robot, Choices(base, merge, stops, mimics), full.parent)


def _is_stiffness(value: Any) -> bool:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return number and 0 < value < float("inf")
