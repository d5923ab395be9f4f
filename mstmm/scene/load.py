"""Reading a scene from a file."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from ..errors import SceneError
from ..ir.spec import ElementSpec
from .files.read import MAX_SIZE, read
from .robots.files import import_robot, is_robot
from .scene import Scene
from .tables.elastic_keys import FOLDER


def is_scene_file(name: str) -> bool:
    """Whether a name ends as that of a file that `load_scene` reads."""
    return os.path.splitext(name)[1].lower() in MAX_SIZE or is_robot(name)


def load_scene(
    path: str | os.PathLike[str],
    known_types: Mapping[tuple[str, str], ElementSpec] | None = None,
    *,
    units: Mapping[str, str] | None = None,
) -> Scene:
    """Read and validate a scene file (.toml or .json), or that of a robot as `import_robot` does.

    Relative paths in it start from its folder.  Of the files that it names the numbers of signals
    are read, from no other folder.

    `known_types` maps (kind, name), kind one of hinge, body, force, to the definitions of users'
    types.  When it is given every type must be built in or in it; without it types that are not
    built in are left to `Scene.check_types`.

    units: those of a robot's file where they are not m and kg, as {"length": "mm", "mass": "g"}; a
    scene file is in m and kg always.

    Raises SceneError, and EnvironmentFailure where MuJoCo is needed and not there.
    """
    if isinstance(path, str | os.PathLike) and is_robot(path):
        return import_robot(path, units=units).scene
    where, data = read(path)
    if units is not None:
        raise SceneError(
            f"{where}: units: expected none, for a scene file is in m and kg; found {units!r:.60}. "
            "Leave it out, units are those of a robot's file"
        )
    token = FOLDER.set(str(Path(os.fsdecode(os.fspath(path))).absolute().parent))
    try:
        scene = Scene.from_data(data, where)
    finally:
        FOLDER.reset(token)
    if known_types is not None:
        scene.check_types(known_types, where)
    return scene
