"""Checks of an MJCF file and of the files it includes, before MuJoCo reads them."""

from __future__ import annotations

import stat
from collections.abc import Collection, Iterator
from math import prod
from pathlib import Path

from ...argument_validation import abbreviate
from ...errors import SceneError
from ..files import read_content
from .xml_reader import Element, parse_xml

#: Most nested elements: bodies of a long chain are nested.
_MAX_DEPTH = 2000
#: Most elements of a model, including copies by `replicate` and others.
_MAX_ELEMENT_COUNT = 200_000
#: Most files of a model, and the largest of them in MB: MJCF, and meshes or textures.
_MAX_FILE_COUNT, _MAX_FILE_SIZE_MB, _MAX_ASSET_SIZE_MB = 200, 16, 200
#: Tags that refer to another MJCF file.
_INCLUDING_TAGS = ("include", "model")
#: Attributes that refer to files, and attributes of <compiler> that give their folders.
_FILE_KEYS = ("file", "fileright", "fileleft", "fileup", "filedown", "filefront", "fileback")
_FOLDER_KEYS = ("meshdir", "texturedir", "assetdir")

#: Sections whose elements share one namespace for all tags.
_SECTIONS = ("equality", "tendon", "contact", "actuator", "sensor")

#: (section of these or else tag, name) -> file and line.
Locations = dict[tuple[str, str], str]


def check_included_files(content: bytes, path: Path, where: str) -> Locations:
    """Check an MJCF file with its included files; return the locations of named elements.

    Raises SceneError for document types and entities, for text that is not XML, and for too many or
    too large files or elements.  It also raises SceneError for files, including meshes and
    textures, that are outside the folder of the model or not regular.
    """
    folder, locations = path.parent.resolve(), Locations()
    pending_files, visited_files, element_count = [(content, path, where, 1)], {path.resolve()}, 0
    asset_elements, folders = list[tuple[Element, Path]](), {""}
    while pending_files:
        content, path, where, copies = pending_files.pop()
        for section, element, copy_count in _elements_with_copies(
            parse_xml(content, where, _MAX_DEPTH), copies
        ):
            _check_element(element)
            element_count += copy_count
            if element_count > _MAX_ELEMENT_COUNT:
                raise SceneError(
                    f"{element.where}: <{element.tag}>: the model has more than "
                    f"{_MAX_ELEMENT_COUNT} elements including copies; leave some out"
                )
            folders.update(element.attributes.get(key, "") for key in _FOLDER_KEYS)
            if element.tag not in _INCLUDING_TAGS:
                asset_elements.append((element, path.parent))
            if name := element.attributes.get("name"):
                locations.setdefault((section or element.tag, name), element.where)
            if element.tag not in _INCLUDING_TAGS or "file" not in element.attributes:
                continue
            for included_file in _referenced_files(element, folder, path.parent):
                if included_file not in visited_files:
                    visited_files.add(included_file)
                    shown_path = str(included_file.relative_to(folder))
                    size_limit = {included_file.suffix.lower(): _MAX_FILE_SIZE_MB}
                    included_content = read_content(included_file, size_limit, "MJCF")[1]
                    if not included_content.strip():
                        raise _file_error(element, "the file is empty")
                    pending_files.append((included_content, included_file, shown_path, copy_count))
        if len(visited_files) > _MAX_FILE_COUNT:
            raise SceneError(f"{where}: the model has more than {_MAX_FILE_COUNT} files")
    for element, file_folder in asset_elements:
        _check_assets(element, folder, file_folder, folders)
    return locations


def _check_assets(one: Element, folder: Path, beside: Path, folders: Collection[str]) -> None:
    """Check the mesh or texture files of an element in all `folders` of compilers.

    Raises SceneError for files outside the folder of the model, not regular, or too large.
    """
    for key in _FILE_KEYS:
        if one.attributes.get(key, "").strip():
            for asset_file in _referenced_files(one, folder, beside, key, folders):
                if asset_file.stat().st_size > _MAX_ASSET_SIZE_MB * 2**20:
                    raise _file_error(one, f"the file is larger than {_MAX_ASSET_SIZE_MB} MB", key)


