"""The files that an MJCF file is made of, looked at before MuJoCo reads them."""

from __future__ import annotations

import stat
from collections.abc import Iterator
from pathlib import Path

from ...arguments import short
from ...errors import SceneError
from ..files.read import content_of
from .markup import Element, parsed

#: Elements inside each other: bodies are, a long chain of them too.
_DEEPEST = 2000
#: Files of one model, and the largest of them in MB.
_MOST, _LARGEST = 200, 16
#: What names another file of MJCF.
_NAMING = ("include", "model")

#: Sections whose elements have names of their own kind, whatever their tags.
_SECTIONS = ("equality", "tendon", "contact", "actuator", "sensor")

#: (section of these or else tag, name) -> where it is.
Places = dict[tuple[str, str], str]


def looked_through(content: bytes, path: Path, where: str) -> Places:
    """Where the elements with names are, in the file and in those that it includes.

    Raises SceneError for document types and entities, for text that is no XML, and for files that
    are not in the folder of the model or below it.
    """
    folder, found = path.parent.resolve(), Places()
    waiting, seen = [(content, path, where)], {path.resolve()}
    while waiting:
        content, path, where = waiting.pop()
        for section, one in _all(parsed(content, where, _DEEPEST)):
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
                    waiting.append((inside, other, shown))
        if len(seen) > _MOST:
            raise SceneError(f"{where}: the model has more than {_MOST} files")
    return found


def _others(one: Element, folder: Path, beside: Path) -> Iterator[Path]:
    """The files that an element may mean: from the folder of the model, and from that of its own
    file; those that are there.  MuJoCo takes a backslash for a slash."""
    name = one.attributes["file"]
    if not name.strip():
        raise _refused(one, "expected the name of a file")
    names = dict.fromkeys((name, name.replace("\\", "/")))
    for start in dict.fromkeys((folder, beside)):
        for each in names:
            try:
                other = (start / each).resolve()
                mode = other.stat().st_mode if other.is_relative_to(folder) else None
            except (FileNotFoundError, NotADirectoryError):
                continue
            except (OSError, RuntimeError, ValueError) as error:  # names too long, rings of links
                why = getattr(error, "strerror", None) or "links to itself"
                raise _refused(one, f"cannot be read: {why}") from None
            if mode is None:
                raise _refused(
                    one, "expected a file in the folder of the model or below it; copy it there"
                )
            if not stat.S_ISREG(mode):
                raise _refused(one, "this is not a regular file; name one")
            yield other


def _refused(one: Element, why: str) -> SceneError:
    return SceneError(f"{one.where}: <{one.tag}> file {short(one.attributes['file'])}: {why}")


def _all(one: Element) -> Iterator[tuple[str, Element]]:
    """The element and all that is inside, each with its section if that is one of `_SECTIONS`."""
    left = [("", one)]
    while left:
        section, one = left.pop()
        yield section, one
        inside = one.tag if one.tag in _SECTIONS else ""
        left += [(inside, child) for child in reversed(one.children)]
