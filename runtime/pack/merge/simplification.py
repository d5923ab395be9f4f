"""What is packed otherwise than a scene says it, without changing what it does."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from mstmm.errors import SceneError

#: Rigid bodies on fixed hinges are packed as one.
WELDS = "welds"

#: Kind -> what is counted of it, one and many, and what becomes of them.
COUNTED = {WELDS: ("body", "bodies", "on fixed hinges packed as part of what holds them")}
#: All that can be asked for.
ALL = tuple(COUNTED)


@dataclass(frozen=True)
class Simplification:
    """One thing that is packed otherwise.

    Attributes:
        kind: the word that switches it on: "welds".
        elements: names of the hinges and bodies concerned.
        text: what was done, and why.
    """

    kind: str
    elements: tuple[str, ...]
    text: str

    def __str__(self) -> str:
        return self.text


def asked_for(simplify: bool | Collection[str]) -> tuple[str, ...]:
    """The words that an option means; SceneError for others."""
    if isinstance(simplify, bool):
        return ALL if simplify else ()
    words = (simplify,) if isinstance(simplify, str) else tuple(simplify)
    for word in words:
        if word not in ALL:
            raise SceneError(
                f"simplify: {word!r} is not known; expected True, False, or some of: "
                + ", ".join(ALL)
            )
    return words
