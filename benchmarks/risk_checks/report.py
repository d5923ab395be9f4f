"""False alarms and misses of every guard, as a page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from .trials import Trial


@dataclass(frozen=True)
class Judged:
    """A guard at one time, on one family of scenes: the name of its risk, whether before the run or
    behind it, what is drawn, and what counts as wrong."""

    guard: str
    before: bool
    family: str
    drawn: str
    wrong: str


def told(one: Judged, trial: Trial) -> bool:
    """Whether it said so."""
    return one.guard in (trial.before if one.before else trial.after)


def counts(one: Judged, trials: Sequence[Trial]) -> dict[str, int]:
    """Runs that are wrong and fine, alarms among the fine ones, misses among the wrong ones."""
    wrong = [trial for trial in trials if trial.wrong and (one.before or not trial.failed)]
    fine = [trial for trial in trials if not trial.wrong]
    return {
        "wrong": len(wrong), "misses": sum(not told(one, trial) for trial in wrong),
        "fine": len(fine), "false_alarms": sum(told(one, trial) for trial in fine),
        "unguarded": sum(not (trial.after or told(one, trial)) for trial in wrong),
    }  # fmt: skip


def table(judged: Sequence[Judged], found: Mapping[str, Sequence[Trial]], data: Any) -> str:
    """The page."""
    lines = [
        "# Rates of the guards",
        "",
        f"{data['each']} scenes of each family, seed {data['seed']} "
        f"({'on which limits were set' if data['tuning'] else 'limits were set on another'}).  "
        "A run is wrong where the stated error, by an accurate run, is above the stated bound, or "
        "where it failed; those that failed, and said so themselves, do not count behind the run.  "
        "*Unseen*: wrong runs of which no guard at all said anything.",
        "",
        "| guard | when | family | drawn | wrong is | missed | false alarms | unseen |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for one in judged:
        c = counts(one, found[one.family])
        lines.append(
            f"| `{one.guard}` | {'before' if one.before else 'after'} | {one.family} | {one.drawn} "
            f"| {one.wrong} | {_share(c['misses'], c['wrong'])} "
            f"| {_share(c['false_alarms'], c['fine'])} | {c['unguarded']} |"
        )
    return "\n".join(lines) + "\n"


def _share(some: int, of: int) -> str:
    return f"{some} of {of} ({100 * some / of:.0f} %)" if of else "0 of 0"
