"""Names of a file -> names of a scene."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Container, Iterable, Mapping

from ..rules.values import GROUND
from ..tables.outside.names import is_name

_OTHER, _TAKEN = re.compile("[^A-Za-z0-9_]+"), re.compile("[A-Za-z][A-Za-z0-9_]*")
_LONGEST = 60


class Names:
    """Gives every name of the file one of its own that a scene takes."""

    def __init__(self) -> None:
        self._taken = {GROUND}

    def take_all(
        self, names: Iterable[str], instead: str, others: Iterable[str] = ()
    ) -> dict[str, str]:
        """The same of several, by the names of the file; those that a scene takes stay, and none
        becomes one of `others`."""
        waiting, found = list(names), dict[str, str]()
        for stays in (True, False):
            some = [name for name in waiting if _stays(name) == stays]
            found |= {name: self.take(name, instead) for name in some}
            self._taken.update(others)
        return {name: found[name] for name in waiting}

    def take(self, name: str, instead: str) -> str:
        """The name with _ for what a scene has not in names; `instead` is put before what does not
        begin with a letter."""
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
    """What a scene keeps of the names of a file as its `[names]`: those of links and joints that
    have others in it.  Where several links are one body, the first of them is its name.

    `references` are those that the scene has itself, of bodies and ends.
    """
    shared = {one for one, count in Counter(links.values()).items() if count > 1}
    bodies = {
        name: one for name, one in links.items()
        if is_name(name) and (one in shared if name == one else name not in references)
    }  # fmt: skip
    hinges = {name: one for name, one in joints.items() if is_name(name) and name != one}
    found = {"body": bodies, "hinge": hinges}
    return {table: known for table, known in found.items() if known}
