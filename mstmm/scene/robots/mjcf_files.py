"""Checks of an MJCF file and of the files it includes, before MuJoCo reads them."""

from __future__ import annotations

import stat
from collections.abc import Collection, Iterator
from pathlib import Path

from ...arguments import short
from ...errors import SceneError
from ..files.read import content_of
from .markup import Element, parsed
from .mjcf_limits import MOST_ELEMENTS, check_element, count_copies

#: Most nested elements: bodies of a long chain are nested.
_DEEPEST = 2000
#: Most files of a model, and the largest of them in MB: MJCF, and meshes or textures.
_MOST, _LARGEST, _LARGEST_ASSET = 200, 16, 200
#: Tags that refer to another MJCF file.
_NAMING = ("include", "model")
#: Attributes that refer to files, and attributes of <compiler> that give their folders.
_FILES = ("file", "fileright", "fileleft", "fileup", "filedown", "filefront", "fileback")
_FOLDERS = ("meshdir", "texturedir", "assetdir")

#: Sections whose elements share one namespace for all tags.
_SECTIONS = ("equality", "tendon", "contact", "actuator", "sensor")

#: (section of these or else tag, name) -> file and line.
Places = dict[tuple[str, str], str]


def looked_through(content: bytes, path: Path, where: str) -> Places:
    """Check an MJCF file with its included files; return the locations of named elements.

    Raises SceneError for document types and entities, for text that is not XML, and for too many or
    too large files or elements.  It also raises SceneError for files, including meshes and
    textures, that are outside the folder of the model or not regular.
    """
    folder, found = path.parent.resolve(), Places()
    waiting, seen, total = [(content, path, where, 1)], {path.resolve()}, 0
    assets, folders = list[tuple[Element, Path]](), {""}
    while waiting:
        content, path, where, copies = waiting.pop()
        for section, one, here in _all(parsed(content, where, _DEEPEST), copies):
            check_element(one)
            total += here
            if total > MOST_ELEMENTS:
                raise SceneError(
                    f"{one.where}: <{one.tag}>: the model has more than {MOST_ELEMENTS} elements "
                    "including copies; leave some out"
                )
            folders.update(one.attributes[key] for key in _FOLDERS if key in one.attributes)
            if one.tag not in _NAMING:
                assets.append((one, path.parent))
            if name := one.attributes.get("name"):
                found.setdefault((section or one.tag, name), one.where)
            if one.tag not in _NAMING or "file" not in one.attributes:
                continue
            for other in _others(one, folder, path.parent):
                if other not in seen:
                    seen.add(other)
                    shown = str(other.relative_to(folder))
                    ending = {other.suffix.lower(): _LARGEST}
                    inside = content_of(other, ending, "MJCF")[1]
                    if not inside.strip():
                        raise _refused(one, "the file is empty")
                    waiting.append((inside, other, shown, here))
        if len(seen) > _MOST:
            raise SceneError(f"{where}: the model has more than {_MOST} files")
    for one, beside in assets:
        _check_assets(one, folder, beside, folders)
    return found


def _check_assets(one: Element, folder: Path, beside: Path, folders: Collection[str]) -> None:
    """Check the mesh or texture files of an element in all `folders` of compilers.

    Raises SceneError for files outside the folder of the model, not regular, or too large.
    """
    for key in _FILES:
        if one.attributes.get(key, "").strip():
            for other in _others(one, folder, beside, key, folders):
                if other.stat().st_size > _LARGEST_ASSET * 2**20:
                    raise _refused(one, f"the file is larger than {_LARGEST_ASSET} MB", key)


def _others(
    one: Element,
    folder: Path,
    beside: Path,
    key: str = "file",
    folders: Collection[str] | None = None,
) -> Iterator[Path]:
    """Existing files that an element may refer to, in the folder of the model or its file.

    MuJoCo reads a backslash as a slash, and may ignore folders.
    """
    name = one.attributes[key]
    if not name.strip():
        raise _refused(one, "expected the name of a file", key)
    bare = name.replace("\\", "/")
    names = {name, bare} if folders is None else {name, bare, Path(bare).name}
    starts = {start / place for start in (folder, beside) for place in folders or ("",)}
    for start in sorted(starts):
        for each in sorted(names):
            try:
                other = (start / each).resolve()
                mode = other.stat().st_mode if other.is_relative_to(folder) else None
            except (FileNotFoundError, NotADirectoryError):
                continue
            except (OSError, RuntimeError, ValueError) as error:  # long names, cyclic links
                why = getattr(error, "strerror", None) or "links to itself"
                raise _refused(one, f"cannot be read: {why}", key) from None
            if mode is None:
                why = "expected a file in the folder of the model or below it; copy it there"
                raise _refused(one, why, key)
            if not stat.S_ISREG(mode):
                raise _refused(one, "this is not a regular file; give the path of one", key)
            yield other


def _refused(one: Element, why: str, key: str = "file") -> SceneError:
    return SceneError(f"{one.where}: <{one.tag}> {key} {short(one.attributes[key])}: {why}")


def _all(one: Element, copies: int) -> Iterator[tuple[str, Element, int]]:
    """Yield an element and all its descendants as (section, element, number of copies).

    The section is one of `_SECTIONS` or "".
    """
    left = [("", one, copies)]
    while left:
        section, one, copies = left.pop()
        copies *= count_copies(one)
        yield section, one, copies
        inside = one.tag if one.tag in _SECTIONS else ""
        left += [(inside, child, copies) for child in reversed(one.children)]
