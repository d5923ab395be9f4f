"""The verdict on a run: may its numbers be used?  What a certificate holds, in one sentence."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from .error_estimate import ANGLE, ErrorEstimate

if TYPE_CHECKING:
    from .certificate import Certificate

#: Relative drift of energy or momentum up to which a run is trusted unless other bounds are asked.
DRIFT = 1e-5

#: Error up to which a run is trusted: rad of an angle, part of the motion of other coordinates.
ACCURACY = ANGLE


@dataclass(frozen=True)
class Verdict:
    """May the numbers of a run be used, within the bounds that were asked for?

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
        """True only where everything was looked at and nothing speaks against the run."""
        return not self.against and not self.missing

    def __str__(self) -> str:
        if self.against:
            more = len(self.against) - 1
            others = f" (and {more} more, see below)" if more else ""
            return f"NOT trusted: {_first_clause(self.against[0])}{others}"
        if self.missing:
            return f"not judged: {'; '.join(self.missing)}; nothing seen speaks against it"
        return f"trusted: {self.bounds}, and no model left its range"


def _first_clause(sentence: str) -> str:
    return re.split(r";|(?<=\)): |: split ", sentence)[0]


def verdict(c: Certificate, accuracy: float, balance: float) -> Verdict:
    """The verdict within bounds: `accuracy` of the error in rad, of coordinates that are no angles
    as a part of how far they went; `balance` of energy and momentum, relative."""
    against = list(c.failures) + [
        f"{d.name} changes by {d}, more than the {balance:g} asked for"
        for d in (c.energy, *c.momentum)
        if balance < d.relative <= DRIFT
    ]
    missing = []
    if c.samples < 2:
        missing.append("one sample tells nothing of energy and momentum")
    if c.error is None:
        missing.append("no second run has told its error (certify=True)")
    else:
        against += _inaccurate(c, accuracy)
    against += c.doubts
    words = f"{accuracy:g} rad or {accuracy:.3g} of the motion"
    return Verdict(
        tuple(dict.fromkeys(against)), tuple(missing),
        f"errors within {words}, balances within {balance:g}",
    )  # fmt: skip


def _inaccurate(c: Certificate, accuracy: float) -> list[str]:
    """Units of coordinates whose estimated error, over the whole run, exceeds what was asked."""
    assert c.error is not None
    found = []
    for unit, values in c.error.q.items():
        worst = float(values.max(initial=0.0))
        limit = accuracy if unit == "rad" else accuracy * c.error.moved.get(unit, 0.0)
        if worst > limit > 0:
            part = "" if unit == "rad" else f" of {c.error.moved[unit]:.2g} {unit} of motion"
            found.append(f"the error of q may be {worst:.1e} {unit or '1'}{part}{_until(c.error)}")
    return found


def _until(error: ErrorEstimate) -> str:
    return "" if error.horizon is None else f" (predictable until {error.horizon:.4g} s)"
