"""Names of a file -> names of a scene."""

from __future__ import annotations

import re

from ..rules.values import GROUND

_OTHER = re.compile("[^A-Za-z0-9_]+")
_LONGEST = 60


class Names:
    """Gives every name of the file one of its own that a scene takes."""

    def __init__(self) -> None:
        self._taken = {GROUND}

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
