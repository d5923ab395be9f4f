"""Paths of the mesh files of a robot."""

from __future__ import annotations

import os
from pathlib import Path
from urllib.parse import unquote

_PACKAGE, _FILE = "package://", "file://"


class Meshes:
    """Finder of the mesh files of a robot file in `folder`.

    ROS packages are not resolved: "package://NAME/PATH" is searched in the nearest folder NAME that
    is in `folder` or in one of its parent folders.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._packages = dict[str, str | None]()

    def path(self, name: str) -> str | None:
        """Path of a mesh by its name in the robot file; None where there is no such file."""
        if name.startswith(_FILE):
            place: str | None = unquote(name.removeprefix(_FILE))
        elif name.startswith(_PACKAGE):
            package, _, inside = unquote(name.removeprefix(_PACKAGE)).partition("/")
            home = self._package(package)
            place = None if home is None else os.path.join(home, inside)
        else:
            place = os.path.join(self.folder, name)
        return place if place is not None and os.path.isfile(place) else None

    def _package(self, name: str) -> str | None:
        if name not in self._packages:
            homes = (os.path.join(above, name) for above in (self.folder, *self.folder.parents))
            self._packages[name] = next(filter(os.path.isdir, homes), None)
        return self._packages[name]
