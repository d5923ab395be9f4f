"""Import of robot files, by the reader for their suffix."""

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

#: Largest file in MB by suffix.
ENDINGS = {".urdf": 16, ".xml": 16, ".mjcf": 16}


def is_robot(path: str | os.PathLike[str]) -> bool:
    """Whether a file name has the suffix of a robot file."""
    return os.path.splitext(os.fsdecode(path))[1].lower() in ENDINGS


def import_robot(
    path: str | os.PathLike[str], base: str = "fixed", merge: bool = True,
    stops: float | None = None, mimics: str = COUPLED,
    units: Mapping[str, str] | None = None,
) -> Imported:  # fmt: skip
    """Import a robot file: its scene, a mapping of its names, and notes on differences.

    URDF is read directly; MJCF (.xml, .mjcf) is read by MuJoCo, extra `robot`.

    base: "fixed" on the ground, or "free".  merge: links on fixed joints become part of their
    inboard body, and their frames ends of it.  stops: stiffness (N/m or N m/rad) of stops at the
    limits of joints; without it there are no stops.  mimics: joints that mimic others are "coupled"
    to them, or "held" at their initial value, which avoids closed loops.  units: units of a file
    that is not in m and kg, as {"length": "mm", "mass": "g"}; times are in s.

    Raises SceneError, and EnvironmentFailure where MuJoCo is needed but not installed.
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
        raise SceneError(f'{where}: base = "free" is for URDF only; in MJCF use a <freejoint>')
    else:
        robot = read_mjcf(str(full), where, looked_through(content, full, where))
    robot = scaled(robot, factors, gravity=full.suffix.lower() != ".urdf")
    return converted(robot, Choices(base, merge, stops, mimics), full.parent)


def _is_stiffness(value: Any) -> bool:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return number and 0 < value < float("inf")
