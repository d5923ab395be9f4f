"""How the steps of a run were controlled: how well it can be expected to keep energy and momentum,
and which control would keep them better.

Control of local errors lets energy drift by up to nine times the tolerance, and motions err by four
to sixty times the drift, relative to what moves; both counted on the runs of benchmarks/guards.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..integrate.reached import ReachedError
from ..integrate.settings import Settings
from ..integrate.steppers import get, names
from .verdict import ACCURACY, DRIFT

#: Drift beyond which energy and momentum are not kept, whatever was asked: what moves errs by about
#: ACCURACY.
MOST = ACCURACY / 20

#: Drift that control of local errors leaves, in tolerances.
_LEFT = 10.0

#: What is named instead is to leave this part of the bound.
_SURE = 0.2

#: Drifts fall by less than the order of a method while steps are long: by this part of it, and by
#: no more than the second.
_SETTLING, _HIGHEST = 0.75, 4.0

#: Tolerances below this are rounding.
_TIGHTEST = 1e-13

#: Order of methods that have no tableau.
_ORDER = 2


@dataclass(frozen=True)
class Control:
    """Fixed steps of a method of an order, or tolerances, or an error that was asked for.

    Attributes:
        step: s; None for steps that the method chose.
        rtol, atol: its tolerances.
        order: of the method.
        asked: error that was wanted of the whole run, in parts or rad; 0 where in other units, None
            where none was.
    """

    step: float | None
    rtol: float
    atol: float
    order: int
    asked: float | None = None

    @property
    def bound(self) -> float:
        """Largest relative drift of energy and momentum that counts as conserved."""
        if self.asked is not None:
            return max(DRIFT, self.asked)
        return MOST if self.step is not None else _bound(max(self.rtol, self.atol))

    def finer(self, drift: float) -> str:
        """Advice on step or tolerances for a relative drift that is too large."""
        if self.step is not None:
            order = min(_SETTLING * self.order, _HIGHEST)
            shorter = self.step * (_SURE * self.bound / drift) ** (1 / order)
            return f"take a step below {shorter:.2g} s, or a method that chooses its steps"
        left = drift / max(self.rtol, self.atol)
        within = left <= _SURE * _LEFT and self.asked is None
        part = _SURE * (MOST if within else DRIFT) / drift
        if self.asked:
            return f"ask for an error below {part * self.asked:.1g}"
        if part * self.rtol < _TIGHTEST:
            return "look for efforts, loads or drives that jump or go to infinity"
        return f"take rtol = {part * self.rtol:.1g} and atol = {part * self.atol:.1g}, or less"


def _bound(tolerance: float) -> float:
    return min(max(DRIFT, _LEFT * tolerance), MOST)


def control(settings: Settings, reached: ReachedError | None) -> Control:
    """Step control of a run."""
    known = settings.method in names()
    order = get(settings.method).order if known else _ORDER
    asked = None
    if reached is not None:
        asked = reached.asked if reached.unit in ("1", "rad") else 0.0
    return Control(settings.step, settings.rtol, settings.atol, order, asked)
