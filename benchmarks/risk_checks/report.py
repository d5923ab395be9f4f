"""Page of false-alarm and miss rates of the checks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from .trials import Trial


@dataclass(frozen=True)
class CheckCase:
    """A check before or after a run on a family of scenes: name of its risk, random parameter, and
    the error that counts as wrong."""

    risk: str
    before_run: bool
    family: str
    drawn_value: str
    is_wrong: str


def is_reported(case: CheckCase, trial: Trial) -> bool:
    """Whether the check reported its risk."""
    return case.risk in (trial.reported_before if case.before_run else trial.reported_after)


def counts(case: CheckCase, trials: Sequence[Trial]) -> dict[str, int]:
    """Numbers of wrong and correct runs, misses and false alarms."""
    wrong = [trial for trial in trials if trial.is_wrong and (case.before_run or not trial.failed)]
    correct = [trial for trial in trials if not trial.is_wrong]
    return {
        "wrong": len(wrong), "misses": sum(not is_reported(case, trial) for trial in wrong),
        "fine": len(correct), "false_alarms": sum(is_reported(case, trial) for trial in correct),
        "unguarded": sum(not (trial.reported_after or is_reported(case, trial)) for trial in wrong),
    }  # fmt: skip


def table(cases: Sequence[CheckCase], trials: Mapping[str, Sequence[Trial]], data: Any) -> str:
    """The page."""
    lines = [
        "# False-alarm and miss rates of the checks",
        "",
        f"{data['each']} scenes of each family, seed {data['seed']} "
        f"({'on which limits were set' if data['tuning'] else 'limits were set on another'}).  "
        "A run is wrong if its error against an accurate run exceeds the stated bound, or if it "
        "failed; failed runs do not count for checks after the run.  *Unreported*: wrong runs "
        "without any report.",
        "",
        "| check | when | family | parameter | wrong if | missed | false alarms | unreported |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for case in cases:
        c = counts(case, trials[case.family])
        lines.append(
            f"| `{case.risk}` | {'before' if case.before_run else 'after'} | {case.family} "
            f"| {case.drawn_value} "
            f"| {case.is_wrong} | {_share_text(c['misses'], c['wrong'])} "
            f"| {_share_text(c['false_alarms'], c['fine'])} | {c['unguarded']} |"
        )
    return "\n".join(lines) + "\n"


def _share_text(count: int, total: int) -> str:
    return f"{count} of {total} ({100 * count / total:.0f} %)" if total else "0 of 0"
