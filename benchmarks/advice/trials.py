"""What is advised for one scene, beside the truth and the cheapest model found by trying all."""

from __future__ import annotations

import time
from dataclasses import dataclass

import mstmm

from ..error_control.scenes import Drawn
from .exhaustive_search import (
    Single,
    Truth,
    cheapest,
    models,
    single,
    singles,
    timed,
    truth,
    truth_in_parts,
)

#: Errors that are asked for, in parts of the scene's length.
ASKED = (1e-2, 1e-3, 1e-4)

#: A reference that is off by more than this part of the smallest error asked for is none.
_GOOD = 0.1


@dataclass(frozen=True)
class Outcome:
    """One scene, one error asked for.

    Attributes:
        scene, asked: which.
        error: true error of the advised model with the advised setting, against the richest model;
            where that is split, against sixteen parts, and no model of the ladder is its rival.
        told: the error that the advice says.
        cpu_s: of that run, the least of the rounds.
        best, best_cpu_s: the cheapest sure run of any model, and its time from the same rounds;
            None where there is none.
        lucky_cpu_s: of the cheapest run of all, lucky hits included.
        advised: choices and setting in words.
        whole: models were compared over the whole run.
        spent_s: of the clock, that the advice took.
        saving: time of the scene as given over that of the advised one, as the advice says.
    """

    scene: str
    asked: float
    error: float
    told: float
    cpu_s: float
    best: str | None
    best_cpu_s: float | None
    lucky_cpu_s: float | None
    advised: str
    whole: bool
    spent_s: float
    saving: float | None

    @property
    def family(self) -> str:
        """The family of the scene."""
        return self.scene.rstrip("0123456789")

    @property
    def kept(self) -> bool:
        """The true error is at most what was asked."""
        return self.error <= self.asked

    @property
    def ratio(self) -> float | None:
        """Time in that of the cheapest sure run."""
        return None if self.best_cpu_s is None else self.cpu_s / self.best_cpu_s

    def cheap(self, times: float, lucky: bool = False) -> bool | None:
        """Whether the time is at most so many times that of the cheapest; None without one."""
        other = self.lucky_cpu_s if lucky else self.best_cpu_s
        return None if other is None else self.cpu_s <= times * other

    def line(self) -> str:
        """All of it in words."""
        ratio = "" if self.ratio is None else f", {self.ratio:.2f} times {self.best}"
        return (
            f"{self.scene}: asked {self.asked:.0e}, told {self.told:.1e}, true {self.error:.1e}; "
            f"{self.advised}, {1e3 * self.cpu_s:.2f} ms{ratio}; took {self.spent_s:.1f} s"
        )


def outcome(
    name: str, scene: mstmm.Scene, t_end: float, known: Truth, made: list[Single], asked: float,
    rounds: int,
) -> Outcome:  # fmt: skip
    """The advice, and its run and the cheapest ones in alternating rounds."""
    begin = time.monotonic()
    advice = mstmm.advise(scene, t_end, error=asked, rounds=2)
    spent = time.monotonic() - begin
    ours_model = mstmm.compile(advice.scene, engine="looped")
    found = timed(ours_model, t_end, **advice.options)
    assert found is not None
    measure, truer = known.measure, known
    measure.register(ours_model, advice.renamed_references)
    if advice.beam_parts:
        truer = truth_in_parts(known, set(advice.beam_parts.values()), t_end) or known
    error = float(measure.distance(measure.read(found[0]), truer.numbers).max())
    rivals = [None if advice.beam_parts else cheapest(made, asked, sure) for sure in (True, False)]
    scenes = dict(models(known.base))
    compiled = {
        one: mstmm.compile(scenes[one.model], engine="looped") for one in rivals if one is not None
    }
    ours, theirs = [found[1]], {one: [one.cpu_s] for one in compiled}
    for _ in range(rounds):
        again = timed(ours_model, t_end, **advice.options)
        assert again is not None
        ours.append(again[1])
        for one, model in compiled.items():
            run = single(model, t_end, one.method, one.rtol)
            if run is not None:
                theirs[one].append(run[1])
    times = [None if one is None else min(theirs[one]) for one in rivals]
    changes = [
        text.partition(";")[0].partition(" with a frame")[0] for text in advice.other_changes
    ]
    advised = "; ".join([*(f"{b.name}: {b.model}" for b in advice.bodies), *changes])
    return Outcome(
        name, asked, error, advice.error, min(ours), None if rivals[0] is None else str(rivals[0]),
        times[0], times[1], f"{advised}; {advice.method}, {advice.setting}",
        advice.covers_whole_run, spent, advice.model_saving,
    )  # fmt: skip


def tried(task: tuple[str, Drawn, int]) -> tuple[str, list[Outcome], float]:
    """A scene with its outcomes and the error of its reference; no outcomes where that is no
    good."""
    name, (tables, t_end), rounds = task
    scene = mstmm.Scene(**tables)
    known = truth(scene, t_end)
    if known is None or known.error > _GOOD * min(ASKED):
        return name, [], float("inf") if known is None else known.error
    made = singles(known, t_end, max(ASKED), min(ASKED) / 3)
    outcomes = [outcome(name, scene, t_end, known, made, asked, rounds) for asked in ASKED]
    return name, outcomes, known.error
