"""What several runs at different tolerances tell of their errors, and of the one to make next.

The run at the tightest tolerance stands for the truth: how far the others are from it is about
their error.  Its own error is that of the next looser one, less by a power of the tolerance that
few runs fall short of, times a number that covers the scatter of single runs.  Of a power that was
observed no more than this one is believed, and of a run by another method less: its errors may be
larger at the same tolerance.  One estimate decides on whether another run is made, and is told.

Hairer, Norsett, Wanner, Solving ODEs I, II.4 (tolerance and global error).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from mstmm.array_validation import Array

#: The tightest tolerance that has a meaning.
TIGHTEST = 1e-13

#: From this tolerance down rounding may be what is seen: two runs alone do not show errors falling.
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
        summed: the same of what local errors sum up to.
        aim: what a next tolerance aims at by local errors, in what is wanted.
        safety: the error in what the power makes of the distance.
        parted: runs that differ by more (in the size of the motion) tell nothing of the power.
        least: of a next tolerance in the one before.
    """

    first: tuple[float, float, float]
    reach: float
    growth: float
    held: float
    power: float
    summed: float
    aim: float
    safety: float
    parted: float
    least: float


_USUAL = {
    Kind.EXPLICIT: _Usual((3.0, 3e-4, 1e-3), 2.5e3, 3.0, 0.3, 0.75, 1.0, 0.2, 2.0, 0.7, 3e-6),
    Kind.IMPLICIT: _Usual((30.0, 3e-5, 3e-2), 1e6, 1.0, 1.0, 0.6, 0.9, 0.6, 1.5, 0.1, 1e-6),
    Kind.EXPONENTIAL: _Usual((30.0, 1e-4, 1e-2), 1e6, 1.0, 1.0, 0.6, 0.6, 0.4, 1.5, 0.1, 1e-4),
}

#: Where local errors are not known, their sum is taken for so many times the tolerance.
_UNKNOWN = 15.0

#: The part of an observed power that is trusted; powers of explicit runs scatter by chance: one
#: above the second number here counts as the usual one.
_TRUSTED, _NOISE = 0.9, 0.5

#: Two runs alone may be near each other by chance: their distance counts so many times.
_TWO_ALONE = 2.0

#: Powers between runs by different methods, and where errors hardly fall; steps of the exponential
#: method tell nothing of others.
_CHANGED, _HARDLY = 0.5, 0.25

#: A next tolerance aims at this part of what is wanted once runs have been compared, by explicit
#: steps, and by others.  A run more costs more than tighter steps of high order.
_AIM, _AIM_OF_OTHERS = 0.5, 0.6

#: A next tolerance is at most this part of the one before: of the first one, and of later ones.
_MOST, _LATER = 0.3, 0.1

#: The first explicit tolerance behind runs of other kinds is at least this part of the usual first
#: one.
_FOLLOWING = 1e-4

#: The next tolerance in the one before, where runs have parted: at most, and at least.
_LEAP, _FAR_LEAP = 1e-1, 1e-2

#: The error in what local errors sum up to, a radian of vibration that is followed implicitly: its
#: phase goes on to err by what they change.
_WAVING = 0.25

#: Of runs that part behind this part of the time the growth of errors is known; the estimate in
#: what it makes of the tolerance.
_LATE, _DOUBT = 0.8, 10.0

#: The first implicit tolerance in what is asked, by radians of vibration that it has to follow.
_A_RADIAN = 10.0

#: The next tolerance in the one before, at least, of calm runs: where that is at most so many times
#: what is asked, and errors are not taken to fall; and beyond.
_CALM, _NEAR, _CALM_BEYOND = 0.1, 100.0, 3e-3

#: Errors may stay for a while above this tolerance: those of implicit methods as long as vibrations
#: are not resolved, and those of long explicit steps by chance.
_SLOW = 1e-7

#: Most runs.
RUNS = 8