def _referenced_files(
    one: Element, folder: Path, beside: Path, key: str = "file",
    folders: Collection[str] | None = None,
) -> Iterator[Path]:  # fmt: skip
    """Existing files that an element may refer to, in the folder of the model or its file.

    MuJoCo reads a backslash as a slash, and may ignore folders.
    """
    name = one.attributes[key]
    if not name.strip():
        raise _file_error(one, "expected the name of a file", key)
    slash_name = name.replace("\\", "/")
    names = {name, slash_name} if folders is None else {name, slash_name, Path(slash_name).name}
    start_folders = {
        start / subfolder for start in (folder, beside) for subfolder in folders or ("",)
    }
    for start in sorted(start_folders):
        for candidate_name in sorted(names):
            try:
                referenced_file = (start / candidate_name).resolve()
                is_inside = referenced_file.is_relative_to(folder)
                mode = referenced_file.stat().st_mode if is_inside else None
            except (FileNotFoundError, NotADirectoryError):
                continue
            except (OSError, RuntimeError, ValueError) as error:  # long names, cyclic links
                reason = getattr(error, "strerror", None) or "links to itself"
                raise _file_error(one, f"cannot be read: {reason}", key) from None
            if mode is None:
                reason = "expected a file in the folder of the model or below it; copy it there"
                raise _file_error(one, reason, key)
            if not stat.S_ISREG(mode):
                raise _file_error(one, "this is not a regular file; give the path of one", key)
            yield referenced_file


def _file_error(one: Element, why: str, key: str = "file") -> SceneError:
    return SceneError(f"{one.where}: <{one.tag}> {key} {abbreviate(one.attributes[key])}: {why}")


def _elements_with_copies(one: Element, copies: int) -> Iterator[tuple[str, Element, int]]:
    """Yield an element and all its descendants as (section, element, number of copies).

    The section is one of `_SECTIONS` or "".
    """
    stack = [("", one, copies)]
    while stack:
        section, one, copies = stack.pop()
        copies *= _count_copies(one)
        yield section, one, copies
        inner_section = one.tag if one.tag in _SECTIONS else ""
        stack += [(inner_section, child, copies) for child in reversed(one.children)]


# --- limits of elements ---------------------------------------------------------------------------

#: Most numbers that MuJoCo stores for an element: points of a height field, pixels of a texture.
_MAX_STORED_NUMBERS = 2**24
#: Elements that create copies of their content.
_COPYING_TAGS = ("replicate", "composite", "flexcomp")
#: Keys whose product is the size of an element.
_SIZE_KEYS = {"hfield": ("nrow", "ncol"), "texture": ("width", "height")}


def _check_element(element: Element) -> None:
    """Reject tags in capitals, some of which MuJoCo misreads, and too large elements.

    Raises SceneError.
    """
    if element.tag != element.tag.lower():
        raise SceneError(
            f"{element.where}: unknown element <{element.tag}>; write <{element.tag.lower()}>"
        )
    size = prod(_whole_numbers(element, key, 1)[0] for key in _SIZE_KEYS.get(element.tag, ()))
    if size > _MAX_STORED_NUMBERS:
        raise SceneError(
            f"{element.where}: <{element.tag}>: expected at most {_MAX_STORED_NUMBERS} numbers, "
            f"found {size}; make it coarser, or leave it out"
        )


def _count_copies(element: Element) -> int:
    """Number of copies of the content that an element creates."""
    return prod(_whole_numbers(element, "count", 3)) if element.tag in _COPYING_TAGS else 1


def _whole_numbers(element: Element, key: str, most: int) -> list[int]:
    """Whole numbers of an attribute, at least 1; MuJoCo reports invalid text."""
    values = []
    for number_text in element.attributes.get(key, "").split()[:most]:
        try:
            values.append(max(1, int(float(number_text))))
        except (ValueError, OverflowError):
            values.append(1)
    return values or [1]
