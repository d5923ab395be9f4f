"""Simplifications: changes of a scene at compilation that do not change its motion."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from mstmm.argument_validation import abbreviate, require_texts
from mstmm.array_validation import finite_float
from mstmm.errors import SceneError

#: Kinds: rigid bodies on fixed hinges are merged; orientations near right angles become exact;
#: bodies on hinges that move about or along one axis, or rotate about a point, are swept as links.
WELDS, TURNS, LINKS = "welds", "turns", "links"

#: Kind -> singular, plural and description, for the kinds that are reported to users.
COUNT_TEXTS = {
    WELDS: ("body", "bodies", "on fixed hinges merged into their inboard body"),
    TURNS: ("orientation", "orientations", "within a tolerance of right angles replaced by these"),
}
#: Kind -> whether it is done, or up to which tolerance.
SimplifyOptions = Mapping[str, bool | float]
#: Default simplifications, and the default of each kind.  The tolerance (rad) admits right angles
#: written as 1.57079632679, which are off by 4.9e-12, and sums of two.  Numbers with fewer digits
#: (1.570796327: 2e-10 off, 1.5708: 4e-6) change results by more than rounding, so that a larger
#: tolerance must be requested.
USUAL: SimplifyOptions = {WELDS: True, TURNS: 1e-11, LINKS: True}
LINKED: SimplifyOptions = {LINKS: True}
NO_SIMPLIFICATION: SimplifyOptions = {}
#: Largest tolerance, rad.
_MAX_TOLERANCE = 0.01


@dataclass(frozen=True)
class Simplification:
    """Simplification of one part of a scene.

    Attributes:
        kind: "welds", "turns" or "links".
        elements: names of the hinges, bodies and ends concerned.
        text: description and reason.
    """

    kind: str
    elements: tuple[str, ...]
    text: str

    def __str__(self) -> str:
        return self.text


def parse_simplify(simplify: bool | Collection[str] | SimplifyOptions) -> SimplifyOptions:
    """Parse the option `simplify`; kinds that a table does not name keep their defaults.

    Raises SceneError for unknown kinds and invalid values.
    """
    if isinstance(simplify, bool):
        return USUAL if simplify else NO_SIMPLIFICATION
    kinds = require_texts("simplify", list(simplify) if isinstance(simplify, Mapping) else simplify,
                     "welds")  # fmt: skip
    for kind in kinds:
        if kind not in USUAL:
            raise SceneError(
                f"simplify: expected True, False, or some of {', '.join(USUAL)}; found {kind!r:.60}"
            )
    if not isinstance(simplify, Mapping):
        return {kind: USUAL[kind] for kind in kinds}
    for kind in (WELDS, LINKS):
        _check_switch(kind, simplify.get(kind, True))
    options = {kind: USUAL[kind] if value is True else value for kind, value in simplify.items()}
    options = {**USUAL, **options}
    turns = finite_float("simplify: turns", options.get(TURNS) or 0.0)
    if not 0 <= turns <= _MAX_TOLERANCE:
        raise SceneError(
            f"simplify: turns = {turns!r}: expected an angle from 0 to {_MAX_TOLERANCE} rad, or "
            f"True for {USUAL[TURNS]:g}"
        )
    return {kind: value for kind, value in options.items() if value}


def _check_switch(kind: str, value: object) -> None:
    """Raise SceneError unless a value is a boolean."""
    if not (isinstance(value, bool | int | np.bool_) and value in (0, 1)):
        raise SceneError(f"simplify: {kind}: expected True or False, found {abbreviate(value)}")
