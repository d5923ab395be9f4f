"""Where the meshes of a robot lie."""

from __future__ import annotations

import os
from pathlib import Path
from urllib.parse import unquote

_PACKAGE, _FILE = "package://", "file://"


class Meshes:
    """The meshes around a robot's file in `folder`.

    Packages are not looked up: "package://NAME/PLACE" is in the nearest folder NAME that `folder`
    is in, or that lies beside one that it is in.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._packages = dict[str, str | None]()

    def path(self, name: str) -> str | None:
        """The mesh of this name in the robot's file; None where it is not there."""
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
