"""Wall-clock time limit of a chart, and its shares for the parts of the work."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from .tuning import CHART as TUNING

#: Fractions of the budget after which the reference, the settings of promising methods, and those
#: of all methods must be done; the rest is for repeated timing.
REFERENCE, EARLY, SETTINGS, ALL = 0.35, 0.6, 0.8, 1.0


class OutOfTime(BaseException):
    """A run exceeded its time limit.

    Raised in the progress callback of `simulate`, which catches every Exception; hence a
    BaseException.
    """


@dataclass
class Budget:
    """Wall-clock time limit of `seconds`, from its creation on."""

    seconds: float
    clock: Callable[[], float] = time.monotonic

    def __post_init__(self) -> None:
        self._begin = self.clock()

    @property
    def elapsed_time(self) -> float:
        """Time since the creation, s."""
        return self.clock() - self._begin

    def remaining(self, part: float = ALL) -> float:
        """Time until this fraction of the budget is spent, s, 0 or more."""
        return max(0.0, part * self.seconds - self.elapsed_time)

    def run_limit(self, part: float, waiting: int = 1) -> float:
        """Time limit of the next run, s, while `waiting` curves are not finished."""
        return self.remaining(part) / max(TUNING.min_shares, waiting / TUNING.curves_per_share)

    def alarm(self, seconds: float) -> Callable[[float, float], None]:
        """Progress callback for `simulate` that raises OutOfTime after `seconds`."""
        end = self.clock() + seconds

        def check_time(t: float, t_end: float) -> None:
            if self.clock() > end:
                raise OutOfTime

        return check_time

    def plan(self, curves: int) -> str:
        """Description of how the time is divided."""
        reference, settings = REFERENCE * self.seconds, (SETTINGS - REFERENCE) * self.seconds
        return (
            f"budget {self.seconds:g} s: up to {reference:.3g} s for the reference, then "
            f"{settings:.3g} s for the settings of {curves} curve{'s' * (curves != 1)}, the rest "
            "for repeated timing"
        )
