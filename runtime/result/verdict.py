"""Verdict on a run: its certificate in one sentence."""

from __future__ import annotations

import re
from dataclasses import dataclass

from ..run.error_estimate import ANGLE

#: Relative drift of energy or momentum up to which a run is trusted unless other bounds are asked.
DEFAULT_DRIFT = 1e-5

#: Error up to which a run is trusted: rad of an angle, part of the motion of other coordinates.
DEFAULT_ACCURACY = ANGLE


@dataclass(frozen=True)
class Verdict:
    """Verdict on a result within given bounds.

    Attributes:
        against: what speaks against them, one sentence each.
        missing: what nobody has looked at.
        bounds: what was asked for, in words.
    """

    against: tuple[str, ...]
    missing: tuple[str, ...]
    bounds: str

    @property
    def trusted(self) -> bool:
        """Whether everything was checked and there is no objection."""
        return not self.against and not self.missing

    def __str__(self) -> str:
        if self.against:
            other_count = len(self.against) - 1
            others = f" (and {other_count} more, see below)" if other_count else ""
            return f"NOT trusted: {_first_clause(self.against[0])}{others}"
        if self.missing:
            return f"not judged: {'; '.join(self.missing)}; nothing seen speaks against it"
        return f"trusted: {self.bounds}, and no model left its range"


def _first_clause(sentence: str) -> str:
    return re.split(r";|(?<=\)): |: split ", sentence)[0]
