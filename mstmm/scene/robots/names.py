"""Names of a file -> names of a scene."""

from __future__ import annotations

import re
from collections.abc import Iterable

from ..rules.values import GROUND

_OTHER, _TAKEN = re.compile("[^A-Za-z0-9_]+"), re.compile("[A-Za-z][A-Za-z0-9_]*")
_LONGEST = 60


class Names:
    """Gives every name of the file one of its own that a scene takes."""

    def __init__(self) -> None:
        self._taken = {GROUND}

    def take_all(self, names: Iterable[str], instead: str) -> dict[str, str]:
        """The same of several, by the names of the file; those that a scene takes stay."""
        waiting = list(names)
        first = sorted(waiting, key=lambda name: not _TAKEN.fullmatch(name))
        found = {name: self.take(name, instead) for name in first}
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
