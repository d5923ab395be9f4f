"""Mapping from names and mesh files of a robot file to those of a scene."""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Container, Iterable, Mapping
from pathlib import Path
from urllib.parse import unquote

from ..tables.names import is_external_name
from ..validators.scalars_and_vectors import GROUND

_INVALID_CHARACTERS, _VALID_NAME = re.compile("[^A-Za-z0-9_]+"), re.compile("[A-Za-z][A-Za-z0-9_]*")
_MAX_NAME_LENGTH = 60


class NameRegistry:
    """Registry that gives each name of a file a unique valid name in the scene."""

    def __init__(self) -> None:
        self._used_names = {GROUND}

    def register_all(
        self, names: Iterable[str], instead: str, others: Iterable[str] = ()
    ) -> dict[str, str]:
        """Register several names: scene names by file names.

        Names that are valid in a scene are kept; no other name becomes one of `others`.
        """
        file_names, scene_names = list(names), dict[str, str]()
        for keep_valid in (True, False):
            for name in file_names:
                is_valid = bool(_VALID_NAME.fullmatch(name)) and name != GROUND
                if is_valid == keep_valid:
                    scene_names[name] = self.register(name, instead)
            self._used_names.update(others)
        return {name: scene_names[name] for name in file_names}

    def register(self, name: str, instead: str) -> str:
        """Register a name: invalid characters become _, and the result is made unique.

        `instead` is the prefix of names that do not begin with a letter.
        """
        base_name = _INVALID_CHARACTERS.sub("_", name).strip("_")[:_MAX_NAME_LENGTH]
        if not base_name[:1].isalpha():
            base_name = f"{instead}_{base_name}".rstrip("_")
        unique_name, count = base_name, 1
        while unique_name in self._used_names:
            count += 1
            unique_name = f"{base_name}_{count}"
        self._used_names.add(unique_name)
        return unique_name


def reference_names(
    links: Mapping[str, str], joints: Mapping[str, str], references: Container[str]
) -> dict[str, dict[str, str]]:
    """Table [names] of a scene: names of links and joints that are renamed in the scene.

    Where several links are one body, the first of them is the name of the body.  `references` are
    the bodies and ends of the scene.
    """
    counts = Counter(links.values())
    bodies = {
        name: scene_name for name, scene_name in links.items()
        if is_external_name(name)
        and (counts[scene_name] > 1 if name == scene_name else name not in references)
    }  # fmt: skip
    hinges = {
        name: scene_name for name, scene_name in joints.items()
        if is_external_name(name) and name != scene_name
    }  # fmt: skip
    tables = {"body": bodies, "hinge": hinges}
    return {table: name_table for table, name_table in tables.items() if name_table}


# --- mesh files -----------------------------------------------------------------------------------


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
            folders = (self.folder, *self.folder.parents)
            candidates = (os.path.join(folder, name) for folder in folders)
            self._packages[name] = next(filter(os.path.isdir, candidates), None)
        return self._packages[name]
