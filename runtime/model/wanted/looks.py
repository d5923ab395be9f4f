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

#: First tolerance in what is wanted, and its bounds for explicit and for implicit methods.
_FIRST, _BOUNDS, _BOUNDS_IMPLICIT = 100.0, (1e-10, 5e-4), (1e-4, 3e-3)

#: The second tolerance is to make what local errors sum up to this times what is wanted; where they
#: are not known, the error is taken for so many times the tolerance, for implicit methods at least.
_SUMMED, _UNKNOWN, _IMPLICIT_GROWTH = 0.5, 30.0, 5.0

#: The tolerance in what is wanted with which an explicit method follows an implicit one.
_FRESH = 1 / 20

#: The error is this many times what the power makes of the distance.
_SAFETY = 1.5

#: The part of an observed power that is trusted; powers of explicit runs scatter about the first by
#: chance: one above the second number here counts as the third at least.
_TRUSTED, _NOISE, _SURE = 0.9, 0.5, 0.75

#: Powers of the tolerance by which errors fall: of explicit methods, of implicit ones (less where
#: two runs are all there is), from an implicit to an explicit run, and where they hardly fall.
_EXPLICIT, _IMPLICIT, _BLIND, _CHANGED, _HARDLY = 0.9, 0.65, 0.6, 0.8, 0.25

#: A next tolerance aims at this part of what is wanted; its bounds in the one before, the lower one
#: for implicit methods another.
_AIM, _LEAST, _LEAST_IMPLICIT, _MOST = 0.8, 1e-4, 3e-3, 0.25

#: A looser tolerance, in the tightest one, whose run tells the error of that one.
_COMPANION = 50.0

#: Runs that differ by more (in the size of the motion) tell nothing of the power; the next
#: tolerance is so much tighter.
_PARTED, _LEAP = 0.3, 1e-3

#: Errors of implicit methods may stay for a while above this tolerance, as long as vibrations are
#: not resolved.
_SLOW = 1e-7

#: Most runs.
RUNS = 6


@dataclass(frozen=True)
class Look:
    """One run as the search sees it.

    Attributes:
        rtol: its relative tolerance.
        explicit: made by an explicit method alone.
        apart: how far it is from the tightest run; 0 for that one, inf where they end elsewhere.
        summed: its local errors added up; None where the method keeps none.
    """

    rtol: float
    explicit: bool
    apart: float
    summed: float | None


def first_rtol(asked: float, explicit: bool) -> float:
    """The first tolerance: loose, for it is there to look."""
    tightest, loosest = _BOUNDS if explicit else _BOUNDS_IMPLICIT
    return max(min(_FIRST * asked, loosest), tightest)


def estimate(looks: Sequence[Look]) -> float | None:
    """Error of the last of `looks`, which come loose to tight, explicit ones behind others; None
    for one alone."""
    if len(looks) < 2:
        return None
    before, last = looks[-2:]
    fallen = (last.rtol / before.rtol) ** _power(looks) if last.rtol < before.rtol else 1.0
    return _SAFETY * before.apart * fallen


def next_rtol(looks: Sequence[Look], asked: float, explicit: bool) -> float:
    """Tolerance of the next run, for an error `asked` in the size of the motion (1 for angles and
    parts); `explicit` says by which kind of method it is made."""
    last, known = looks[-1], estimate(looks)
    if explicit and not last.explicit:
        return fresh_rtol(asked)
    if known is None:
        factor = asked / last.rtol / _growth(last)
    elif last.explicit and not looks[-2].explicit:
        return min(_COMPANION * last.rtol, _BOUNDS[1])
    elif not known < _PARTED:
        factor = _LEAP
    else:
        factor = (_AIM * asked / known) ** (1 / _usual(looks))
    least = _LEAST if last.explicit else _LEAST_IMPLICIT
    return max(last.rtol * min(max(factor, least), _MOST), TIGHTEST)


def fresh_rtol(asked: float) -> float:
    """Tolerance of an explicit run that follows an implicit one."""
    return max(_FRESH * asked, TIGHTEST)


def hopeless(looks: Sequence[Look]) -> str:
    """Why a further run would lead nowhere; "" if it may."""
    stays = len(looks) > 3 and not _falls(looks) and not _falls(looks[:-1])
    if stays and looks[-2].apart < _PARTED and (looks[-1].explicit or looks[-1].rtol < _SLOW):
        return (
            "the error falls no more with the tolerance (rounding, or jumps of forces at which no "
            "step ends)"
        )
    if looks[-1].rtol <= TIGHTEST:
        return f"no tolerance below {TIGHTEST:.0e} has a meaning in these numbers"
    return f"{RUNS} runs did not get there" if len(looks) >= RUNS else ""


def _growth(look: Look) -> float:
    """What the error of a run is in its tolerance, about, by its local errors."""
    least = 0.0 if look.explicit else _IMPLICIT_GROWTH
    known = _UNKNOWN if not look.summed else look.summed / look.rtol / _SUMMED
    return max(known, least)


def _usual(looks: Sequence[Look]) -> float:
    """The power by which errors usually fall from the last run but one to the last."""
    before, last = looks[-2:]
    if before.explicit != last.explicit:
        return _CHANGED
    return _EXPLICIT if last.explicit else _IMPLICIT


def _power(looks: Sequence[Look]) -> float:
    """The power by which the error of the last run is believed to have fallen."""
    seen, usual = _seen(looks), _usual(looks)
    if seen is None and looks[-1].rtol < _ROUNDING:
        return _HARDLY
    if seen is None:
        return min(usual, _BLIND) if usual == _IMPLICIT else usual
    if looks[-1].explicit and seen > _NOISE:
        return min(max(seen, _SURE), _EXPLICIT)
    return min(max(_TRUSTED * seen, _HARDLY), _EXPLICIT)


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
    if a.apart > _PARTED:
        return None if b.apart < _PARTED else 0.0
    return math.log(a.apart / b.apart) / math.log(a.rtol / b.rtol)