@dataclass(frozen=True)
class ToleranceRun:
    """One run as the search sees it.

    Attributes:
        rtol: its relative tolerance.
        kind: of its method; of several, explicit if all are.
        method: its name.
        apart: how far it is from the tightest run; 0 for that one, inf where they end elsewhere.
        summed: its local errors added up; None where the method keeps none.
        held: stability, not accuracy, set many of its steps.
        growth: its error in what local errors sum up to, where more is known of it than is usual.
        radians: of vibration above what is asked that implicit steps have to follow.
        calm: explicit steps left vibration behind that is below it.
        parted: the part of the run after which it had left the tightest one; 1 if it never has.
    """

    rtol: float
    kind: Kind
    apart: float
    summed: float | None
    held: bool = False
    radians: float = 0.0
    calm: bool = False
    growth: float | None = None
    parted: float = 1.0
    method: str = ""

    def seen(self, way: Array) -> ToleranceRun:
        """With how far it is from the tightest one at each sample, (n,); empty: they end
        elsewhere."""
        if not len(way):
            return replace(self, apart=math.inf)
        gone = np.flatnonzero(~(way < _USUAL[self.kind].parted))
        parted = float(gone[0]) / max(len(way) - 1, 1) if len(gone) else 1.0
        return replace(self, apart=float(way.max()), parted=parted)


def first_rtol(asked: float, kind: Kind, radians: float = 0.0) -> float:
    """The first tolerance: loose, for it is there to look.  Implicit runs that have to follow so
    many radians of vibration tell nothing before they do."""
    times, tightest, loosest = _USUAL[kind].first
    wanted = min(max(times * asked, tightest), loosest)
    if kind is Kind.IMPLICIT and radians > 1.0:
        wanted = min(wanted, _A_RADIAN * asked / radians)
    return max(min(wanted, _USUAL[kind].reach * asked), TIGHTEST)


def estimate_error(looks: Sequence[ToleranceRun]) -> float | None:
    """Error of the last of `looks`, which come loose to tight, explicit ones behind others; None
    for one alone."""
    if len(looks) < 2:
        return None
    before, last = looks[-2:]
    fallen = (last.rtol / before.rtol) ** _power(looks) if last.rtol < before.rtol else 1.0
    usual = _USUAL[last.kind]
    known = usual.safety * before.apart * (_TWO_ALONE if len(looks) == 2 else 1.0)
    if before.apart < usual.parted:
        stays = last.calm and before.calm and last.rtol >= 0.99 * _CALM * before.rtol
        return known * (1.0 if stays else fallen)
    if before.kind is last.kind is Kind.EXPLICIT and _LATE <= before.parted < 1.0:
        return min(known, _DOUBT * last.rtol * _growth(before))
    return known


def next_rtol(looks: Sequence[ToleranceRun], asked: float, kind: Kind) -> float:
    """Tolerance of the next run, for an error `asked` in the size of the motion (1 for angles and
    parts); `kind` is that of the method by which it is made."""
    last, known, tightest, most = looks[-1], estimate_error(looks), TIGHTEST, _LATER
    if kind is not last.kind:
        return _changed(last, known, asked, kind)
    if known is None or (looks[-2].kind, looks[-2].method) != (kind, last.method):
        factor, tightest = _foretold(last, asked), min(_ROUNDING, last.rtol / 2)
        most = _MOST
    elif not looks[-2].apart < _USUAL[kind].parted:
        factor = _LEAP
        if kind is Kind.EXPLICIT and looks[-2].parted < 1.0:
            factor = min(max(_beyond(looks[-2], asked) / last.rtol, _FAR_LEAP), _LEAP)
    else:
        aim = _AIM if kind is Kind.EXPLICIT else _AIM_OF_OTHERS
        factor, most = (aim * asked / known) ** (1 / _USUAL[kind].power), _MOST
    return max(last.rtol * min(max(factor, _USUAL[kind].least), most), tightest)


