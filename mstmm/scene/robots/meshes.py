"""Where the meshes of a robot lie."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import unquote

_PACKAGE, _FILE = "package://", "file://"


def mesh_file(folder: Path, name: str) -> Path | None:
    """The mesh that a robot's file in `folder` names; None where it is not there.

    Packages are not looked up: "package://NAME/PLACE" is the nearest folder NAME that `folder` is
    in, or that lies beside one that it is in.
    """
    if name.startswith(_FILE):
        return _there([Path(unquote(name.removeprefix(_FILE)))])
    if name.startswith(_PACKAGE):
        place = Path(unquote(name.removeprefix(_PACKAGE)))
        return _there([above / place for above in (folder, *folder.parents)])
    return _there([folder / name])


def _there(places: list[Path]) -> Path | None:
    return next((place for place in places if place.is_file()), None)
