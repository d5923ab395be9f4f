"""Time that a chart may take, and how it is shared out."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

#: The parts of the budget by which the reference, the settings of promising methods, and those of
#: all are to be done; what is left is for repeating runs.
REFERENCE, EARLY, SETTINGS, ALL = 0.35, 0.6, 0.8, 1.0

#: One run may take a part of the time left, for others want to be tried too: a sixth, and less
#: where more than thirty curves wait.
_FEW, _WAITING = 6.0, 5.0


class OutOfTime(BaseException):
    """A run has taken as long as it may.

    It is raised inside of `simulate`, from its report of progress, where an Exception would only
    end the reports.
    """


@dataclass
class Budget:
    """`seconds` of the clock from the moment it is made."""

    seconds: float
    clock: Callable[[], float] = time.monotonic

    def __post_init__(self) -> None:
        self._begin = self.clock()

    @property
    def spent(self) -> float:
        """Seconds since the beginning."""
        return self.clock() - self._begin

    def left(self, part: float = ALL) -> float:
        """Seconds until so much of the budget is spent, 0 or more."""
        return max(0.0, part * self.seconds - self.spent)

    def share(self, part: float, waiting: int = 1) -> float:
        """Seconds that one run may take now, of so many curves that wait."""
        return self.left(part) / max(_FEW, waiting / _WAITING)

    def alarm(self, seconds: float) -> Callable[[float, float], None]:
        """What ends a run after so many seconds: to be given to `simulate` as `progress`."""
        end = self.clock() + seconds

        def look(t: float, t_end: float) -> None:
            if self.clock() > end:
                raise OutOfTime

        return look

    def plan(self, curves: int) -> str:
        """What the time is for, in words."""
        reference, settings = REFERENCE * self.seconds, (SETTINGS - REFERENCE) * self.seconds
        return (
            f"budget {self.seconds:g} s: up to {reference:.3g} s for the reference, then "
            f"{settings:.3g} s for the settings of {curves} curve{'s' * (curves != 1)}, the rest "
            "to repeat runs"
        )
