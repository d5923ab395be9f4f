"""Files that a mesh names itself: they lie in its own folder, or the mesh is refused.

Formats that refer to other files: Abaqus (*INCLUDE), XDMF (DataItem), and HDF5 (external links,
external storage, virtual data).  meshio follows them wherever they lead.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from mstmm.errors import SceneError
from mstmm.safe_text import escape_control_characters

#: Endings of files that are HDF5.
_HDF5 = (".h5", ".hdf5", ".hdf", ".h5m", ".med", ".cgns", ".hmf")


def check_referenced_files(path: Path, where: str) -> None:
    """SceneError if `path`, or a file of its folder that it names, names one elsewhere."""
    _walk(path, path.parent.resolve(), where, ())


def _walk(path: Path, folder: Path, where: str, above: tuple[Path, ...]) -> None:
    chain = (*above, path.resolve())
    for name, read_as in _named(path):
        if not read_as.resolve().is_relative_to(folder):
            raise SceneError(
                f"{where}: {escape_control_characters(path.name)} refers to "
                f"{escape_control_characters(name)}, which is not in "
                "its own folder; put that file beside the mesh"
            )
        if read_as.resolve() in chain:
            raise SceneError(
                f"{where}: {escape_control_characters(path.name)} includes itself; take that line "
                f"out"
            )
        if read_as.is_file():
            _walk(read_as, folder, where, chain)


def _named(path: Path) -> Iterator[tuple[str, Path]]:
    """Every file that a file names, and the path under which meshio would open it."""
    kind = path.suffix.lower()
    if kind == ".inp":
        yield from _abaqus(path)
    elif kind in (".xdmf", ".xmf"):
        yield from _xdmf(path)
    elif kind in _HDF5:
        yield from _hdf5(path)


def _abaqus(path: Path) -> Iterator[tuple[str, Path]]:
    with path.open(encoding="utf-8", errors="replace") as file:
        for line in file:
            if line.startswith("*") and line[1:].split(",")[0].strip().upper() == "INCLUDE":
                name = line.split("=")[-1].strip()
                here = Path(name)  # meshio looks in the current folder first
                yield name, here if here.exists() else path.parent / name


def _xdmf(path: Path) -> Iterator[tuple[str, Path]]:
    try:
        items = list(ElementTree.parse(path).iter("DataItem"))
    except (ElementTree.ParseError, ValueError):  # what is wrong with it meshio says
        return
    for item in items:
        text, form = (item.text or "").strip(), item.get("Format", "XML").upper()
        if form == "HDF":
            name = text.split(":")[0]
            yield name, path.resolve().parent / name
        elif form == "BINARY":
            yield text, Path(text)  # from the current folder, says meshio


def _hdf5(path: Path) -> Iterator[tuple[str, Path]]:
    try:
        import h5py
    except ImportError:  # meshio cannot read it either
        return
    try:
        with h5py.File(path, "r") as file:
            names = list(_links(h5py, file))
    except (OSError, RuntimeError, KeyError, ValueError):  # what is wrong with it meshio says
        return
    for name in names:
        yield name, path.parent / name


def _links(h5py: Any, group: Any) -> Iterator[str]:
    for key in group:
        link = group.get(key, getlink=True)
        if isinstance(link, h5py.ExternalLink):
            yield str(link.filename)
        elif isinstance(link, h5py.HardLink):
            found = group[key]
            if isinstance(found, h5py.Group):
                yield from _links(h5py, found)
            elif isinstance(found, h5py.Dataset):
                yield from (str(name) for name, _, _ in found.external or ())
                if found.is_virtual:
                    sources = (str(source.file_name) for source in found.virtual_sources())
                    yield from (name for name in sources if name != ".")
