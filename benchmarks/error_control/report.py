"""Counts over all outcomes, as a page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from .trials import Outcome

#: What is counted: in words, when it holds, and in how many of a hundred it was asked for.
COUNTS: tuple[tuple[str, Callable[[Outcome], bool | None], int], ...] = (
    ("true error at most 10 times the estimate", lambda one: one.told, 95),
    ("true error at most 3 times what was asked", lambda one: one.kept, 90),
    ("time at most 3 times the cheapest single run", lambda one: one.cheap(3.0), 90),
    ("time at most 4 times the cheapest single run", lambda one: one.cheap(4.0), 0),
    ("time at most 3 times the cheapest sure setting", lambda one: one.cheap(3.0, sure=True), 0),
    ("the result says that it is met", lambda one: one.met, 0),
)


def share(outcomes: Sequence[Outcome], holds: Callable[[Outcome], bool | None]) -> str:
    """How many, as 45 of 50 (90 %)."""
    found = [value for one in outcomes if (value := holds(one)) is not None]
    part = 100 * sum(found) / len(found) if found else 0.0
    return f"{sum(found)} of {len(found)} ({part:.0f} %)"


def table(outcomes: Sequence[Outcome], data: dict[str, Any]) -> str:
    """The page: counts by error asked for, counts and median ratio by family, what has failed."""
    asked = sorted({one.asked for one in outcomes}, reverse=True)
    scenes = len({one.scene for one in outcomes})
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
        "| | aim | all | " + " | ".join(f"{x:.0e}" for x in asked) + " |",
        "|---|---|---|" + "---|" * len(asked),
    ]
    for words, holds, aim in COUNTS:
        cells = [share([one for one in outcomes if one.asked == x], holds) for x in asked]
        goal = f"{aim} %" if aim else ""
        lines.append(f"| {words} | {goal} | {share(outcomes, holds)} | {' | '.join(cells)} |")
    lines += ["", "| family | told | kept | time within 3 | median of time / cheapest |",
              "|---|---|---|---|---|"]  # fmt: skip
    for family in dict.fromkeys(one.family for one in outcomes):
        some = [one for one in outcomes if one.family == family]
        ratios = sorted(one.ratio for one in some if one.ratio is not None)
        cells = [share(some, holds) for _, holds, _ in COUNTS[:3]]
        middle = f"{ratios[len(ratios) // 2]:.2f}" if ratios else "-"
        lines.append(f"| {family} | {' | '.join(cells)} | {middle} |")
    bad = [one for one in outcomes if not (one.told and one.kept)]
    lines += ["", "Not told or not kept:", "", *(f"    {one.line()}" for one in bad)]
    if data["without_reference"]:
        lines += ["", "Without a reference that is good enough: "
                  + ", ".join(data["without_reference"])]  # fmt: skip
    return "\n".join(lines) + "\n"
