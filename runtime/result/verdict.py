"""Verdict on a run: its certificate in one sentence."""

from __future__ import annotations

import re
from dataclasses import dataclass

from ..run.error_estimate import ANGLE

#: Default limit of the relative drift of energy or momentum of a trusted run.
DEFAULT_DRIFT = 1e-5

#: Default limit of the error: rad of an angle, relative to the motion of other coordinates.
DEFAULT_ACCURACY = ANGLE


@dataclass(frozen=True)
class Verdict:
    """Verdict on a result within given bounds.

    Attributes:
        objections: objections, one sentence each.
        unchecked: what was not checked.
        bounds: the requested bounds, in words.
    """

    objections: tuple[str, ...]
    unchecked: tuple[str, ...]
    bounds: str

    @property
    def trusted(self) -> bool:
        """Whether everything was checked and there is no objection."""
        return not self.objections and not self.unchecked

    def __str__(self) -> str:
        if self.objections:
            other_count = len(self.objections) - 1
            remainder = f" (and {other_count} more, see below)" if other_count else ""
            return f"NOT trusted: {_first_clause(self.objections[0])}{remainder}"
        if self.unchecked:
            return f"not verified: {'; '.join(self.unchecked)}; no check objects"
        return f"trusted: {self.bounds}, all models within their validity range"


def _first_clause(sentence: str) -> str:
    return re.split(r";|(?<=\)): |: split ", sentence)[0]
