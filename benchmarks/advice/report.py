"""Page of counts over all outcomes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..common.random_trials import Criterion, count_lines, reference_note, share
from .trials import Outcome

#: Text, criterion and target share in percent of each count.
COUNTS: tuple[tuple[str, Criterion, int], ...] = (
    ("true error at most the target", lambda trial: trial.is_met, 95),
    ("time at most 2 times the cheapest sure model", lambda trial: trial.is_within(2.0), 80),
    ("time at most 3 times the cheapest sure model", lambda trial: trial.is_within(3.0), 0),
    (
        "time at most 2 times the cheapest run, including accidental ones",
        lambda trial: trial.is_within(2.0, True),
        0,
    ),
    ("compared over the whole run", lambda trial: trial.covers_whole_run, 0),
)


def table(outcomes: Sequence[Outcome], data: dict[str, Any]) -> str:
    """Page: counts by target error and family, scenes A to D, exceptions."""
    hub_outcomes = [trial for trial in outcomes if len(trial.scene) == 1]
    random = [trial for trial in outcomes if len(trial.scene) > 1]
    errors = sorted({trial.target for trial in outcomes}, reverse=True)
    machine = data["machine"]
    lines = [
        "# Advised and cheapest models",
        "",
        f"{len({trial.scene for trial in random})} scenes of {data['scenes_drawn']} drawn, "
        f"{data['each']} of each family, seed {data['seed']} ({data['set']} set).  "
        f"{machine['processor']}, load {machine['load']:.1f}.  Errors of the places of all bodies "
        "and ends, in parts of the scene's length, against its richest model.  The cheapest model "
        "is found by trying all levels and numbers of shapes of all bodies, each by six methods "
        "over their tolerances; it is sure where all tighter ones of its method err no more, too.  "
        "Scenes whose beams are split (no model of the ladder is enough) are compared with sixteen "
        "parts and have no cheapest model.",
        "",
        *count_lines(random, errors, COUNTS),
    ]
    lines += ["", "| family | target met | time within 2 | median of time / cheapest | median of "
              "time of the scene as given / advised |", "|---|---|---|---|---|"]  # fmt: skip
    for family in dict.fromkeys(trial.family for trial in random):
        members = [trial for trial in random if trial.family == family]
        ratios = [trial.ratio for trial in members if trial.ratio is not None]
        savings = [trial.saving for trial in members if trial.saving is not None]
        cells = [share(members, criterion) for _, criterion, _ in COUNTS[:2]]
        lines.append(
            f"| {family} | {' | '.join(cells)} | {_median_text(ratios)} | {_median_text(savings)} |"
        )
    lines += ["", "Scenes A to D, a hub with a clamped beam:", ""]
    lines += [
        "| scene | target | true error | advised | time / cheapest |",
        "|---|---|---|---|---|",
    ]
    lines += [
        f"| {trial.scene} | {trial.target:.0e} | {trial.error:.1e} | {trial.advised} | "
        f"{'-' if trial.ratio is None else f'{trial.ratio:.2f}'} |"
        for trial in sorted(hub_outcomes, key=lambda trial: (trial.scene, -trial.target))
    ]
    exceptions = [trial for trial in outcomes if not trial.is_met or trial.is_within(2.0) is False]
    lines += [
        "",
        "Target not met, or more than twice the cost:",
        "",
        *(f"    {trial.text()}" for trial in exceptions),
    ]
    lines += reference_note(data)
    return "\n".join(lines) + "\n"


def _median_text(values: list[float]) -> str:
    return f"{sorted(values)[len(values) // 2]:.2f}" if values else "-"
