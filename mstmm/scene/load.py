"""Loading of scene files and robot files."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..argument_validation import abbreviate
from ..errors import SceneError
from ..ir.element_spec import ElementSpec
from .files import MAX_FILE_SIZE_MB, read_content, read_tables
from .robots.mjcf import read_mjcf
from .robots.mjcf_includes import check_included_files
from .robots.scene_from_robot import (
    BASES,
    COUPLED,
    MIMICS,
    ImportedRobot,
    ImportOptions,
    scene_from_robot,
)
from .robots.unit_conversion import Units, convert_units
from .robots.urdf import read_urdf
from .scene import Scene
from .validators.names_and_text import SCENE_FOLDER

#: Largest file in MB by suffix.
_MAX_ROBOT_SIZES_MB = {".urdf": 16, ".xml": 16, ".mjcf": 16}


def is_robot(path: str | os.PathLike[str]) -> bool:
    """Whether a file name has the suffix of a robot file."""
    return os.path.splitext(os.fsdecode(path))[1].lower() in _MAX_ROBOT_SIZES_MB


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
    where, content = read_content(path, _MAX_ROBOT_SIZES_MB, "a robot's file")
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


def is_scene_file(name: str) -> bool:
    """Whether a file name has a suffix that `load_scene` reads."""
    return os.path.splitext(name)[1].lower() in MAX_FILE_SIZE_MB or is_robot(name)


def load_scene(
    path: str | os.PathLike[str],
    known_types: Mapping[tuple[str, str], ElementSpec] | None = None,
    *,
    units: Mapping[str, str] | None = None,
) -> Scene:
    """Read and validate a scene file (.toml or .json) or a robot file (see `import_robot`).

    Relative paths in the file start from its folder.  CSV files of signals are read as well, but
    only from this folder and below.

    `known_types` maps (kind, name), kind one of hinge, body, force, to the definitions of
    user-defined types.  If it is given, every type must be built in or defined in it.  Without it,
    types that are not built in are left to `Scene.check_types`.

    units: units of a robot file that is not in m and kg, as {"length": "mm", "mass": "g"}.  Scene
    files are always in m and kg.

    Raises SceneError, and EnvironmentFailure where MuJoCo is needed but not installed.
    """
    if isinstance(path, str | os.PathLike) and is_robot(path):
        return import_robot(path, units=units).scene
    where, data = read_tables(path)
    if units is not None:
        raise SceneError(
            f"{where}: units: expected none for a scene file, found {units!r:.60}; leave it out, "
            "scene files are in m and kg, only robot files have other units"
        )
    token = SCENE_FOLDER.set(str(Path(os.fsdecode(os.fspath(path))).absolute().parent))
    try:
        scene = Scene.from_data(data, where)
    finally:
        SCENE_FOLDER.reset(token)
    if known_types is not None:
        scene.check_types(known_types, where)
    return scene
