"""What is packed otherwise than a scene says it, without changing what it does."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from mstmm.argument_validation import abbreviate, require_texts
from mstmm.array_validation import finite_float
from mstmm.errors import SceneError

#: Rigid bodies on fixed hinges are packed as one; orientations near quarter turns are exact; bodies
#: behind hinges that move about and along one axis, or turn about a point, are swept as links.
WELDS, TURNS, LINKS = "welds", "turns", "links"

#: Kind -> what is counted of it, one and many, and what becomes of them: what a user may wonder at.
COUNTED = {
    WELDS: ("body", "bodies", "on fixed hinges packed as part of what holds them"),
    TURNS: ("orientation", "orientations", "within a tolerance of quarter turns taken as these"),
}
#: Word -> whether it is done, or up to which tolerance.
Words = Mapping[str, bool | float]
#: What is done where nothing is asked, and what a word means by itself.  Orientations may be off by
#: so many rad: files write quarter turns as 1.57079632679, which is off by 4.9e-12, and two such
#: angles add up.  Numbers of fewer digits (1.570796327: 2e-10 off, 1.5708: 4e-6) change results by
#: more than rounding does, so that a larger tolerance has to be asked for.
USUAL: Words = {WELDS: True, TURNS: 1e-11, LINKS: True}
LINKED: Words = {LINKS: True}
NOTHING: Words = {}
#: The largest tolerance, rad.
_MOST = 0.01


@dataclass(frozen=True)
class Simplification:
    """One thing that is packed otherwise.

    Attributes:
        kind: the word that switches it on: "welds", "turns" or "links".
        elements: names of the hinges, bodies and ends concerned.
        text: what was done, and why.
    """

    kind: str
    elements: tuple[str, ...]
    text: str

    def __str__(self) -> str:
        return self.text


def parse_simplify(simplify: bool | Collection[str] | Words) -> Words:
    """The words that an option means, others as usual where it is a table; SceneError for words
    that are not known."""
    if isinstance(simplify, bool):
        return USUAL if simplify else NOTHING
    words = require_texts("simplify", list(simplify) if isinstance(simplify, Mapping) else simplify,
                     "welds")  # fmt: skip
    for word in words:
        if word not in USUAL:
            raise SceneError(
                f"simplify: {word!r:.60} is not known; expected True, False, or some of: "
                + ", ".join(USUAL)
            )
    if not isinstance(simplify, Mapping):
        return {word: USUAL[word] for word in words}
    for word in (WELDS, LINKS):
        _check_switch(word, simplify.get(word, True))
    found = {word: USUAL[word] if given is True else given for word, given in simplify.items()}
    found = {**USUAL, **found}
    turns = finite_float("simplify: turns", found.get(TURNS) or 0.0)
    if not 0 <= turns <= _MOST:
        raise SceneError(
            f"simplify: turns = {turns!r}: expected an angle from 0 to {_MOST} rad, or True for "
            f"{USUAL[TURNS]:g}"
        )
    return {word: given for word, given in found.items() if given}


def _check_switch(word: str, given: object) -> None:
    if not (isinstance(given, bool | int | np.bool_) and given in (0, 1)):
        raise SceneError(f"simplify: {word}: expected True or False, found {abbreviate(given)}")
