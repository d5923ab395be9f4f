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

#: The tightest tolerance that has a meaning.
TIGHTEST = 1e-13

#: Below this tolerance rounding may be what is seen: two runs alone do not show errors falling.
_ROUNDING = 5e-12


@dataclass(frozen=True)
class _Kind:
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


_EXPLICIT = _Kind((3.0, 3e-4, 3e-3), 3e3, 1.0, 0.3, 0.9, 1.0, 0.5, 1e-7)
_IMPLICIT = _Kind((100.0, 1e-3, 1e-1), 1e6, 1.0, 1.0, 0.8, 1.0, 0.1, 1e-6)

#: The power of the tolerance by which the sum of local errors falls.
_SUMMED = 0.9

#: Where local errors are not known, their sum is taken for so many times the tolerance.
_UNKNOWN = 15.0

#: The part of an observed power that is trusted; powers of explicit runs scatter about the first by
#: chance: one above the second number here counts as the third at least.
_TRUSTED, _NOISE, _SURE = 0.9, 0.5, 0.75

#: Powers from an implicit to an explicit run, with stops, and where errors hardly fall.
_CHANGED, _ROUGH, _HARDLY = 0.8, 0.8, 0.25

#: A next tolerance aims at this part of what is wanted; it is at most this part of the one before.
_AIM, _MOST = 0.7, 0.3

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
        explicit: made by an explicit method alone.
        apart: how far it is from the tightest run; 0 for that one, inf where they end elsewhere.
        summed: its local errors added up; None where the method keeps none.
        held: stability, not accuracy, set many of its steps.
        rough: its scene has stops, at which local errors are those of no smooth motion.
    """

    rtol: float
    explicit: bool
    apart: float
    summed: float | None
    held: bool = False
    rough: bool = False


def first_rtol(asked: float, explicit: bool) -> float:
    """The first tolerance: loose, for it is there to look."""
    kind = _kind(explicit)
    times, tightest, loosest = kind.first
    wanted = min(max(times * asked, tightest), loosest)
    return max(min(wanted, kind.reach * asked), TIGHTEST)


def estimate(looks: Sequence[Look]) -> float | None:
    """Error of the last of `looks`, which come loose to tight, explicit ones behind others; None
    for one alone."""
    if len(looks) < 2:
        return None
    before, last = looks[-2:]
    fallen = (last.rtol / before.rtol) ** _power(looks) if last.rtol < before.rtol else 1.0
    kind = _kind(last.explicit)
    return kind.safety * before.apart * (1.0 if before.apart >= kind.parted else fallen)


def next_rtol(looks: Sequence[Look], asked: float, explicit: bool) -> float:
    """Tolerance of the next run, for an error `asked` in the size of the motion (1 for angles and
    parts); `explicit` says by which kind of method it is made."""
    last, known = looks[-1], estimate(looks)
    if explicit != last.explicit:
        return first_rtol(asked, explicit)
    if known is None or looks[-2].explicit != explicit:
        factor = (asked / _summed(last)) ** (1 / _SUMMED)
    elif not looks[-2].apart < _kind(explicit).parted:
        factor = _LEAP
    else:
        factor = (_AIM * asked / known) ** (1 / _usual(last))
    least = _kind(explicit).least
    return max(last.rtol * min(max(factor, least), _MOST), TIGHTEST)


def hopeless(looks: Sequence[Look]) -> str:
    """Why a further run would lead nowhere; "" if it may."""
    stays = len(looks) > 3 and not _falls(looks) and not _falls(looks[:-1])
    stays = stays and looks[-2].apart < _EXPLICIT.parted
    if stays and (looks[-1].explicit or looks[-1].rtol < _SLOW):
        return (
            "the error falls no more with the tolerance (rounding, or jumps of forces at which no "
            "step ends)"
        )
    if looks[-1].rtol < 2 * TIGHTEST:  # runs at nearly the same tolerance tell nothing
        return f"no tolerance below {TIGHTEST:.0e} has a meaning in these numbers"
    return f"{RUNS} runs did not get there" if len(looks) >= RUNS else ""


def _kind(explicit: bool) -> _Kind:
    return _EXPLICIT if explicit else _IMPLICIT


def _summed(look: Look) -> float:
    """What the error of a run is by its local errors, about."""
    kind = _kind(look.explicit)
    known = look.summed or _UNKNOWN * look.rtol
    return known * (kind.held if look.held else kind.growth)


def _usual(look: Look) -> float:
    """The power by which errors usually fall to a run from a looser one of its kind."""
    power = _kind(look.explicit).power
    return min(power, _ROUGH) if look.rough else power


def _power(looks: Sequence[Look]) -> float:
    """The power by which the error of the last run is believed to have fallen."""
    before, last = looks[-2:]
    changed = before.explicit != last.explicit
    seen, usual = _seen(looks), _CHANGED if changed else _usual(last)
    if seen is None:
        return _HARDLY if last.rtol < _ROUNDING else usual
    if last.explicit and seen > _NOISE:
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
    if a.explicit != b.explicit or b.explicit != last.explicit:
        return None
    if not 0 < b.apart < math.inf or not 0 < a.apart < math.inf:
        return None
    parted = _kind(last.explicit).parted
    if a.apart > parted:
        return None if b.apart < parted else 0.0
    return math.log(a.apart / b.apart) / math.log(a.rtol / b.rtol)
