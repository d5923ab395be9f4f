"""What several runs at different tolerances tell of their errors, and of the one to make next.

The run at the tightest tolerance stands for the truth: how far the others are from it is about
their error.  Its own error is that of the next looser one, less by a power of the tolerance, about
the first for explicit methods (local errors are held to it) and less for implicit ones of stiff
motion.  Of a power that was observed no more than the usual one is believed.

Hairer, Norsett, Wanner, Solving ODEs I, II.4 (tolerance and global error).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

#: The tightest tolerance that has a meaning.
TIGHTEST = 1e-13

#: Below this tolerance rounding may be what is seen: two runs alone do not show errors falling.
_ROUNDING = 5e-12


class Kind(Enum):
    """Of a method: what sets its steps, and how its error falls with the tolerance."""

    EXPLICIT = "explicit"
    IMPLICIT = "implicit"
    EXPONENTIAL = "exponential"


@dataclass(frozen=True)
class _Usual:
    """What is taken for usual of a kind of method.

    Attributes:
        first: the first tolerance in what is wanted, and its bounds.
        reach: the first tolerance is at most so many times what is wanted.
        growth, held: the error in what local errors sum up to; and where stability sets the steps,
            for then local errors are those of fast motion, which hardly add up.
        power: of the tolerance by which errors fall.
        safety: the error in what the power makes of the distance.
        parted: runs that differ by more (in the size of the motion) tell nothing of the power.
        least: of a next tolerance in the one before.
    """

    first: tuple[float, float, float]
    reach: float
    growth: float
    held: float
    power: float
    safety: float
    parted: float
    least: float


_USUAL = {
    Kind.EXPLICIT: _Usual((3.0, 3e-4, 1e-3), 2.5e3, 3.0, 0.3, 0.9, 1.5, 0.5, 1e-7),
    Kind.IMPLICIT: _Usual((100.0, 1e-4, 3e-2), 1e6, 1.0, 1.0, 0.8, 1.0, 0.1, 1e-6),
    Kind.EXPONENTIAL: _Usual((30.0, 1e-4, 1e-2), 1e6, 1.0, 1.0, 0.6, 1.0, 0.1, 1e-4),
}

#: The power of the tolerance by which the sum of local errors falls.
_SUMMED = 0.9

#: Where local errors are not known, their sum is taken for so many times the tolerance.
_UNKNOWN = 15.0

#: The part of an observed power that is trusted; powers of explicit runs scatter about the first by
#: chance: one above the second number here counts as the third at least.
_TRUSTED, _NOISE, _SURE = 0.9, 0.5, 0.75

#: Powers between explicit and implicit runs, with stops, and where errors hardly fall; steps of the
#: exponential method tell nothing of others.
_CHANGED, _ROUGH, _HARDLY = 0.8, 0.8, 0.25

#: A next tolerance aims at this part of what is wanted: by local errors of explicit steps, by those
#: of others, and once runs have been compared.  A run more costs more than tighter steps of high
#: order.
_FORETOLD, _OTHERS, _AIM = 0.4, 1.0, 0.3

#: A next tolerance is at most this part of the one before: of the first one, and of later ones.
_MOST, _LATER = 0.3, 0.1

#: The first explicit tolerance behind an implicit run is at least this part of the usual first one.
_FOLLOWING = 1e-3

#: The next tolerance in the one before, where runs have parted.
_LEAP = 1e-2

#: Errors of implicit methods may stay for a while above this tolerance, as long as vibrations are
#: not resolved.
_SLOW = 1e-7

#: Most runs.
RUNS = 8


@dataclass(frozen=True)
class Look:
    """One run as the search sees it.

    Attributes:
        rtol: its relative tolerance.
        kind: of its method; of several, explicit if all are.
        apart: how far it is from the tightest run; 0 for that one, inf where they end elsewhere.
        summed: its local errors added up; None where the method keeps none.
        held: stability, not accuracy, set many of its steps.
        rough: its scene has stops, at which local errors are those of no smooth motion.
    """

    rtol: float
    kind: Kind
    apart: float
    summed: float | None
    held: bool = False
    rough: bool = False


def first_rtol(asked: float, kind: Kind) -> float:
    """The first tolerance: loose, for it is there to look."""
    times, tightest, loosest = _USUAL[kind].first
    wanted = min(max(times * asked, tightest), loosest)
    return max(min(wanted, _USUAL[kind].reach * asked), TIGHTEST)


def estimate(looks: Sequence[Look]) -> float | None:
    """Error of the last of `looks`, which come loose to tight, explicit ones behind others; None
    for one alone."""
    if len(looks) < 2:
        return None
    before, last = looks[-2:]
    fallen = (last.rtol / before.rtol) ** _power(looks) if last.rtol < before.rtol else 1.0
    usual = _USUAL[last.kind]
    return usual.safety * before.apart * (1.0 if before.apart >= usual.parted else fallen)


def next_rtol(looks: Sequence[Look], asked: float, kind: Kind) -> float:
    """Tolerance of the next run, for an error `asked` in the size of the motion (1 for angles and
    parts); `kind` is that of the method by which it is made."""
    last, known, tightest, most = looks[-1], estimate(looks), TIGHTEST, _LATER
    if kind is not last.kind:
        return _changed(last, known, asked, kind)
    if known is None or looks[-2].kind is not kind:
        factor, tightest = _foretold(last, asked), min(_ROUNDING, last.rtol / 2)
        most = _MOST
    elif not looks[-2].apart < _USUAL[kind].parted:
        factor = _LEAP
    else:
        factor = (_AIM * asked / known) ** (1 / _usual(last))
    return max(last.rtol * min(max(factor, _USUAL[kind].least), most), tightest)


def _foretold(last: Look, asked: float) -> float:
    """The next tolerance in the last one by what its local errors sum up to."""
    aim = _FORETOLD if last.kind is Kind.EXPLICIT else _OTHERS
    return float((aim * asked / _summed(last)) ** (1 / _SUMMED))


def _changed(last: Look, known: float | None, asked: float, kind: Kind) -> float:
    """The first tolerance of another kind: of an explicit one behind implicit runs one with which
    it is known by them, for stability sets its steps in any case."""
    first = first_rtol(asked, kind)
    if known is None or not (last.kind is Kind.IMPLICIT and kind is Kind.EXPLICIT):
        return first
    enough = last.rtol * (_AIM * asked / (_USUAL[kind].safety * known)) ** (1 / _CHANGED)
    return min(first, max(enough, _FOLLOWING * first, TIGHTEST))


def hopeless(looks: Sequence[Look]) -> str:
    """Why a further run would lead nowhere; "" if it may."""
    stays = len(looks) > 3 and not _falls(looks) and not _falls(looks[:-1])
    stays = stays and looks[-2].apart < _USUAL[Kind.EXPLICIT].parted
    if stays and (looks[-1].kind is Kind.EXPLICIT or looks[-1].rtol < _SLOW):
        return (
            "the error falls no more with the tolerance (rounding, or jumps of forces at which no "
            "step ends)"
        )
    if looks[-1].rtol < 2 * TIGHTEST:  # runs at nearly the same tolerance tell nothing
        return f"no tolerance below {TIGHTEST:.0e} has a meaning in these numbers"
    return f"{RUNS} runs did not get there" if len(looks) >= RUNS else ""


def _summed(look: Look) -> float:
    """What the error of a run is by its local errors, about."""
    usual = _USUAL[look.kind]
    known = look.summed or _UNKNOWN * look.rtol
    return known * (usual.held if look.held else usual.growth)


def _usual(look: Look) -> float:
    """The power by which errors usually fall to a run from a looser one of its kind."""
    power = _USUAL[look.kind].power
    return min(power, _ROUGH) if look.rough else power


def _power(looks: Sequence[Look]) -> float:
    """The power by which the error of the last run is believed to have fallen."""
    before, last = looks[-2:]
    seen, usual = _seen(looks), _usual(last)
    if before.kind is not last.kind:
        usual = 0.0 if before.kind is Kind.EXPONENTIAL else _CHANGED
    if seen is None:
        return _HARDLY if last.rtol < _ROUNDING else usual
    if last.kind is Kind.EXPLICIT and seen > _NOISE:
        return min(max(seen, _SURE), usual)
    return min(max(_TRUSTED * seen, _HARDLY), usual)


def _falls(looks: Sequence[Look]) -> bool:
    seen = _seen(looks)
    return seen is None or seen > _HARDLY


def _seen(looks: Sequence[Look]) -> float | None:
    """The power that the last three runs show; None where they show none."""
    if len(looks) < 3:
        return None
    a, b, last = looks[-3:]
    if not a.kind is b.kind is last.kind:
        return None
    if not 0 < b.apart < math.inf or not 0 < a.apart < math.inf:
        return None
    parted = _USUAL[last.kind].parted
    if a.apart > parted:
        return None if b.apart < parted else 0.0
    return math.log(a.apart / b.apart) / math.log(a.rtol / b.rtol)
