"""What `simulate(error=...)` does on one scene, beside the cheapest single run."""

from __future__ import annotations

from dataclasses import dataclass

import mstmm

from .cheapest_setting import Reference, Single, reference, single, singles, timed
from .scenes import Drawn

#: Errors that are asked for.
ASKED = (1e-3, 1e-5, 1e-7)

#: A reference that is off by more than this part of the smallest error asked for is none.
_GOOD = 0.1


@dataclass(frozen=True)
class Outcome:
    """One scene, one error asked for.

    Attributes:
        scene, asked: which.
        met: what the result says of itself.
        estimate: reported; None where nothing is known.
        error: true error, by the reference, whose own is `floor`.
        cpu_s: of the call, the least of the rounds.
        best: the cheapest single run that errs by no more than asked; None where there is none.
        best_cpu_s: its time, from the same rounds.
        sure_cpu_s: of the cheapest one of which all tighter ones of its method err no more, too.
        runs: how many there were.
        how: method and tolerance that were kept.
    """

    scene: str
    asked: float
    met: bool
    estimate: float | None
    error: float
    floor: float
    cpu_s: float
    best: str | None
    best_cpu_s: float | None
    sure_cpu_s: float | None
    runs: int
    how: str

    @property
    def family(self) -> str:
        """The family of the scene."""
        return self.scene.rstrip("0123456789")

    @property
    def told(self) -> bool:
        """The true error is at most ten times the estimate."""
        return self.estimate is not None and self.error <= 10 * self.estimate + self.floor

    @property
    def kept(self) -> bool:
        """The true error is at most three times what was asked."""
        return self.error <= 3 * self.asked

    @property
    def ratio(self) -> float | None:
        """Time in that of the cheapest single run."""
        return None if self.best_cpu_s is None else self.cpu_s / self.best_cpu_s

    def cheap(self, times: float, sure: bool = False) -> bool | None:
        """Whether the time is at most so many times that of the cheapest; None without one."""
        other = self.sure_cpu_s if sure else self.best_cpu_s
        return None if other is None else self.cpu_s <= times * other

    def line(self) -> str:
        """All of it in words."""
        told = "none" if self.estimate is None else f"{self.estimate:.1e}"
        ratio = "" if self.ratio is None else f", {self.ratio:.2f} times {self.best}"
        return (
            f"{self.scene}: asked {self.asked:.0e}, estimate {told}, true {self.error:.1e}; "
            f"{self.how}, {self.runs} runs, {1e3 * self.cpu_s:.2f} ms{ratio}"
        )


def outcome(
    name: str, model: mstmm.Model, t_end: float, truth: Reference, found: list[Single],
    asked: float, rounds: int,
) -> Outcome:  # fmt: skip
    """Both in alternating rounds."""
    good = [one for one in found if one.error <= asked]
    best = min(good, key=lambda one: one.cpu_s) if good else None
    settled = [one for one in good if _all_tighter(one, found, asked)]
    sure = min(settled, key=lambda one: one.cpu_s) if settled else None
    ours = []
    others: dict[Single, list[float]] = {one: [] for one in (best, sure) if one is not None}
    for _ in range(rounds):
        result, spent = timed(model, t_end, error=asked)
        ours.append(spent)
        for one, spent_by in others.items():
            again = single(model, t_end, one.method, one.rtol)
            assert again is not None
            spent_by.append(again[1])
    known = result.achieved_error
    assert known is not None
    error = float(truth.measure.distance(truth.numbers, result.q).max())
    return Outcome(
        name, asked, known.is_met, known.estimate, error, truth.error, min(ours),
        None if best is None else f"{best.method} {best.rtol:.0e}",
        None if best is None else min(others[best]), None if sure is None else min(others[sure]),
        len(known.runs), f"{known.method} {known.rtol:.1e}",
    )  # fmt: skip


def _all_tighter(one: Single, found: list[Single], asked: float) -> bool:
    """Whether this run and all tighter ones of its method err by no more."""
    return all(x.error <= asked for x in found if x.method == one.method and x.rtol <= one.rtol)


def tried(task: tuple[str, Drawn, int]) -> tuple[str, list[Outcome], float]:
    """A scene with its outcomes and the error of its reference; no outcomes where that is no
    good."""
    name, (tables, t_end), rounds = task
    model = mstmm.compile(mstmm.Scene(**tables), engine="looped")
    truth = reference(model, t_end)
    if truth is None or truth.error > _GOOD * min(ASKED):
        return name, [], float("inf") if truth is None else truth.error
    found = singles(model, t_end, truth, min(ASKED) / 10, rounds)
    outcomes = [outcome(name, model, t_end, truth, found, asked, rounds) for asked in ASKED]
    return name, outcomes, truth.error
