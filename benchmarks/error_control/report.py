"""Page of counts over all outcomes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..common.random_trials import Criterion, count_lines, reference_note, share
from .trials import Outcome

#: Text, criterion and target share in percent of each count.
COUNTS: tuple[tuple[str, Criterion, int], ...] = (
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


def table(outcomes: Sequence[Outcome], data: dict[str, Any]) -> str:
    """Page: counts by target error and by family, median ratios, exceptions."""
    errors = sorted({trial.target for trial in outcomes}, reverse=True)
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
        *count_lines(outcomes, errors, COUNTS),
    ]
    heading = "| family | estimate valid | target met | time within 3 | median time / cheapest |"
    lines += ["", heading, "|---|---|---|---|---|"]
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
    lines += reference_note(data)
    return "\n".join(lines) + "\n"
