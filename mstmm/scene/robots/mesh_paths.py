"""Paths of the mesh files of a robot."""

from __future__ import annotations

import os
from pathlib import Path
from urllib.parse import unquote

_PACKAGE_PREFIX, _FILE_PREFIX = "package://", "file://"


class MeshFinder:
    """Finder of the mesh files of a robot file in `folder`.

    ROS packages are not resolved: "package://NAME/PATH" is searched in the nearest folder NAME that
    is in `folder` or in one of its parent folders.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._packages = dict[str, str | None]()

    def path(self, name: str) -> str | None:
        """Path of a mesh by its name in the robot file; None where there is no such file."""
        if name.startswith(_FILE_PREFIX):
            file_path: str | None = unquote(name.removeprefix(_FILE_PREFIX))
        elif name.startswith(_PACKAGE_PREFIX):
            package, _, inner_path = unquote(name.removeprefix(_PACKAGE_PREFIX)).partition("/")
            package_folder = self._package(package)
            file_path = None if package_folder is None else os.path.join(package_folder, inner_path)
        else:
            file_path = os.path.join(self.folder, name)
        return file_path if file_path is not None and os.path.isfile(file_path) else None

    def _package(self, name: str) -> str | None:
        if name not in self._packages:
            candidates = (
                os.path.join(parent_folder, name)
                for parent_folder in (self.folder, *self.folder.parents)
            )
            self._packages[name] = next(filter(os.path.isdir, candidates), None)
        return self._packages[name]
