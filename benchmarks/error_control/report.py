"""Page of counts over all outcomes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from .trials import Outcome

#: Text, criterion and target share in percent of each count.
COUNTS: tuple[tuple[str, Callable[[Outcome], bool | None], int], ...] = (
    ("true error at most 10 times the estimate", lambda trial: trial.is_estimate_valid, 95),
    ("true error at most 3 times the target", lambda trial: trial.is_met, 90),
    ("time at most 3 times the cheapest single run", lambda trial: trial.is_within(3.0), 90),
    ("time at most 4 times the cheapest single run", lambda trial: trial.is_within(4.0), 0),
    (
        "time at most 3 times the cheapest sure setting",
        lambda trial: trial.is_within(3.0, only_sure=True),
        0,
    ),
    ("the result reports that the target is met", lambda trial: trial.reports_met, 0),
)


def share(outcomes: Sequence[Outcome], criterion: Callable[[Outcome], bool | None]) -> str:
    """Share as text: 45 of 50 (90 %)."""
    values = [value for trial in outcomes if (value := criterion(trial)) is not None]
    part = 100 * sum(values) / len(values) if values else 0.0
    return f"{sum(values)} of {len(values)} ({part:.0f} %)"


def table(outcomes: Sequence[Outcome], data: dict[str, Any]) -> str:
    """Page: counts by target error and by family, median ratios, exceptions."""
    target = sorted({trial.target for trial in outcomes}, reverse=True)
    scenes = len({trial.scene for trial in outcomes})
    machine = data["machine"]
    lines = [
        "# Target errors",
        "",
        f"{scenes} scenes of {data['scenes_drawn']} drawn, {data['each']} of each family, "
        f"seed {data['seed']}; "
        f"families that were {'' if data['families'] == 'tuning' else 'not '}used to set the rule. "
        f"{machine['processor']}, load {machine['load']:.1f}.  "
        "A setting is sure if all tighter settings of its method meet the target too.",
        "",
        "| | target | all | " + " | ".join(f"{error:.0e}" for error in target) + " |",
        "|---|---|---|" + "---|" * len(target),
    ]
    for text, criterion, aim in COUNTS:
        cells = [
            share([trial for trial in outcomes if trial.target == error], criterion)
            for error in target
        ]
        goal = f"{aim} %" if aim else ""
        lines.append(f"| {text} | {goal} | {share(outcomes, criterion)} | {' | '.join(cells)} |")
    lines += ["", "| family | estimate valid | target met | time within 3 | median ratio |",
              "|---|---|---|---|---|"]  # fmt: skip
    for family in dict.fromkeys(trial.family for trial in outcomes):
        members = [trial for trial in outcomes if trial.family == family]
        ratios = sorted(trial.ratio for trial in members if trial.ratio is not None)
        cells = [share(members, criterion) for _, criterion, _ in COUNTS[:3]]
        middle = f"{ratios[len(ratios) // 2]:.2f}" if ratios else "-"
        lines.append(f"| {family} | {' | '.join(cells)} | {middle} |")
    exceptions = [trial for trial in outcomes if not (trial.is_estimate_valid and trial.is_met)]
    lines += [
        "",
        "Estimate not valid or target not met:",
        "",
        *(f"    {trial.text()}" for trial in exceptions),
    ]
    if data["without_reference"]:
        lines += ["", "Without a sufficient reference: "
                  + ", ".join(data["without_reference"])]  # fmt: skip
    return "\n".join(lines) + "\n"
