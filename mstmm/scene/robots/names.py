"""Mapping from names of a robot file to names of a scene."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Container, Iterable, Mapping

from ..rules.values import GROUND
from ..tables.outside.names import is_name

_OTHER, _TAKEN = re.compile("[^A-Za-z0-9_]+"), re.compile("[A-Za-z][A-Za-z0-9_]*")
_LONGEST = 60


class Names:
    """Registry that gives each name of a file a unique valid name in the scene."""

    def __init__(self) -> None:
        self._taken = {GROUND}

    def take_all(
        self, names: Iterable[str], instead: str, others: Iterable[str] = ()
    ) -> dict[str, str]:
        """Register several names: scene names by file names.

        Names that are valid in a scene are kept; no other name becomes one of `others`.
        """
        waiting, found = list(names), dict[str, str]()
        for stays in (True, False):
            some = [name for name in waiting if _stays(name) == stays]
            found |= {name: self.take(name, instead) for name in some}
            self._taken.update(others)
        return {name: found[name] for name in waiting}

    def take(self, name: str, instead: str) -> str:
        """Register a name: invalid characters become _, and the result is made unique.

        `instead` is the prefix of names that do not begin with a letter.
        """
        plain = _OTHER.sub("_", name).strip("_")[:_LONGEST]
        if not plain[:1].isalpha():
            plain = f"{instead}_{plain}".rstrip("_")
        found, count = plain, 1
        while found in self._taken:
            count += 1
            found = f"{plain}_{count}"
        self._taken.add(found)
        return found


def _stays(name: str) -> bool:
    return bool(_TAKEN.fullmatch(name)) and name != GROUND


def kept(
    links: Mapping[str, str], joints: Mapping[str, str], references: Container[str]
) -> dict[str, dict[str, str]]:
    """Table [names] of a scene: names of links and joints that are renamed in the scene.

    Where several links are one body, the first of them is the name of the body.  `references` are
    the bodies and ends of the scene.
    """
    shared = {one for one, count in Counter(links.values()).items() if count > 1}
    bodies = {
        name: one for name, one in links.items()
        if is_name(name) and (one in shared if name == one else name not in references)
    }  # fmt: skip
    hinges = {name: one for name, one in joints.items() if is_name(name) and name != one}
    found = {"body": bodies, "hinge": hinges}
    return {table: known for table, known in found.items() if known}