def _foretold(last: ToleranceRun, asked: float) -> float:
    """The next tolerance in the last one by what its local errors sum up to."""
    usual = _USUAL[last.kind]
    factor = float((usual.aim * asked / _summed(last)) ** (1 / usual.summed))
    if not last.calm:
        return factor
    return max(factor, _CALM if last.rtol <= _NEAR * asked else _CALM_BEYOND)


def _beyond(before: ToleranceRun, asked: float) -> float:
    """The tolerance at which a run is to stay near, if errors grow on as they have until an earlier
    one had left."""
    usual = _USUAL[before.kind]
    aim = _AIM * asked / (before.rtol * _growth(before))
    return before.rtol * min(aim, 1.0) ** (1 / usual.power)


def _growth(look: ToleranceRun) -> float:
    """How far errors grow to the end, at the pace from the tolerance of a run to where it is said
    to have left."""
    left = max(_USUAL[look.kind].parted / look.rtol, 1.0)
    return float(left ** (1.0 / max(look.parted, 0.1)))


def _changed(last: ToleranceRun, known: float | None, asked: float, kind: Kind) -> float:
    """The first tolerance of another kind: of an explicit one behind others one with which it is
    known by them, for stability sets its steps in any case."""
    first = first_rtol(asked, kind)
    if known is None or kind is not Kind.EXPLICIT:
        return first
    enough = last.rtol * (_AIM * asked / (_USUAL[kind].safety * known)) ** (1 / _CHANGED)
    return min(first, max(enough, _FOLLOWING * first, TIGHTEST))


def no_gain_reason(looks: Sequence[ToleranceRun]) -> str:
    """Why a further run would lead nowhere; "" if it may."""
    stays = len(looks) > 3 and not _falls(looks) and not _falls(looks[:-1])
    stays = stays and looks[-2].apart < _USUAL[looks[-1].kind].parted
    if stays and looks[-1].rtol < _SLOW:
        return (
            "the error falls no more with the tolerance (rounding, or jumps of forces at which no "
            "step ends)"
        )
    if looks[-1].rtol < 2 * TIGHTEST:  # runs at nearly the same tolerance tell nothing
        return f"no tolerance below {TIGHTEST:.0e} has a meaning in these numbers"
    return f"{RUNS} runs did not get there" if len(looks) >= RUNS else ""


def _summed(look: ToleranceRun) -> float:
    """What the error of a run is by its local errors, about."""
    usual = _USUAL[look.kind]
    known = look.summed or _UNKNOWN * look.rtol
    usually = usual.held if look.held else usual.growth
    return known * (look.growth or usually + _WAVING * look.radians)


def _power(looks: Sequence[ToleranceRun]) -> float:
    """The power by which the error of the last run is believed to have fallen."""
    before, last = looks[-2:]
    seen, usual = _seen(looks), _USUAL[last.kind].power
    if before.kind is not last.kind or before.method != last.method:
        usual = 0.0 if before.kind is Kind.EXPONENTIAL else _CHANGED
    if seen is None:
        return _HARDLY if last.rtol <= _ROUNDING else usual
    if last.kind is Kind.EXPLICIT and seen > _NOISE:
        return usual
    return min(max(_TRUSTED * seen, _HARDLY), usual)


def _falls(looks: Sequence[ToleranceRun]) -> bool:
    seen = _seen(looks)
    return seen is None or seen > _HARDLY


def _seen(looks: Sequence[ToleranceRun]) -> float | None:
    """The power that the last three runs show; None where they show none."""
    if len(looks) < 3:
        return None
    a, b, last = looks[-3:]
    if not a.kind is b.kind is last.kind or not a.method == b.method == last.method:
        return None
    if not 0 < b.apart < math.inf or not 0 < a.apart < math.inf:
        return None
    parted = _USUAL[last.kind].parted
    if a.apart > parted:
        return None if b.apart < parted else 0.0
    return math.log(a.apart / b.apart) / math.log(a.rtol / b.rtol)
