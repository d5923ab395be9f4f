"""Check that the files to which a mesh file refers are in its folder.

Formats that refer to other files: Abaqus (*INCLUDE), XDMF (DataItem), and HDF5 (external links,
external storage, virtual data).  meshio follows them to any folder.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from mstmm.display import escape_control_characters
from mstmm.errors import SceneError

#: Suffixes of HDF5 files.
_HDF5 = (".h5", ".hdf5", ".hdf", ".h5m", ".med", ".cgns", ".hmf")


def check_referenced_files(path: Path, where: str) -> None:
    """Raise SceneError if `path` refers to files outside its folder, directly or not."""
    _check_references(path, path.parent.resolve(), where, ())


def _check_references(path: Path, folder: Path, where: str, parents: tuple[Path, ...]) -> None:
    chain = (*parents, path.resolve())
    for name, target in _references(path):
        if not target.resolve().is_relative_to(folder):
            raise SceneError(
                f"{where}: {escape_control_characters(path.name)} refers to "
                f"{escape_control_characters(name)}, which is not in "
                "its own folder; put that file next to the mesh"
            )
        if target.resolve() in chain:
            raise SceneError(
                f"{where}: {escape_control_characters(path.name)} includes itself; remove that line"
            )
        if target.is_file():
            _check_references(target, folder, where, chain)


def _references(path: Path) -> Iterator[tuple[str, Path]]:
    """References of a file, each with the path that meshio would open."""
    kind = path.suffix.lower()
    if kind == ".inp":
        yield from _abaqus_references(path)
    elif kind in (".xdmf", ".xmf"):
        yield from _xdmf_references(path)
    elif kind in _HDF5:
        yield from _hdf5_references(path)


def _abaqus_references(path: Path) -> Iterator[tuple[str, Path]]:
    with path.open(encoding="utf-8", errors="replace") as file:
        for line in file:
            if line.startswith("*") and line[1:].split(",")[0].strip().upper() == "INCLUDE":
                name = line.split("=")[-1].strip()
                target = Path(name)  # meshio looks in the current folder first
                yield name, target if target.exists() else path.parent / name


def _xdmf_references(path: Path) -> Iterator[tuple[str, Path]]:
    try:
        items = list(ElementTree.parse(path).iter("DataItem"))
    except (ElementTree.ParseError, ValueError):  # meshio reports the error
        return
    for item in items:
        text, form = (item.text or "").strip(), item.get("Format", "XML").upper()
        if form == "HDF":
            name = text.split(":")[0]
            yield name, path.resolve().parent / name
        elif form == "BINARY":
            yield text, Path(text)  # meshio reads it from the current folder


def _hdf5_references(path: Path) -> Iterator[tuple[str, Path]]:
    try:
        import h5py
    except ImportError:  # meshio cannot read it either
        return
    try:
        with h5py.File(path, "r") as file:
            names = list(_hdf5_links(h5py, file))
    except (OSError, RuntimeError, KeyError, ValueError):  # meshio reports the error
        return
    for name in names:
        yield name, path.parent / name


def _hdf5_links(h5py: Any, group: Any) -> Iterator[str]:
    for key in group:
        link = group.get(key, getlink=True)
        if isinstance(link, h5py.ExternalLink):
            yield str(link.filename)
        elif isinstance(link, h5py.HardLink):
            item = group[key]
            if isinstance(item, h5py.Group):
                yield from _hdf5_links(h5py, item)
            elif isinstance(item, h5py.Dataset):
                yield from (str(name) for name, _, _ in item.external or ())
                if item.is_virtual:
                    sources = (str(source.file_name) for source in item.virtual_sources())
                    yield from (name for name in sources if name != ".")
