"""Import of robot files, by the reader for their suffix."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...argument_validation import abbreviate
from ...errors import SceneError
from ..files.read import read_content
from .mjcf import read_mjcf
from .mjcf_includes import check_included_files
from .scene_from_robot import BASES, COUPLED, MIMICS, ImportedRobot, ImportOptions, scene_from_robot
from .unit_conversion import Units, convert_units
from .urdf_reader import read_urdf

#: Largest file in MB by suffix.
MAX_FILE_SIZES_MB = {".urdf": 16, ".xml": 16, ".mjcf": 16}


def is_robot(path: str | os.PathLike[str]) -> bool:
    """Whether a file name has the suffix of a robot file."""
    return os.path.splitext(os.fsdecode(path))[1].lower() in MAX_FILE_SIZES_MB


def import_robot(
    path: str | os.PathLike[str], base: str = "fixed", merge: bool = True,
    stops: float | None = None, mimics: str = COUPLED,
    units: Mapping[str, str] | None = None,
) -> ImportedRobot:  # fmt: skip
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
        raise SceneError(f'base: expected "fixed" or "free", found {abbreviate(base)}')
    if not (isinstance(mimics, str) and mimics in MIMICS):
        raise SceneError(f'mimics: expected "coupled" or "held", found {abbreviate(mimics)}')
    if stops is not None and not _is_stiffness(stops):
        raise SceneError(f"stops: expected a stiffness above 0 in N m/rad or N/m, found {stops!r}")
    factors = Units.from_names(units)
    where, content = read_content(path, MAX_FILE_SIZES_MB, "a robot's file")
    absolute_path = Path(os.fsdecode(path)).absolute()
    if absolute_path.suffix.lower() == ".urdf":
        robot = read_urdf(content, where)
    elif base == "free":
        raise SceneError(f'{where}: base = "free" is for URDF only; in MJCF use a <freejoint>')
    else:
        robot = read_mjcf(
            str(absolute_path), where, check_included_files(content, absolute_path, where)
        )
    robot = convert_units(robot, factors, gravity=absolute_path.suffix.lower() != ".urdf")
    return scene_from_robot(robot, ImportOptions(base, merge, stops, mimics), absolute_path.parent)


def _is_stiffness(value: Any) -> bool:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return number and 0 < value < float("inf")
