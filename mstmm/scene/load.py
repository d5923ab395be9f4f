"""Loading of scene files and robot files."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from ..errors import SceneError
from ..ir.element_spec import ElementSpec
from .files.read import MAX_FILE_SIZE_MB, read_tables
from .robots.formats import import_robot, is_robot
from .scene import Scene
from .tables.elastic_keys import SCENE_FOLDER


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
