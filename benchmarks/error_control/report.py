"""Counts over all outcomes, as a page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from .trials import Outcome

#: What is counted: in words, when it holds, and in how many of a hundred it was asked for.
COUNTS: tuple[tuple[str, Callable[[Outcome], bool | None], int], ...] = (
    ("true error at most 10 times the estimate", lambda trial: trial.is_estimate_valid, 95),
    ("true error at most 3 times what was asked", lambda trial: trial.is_met, 90),
    ("time at most 3 times the cheapest single run", lambda trial: trial.is_within(3.0), 90),
    ("time at most 4 times the cheapest single run", lambda trial: trial.is_within(4.0), 0),
    (
        "time at most 3 times the cheapest sure setting",
        lambda trial: trial.is_within(3.0, only_sure=True),
        0,
    ),
    ("the result says that it is met", lambda trial: trial.reports_met, 0),
)


def share(outcomes: Sequence[Outcome], criterion: Callable[[Outcome], bool | None]) -> str:
    """How many, as 45 of 50 (90 %)."""
    values = [value for trial in outcomes if (value := criterion(trial)) is not None]
    part = 100 * sum(values) / len(values) if values else 0.0
    return f"{sum(values)} of {len(values)} ({part:.0f} %)"


def table(outcomes: Sequence[Outcome], data: dict[str, Any]) -> str:
    """The page: counts by error asked for, counts and median ratio by family, what has failed."""
    target = sorted({trial.target for trial in outcomes}, reverse=True)
    scenes = len({trial.scene for trial in outcomes})
    machine = data["machine"]
    lines = [
        "# Errors that were asked for",
        "",
        f"{scenes} scenes of {data['scenes_drawn']} drawn, {data['each']} of each family, "
        f"seed {data['seed']}; "
        f"families that the rule was {'set' if data['families'] == 'tuning' else 'not set'} on.  "
        f"{machine['processor']}, load {machine['load']:.1f}.  "
        "A sure setting is one that meets the error as do all tighter ones of its method.",
        "",
        "| | aim | all | " + " | ".join(f"{error:.0e}" for error in target) + " |",
        "|---|---|---|" + "---|" * len(target),
    ]
    for text, criterion, aim in COUNTS:
        cells = [
            share([trial for trial in outcomes if trial.target == error], criterion)
            for error in target
        ]
        goal = f"{aim} %" if aim else ""
        lines.append(f"| {text} | {goal} | {share(outcomes, criterion)} | {' | '.join(cells)} |")
    lines += ["", "| family | told | kept | time within 3 | median of time / cheapest |",
              "|---|---|---|---|---|"]  # fmt: skip
    for family in dict.fromkeys(trial.family for trial in outcomes):
        members = [trial for trial in outcomes if trial.family == family]
        ratios = sorted(trial.ratio for trial in members if trial.ratio is not None)
        cells = [share(members, criterion) for _, criterion, _ in COUNTS[:3]]
        middle = f"{ratios[len(ratios) // 2]:.2f}" if ratios else "-"
        lines.append(f"| {family} | {' | '.join(cells)} | {middle} |")
    exceptions = [trial for trial in outcomes if not (trial.is_estimate_valid and trial.is_met)]
    lines += ["", "Not told or not kept:", "", *(f"    {trial.text()}" for trial in exceptions)]
    if data["without_reference"]:
        lines += ["", "Without a reference that is good enough: "
                  + ", ".join(data["without_reference"])]  # fmt: skip
    return "\n".join(lines) + "\n"
