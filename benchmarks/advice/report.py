"""Counts over all outcomes, as a page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from .trials import Outcome

#: What is counted: in words, when it holds, and in how many of a hundred it is aimed at.
COUNTS: tuple[tuple[str, Callable[[Outcome], bool | None], int], ...] = (
    ("true error at most what was asked", lambda one: one.kept, 95),
    ("time at most 2 times the cheapest sure model", lambda one: one.cheap(2.0), 80),
    ("time at most 3 times the cheapest sure model", lambda one: one.cheap(3.0), 0),
    ("time at most 2 times the cheapest run, by luck too", lambda one: one.cheap(2.0, True), 0),
    ("compared over the whole run", lambda one: one.whole, 0),
)


def share(outcomes: Sequence[Outcome], holds: Callable[[Outcome], bool | None]) -> str:
    """How many, as 45 of 50 (90 %)."""
    found = [value for one in outcomes if (value := holds(one)) is not None]
    part = 100 * sum(found) / len(found) if found else 0.0
    return f"{sum(found)} of {len(found)} ({part:.0f} %)"


def table(outcomes: Sequence[Outcome], data: dict[str, Any]) -> str:
    """The page: counts by error asked for, by family, scenes A to D, what has failed."""
    four = [one for one in outcomes if len(one.scene) == 1]
    drawn = [one for one in outcomes if len(one.scene) > 1]
    asked = sorted({one.asked for one in outcomes}, reverse=True)
    machine = data["machine"]
    lines = [
        "# Advice beside the cheapest model",
        "",
        f"{len({one.scene for one in drawn})} scenes of {data['scenes_drawn']} drawn, "
        f"{data['each']} of each family, seed {data['seed']} ({data['set']} set).  "
        f"{machine['processor']}, load {machine['load']:.1f}.  Errors of the places of all bodies "
        "and ends, in parts of the scene's length, against its richest model.  The cheapest model "
        "is found by trying all levels and numbers of shapes of all bodies, each by six methods "
        "over their tolerances; it is sure where all tighter ones of its method err no more, too.  "
        "Scenes whose beams are split (no model of the ladder is enough) are compared with sixteen "
        "parts and have no cheapest model.",
        "",
        "| | aim | all | " + " | ".join(f"{x:.0e}" for x in asked) + " |",
        "|---|---|---|" + "---|" * len(asked),
    ]
    for words, holds, aim in COUNTS:
        cells = [share([one for one in drawn if one.asked == x], holds) for x in asked]
        goal = f"{aim} %" if aim else ""
        lines.append(f"| {words} | {goal} | {share(drawn, holds)} | {' | '.join(cells)} |")
    lines += ["", "| family | error kept | time within 2 | median of time / cheapest | median of "
              "time of the scene as given / advised |", "|---|---|---|---|---|"]  # fmt: skip
    for family in dict.fromkeys(one.family for one in drawn):
        some = [one for one in drawn if one.family == family]
        ratios = [one.ratio for one in some if one.ratio is not None]
        savings = [one.saving for one in some if one.saving is not None]
        cells = [share(some, holds) for _, holds, _ in COUNTS[:2]]
        lines.append(f"| {family} | {' | '.join(cells)} | {_middle(ratios)} | {_middle(savings)} |")
    lines += ["", "Scenes A to D, a hub with a clamped beam:", ""]
    lines += ["| scene | asked | true error | advised | time / cheapest |", "|---|---|---|---|---|"]
    lines += [
        f"| {x.scene} | {x.asked:.0e} | {x.error:.1e} | {x.advised} | "
        f"{'-' if x.ratio is None else f'{x.ratio:.2f}'} |"
        for x in sorted(four, key=lambda one: (one.scene, -one.asked))
    ]
    bad = [one for one in outcomes if not one.kept or one.cheap(2.0) is False]
    lines += ["", "Not kept, or more than twice as dear:", "", *(f"    {x.line()}" for x in bad)]
    if data["without_reference"]:
        lines += ["", "Without a reference that is good enough: "
                  + ", ".join(data["without_reference"])]  # fmt: skip
    return "\n".join(lines) + "\n"


def _middle(values: list[float]) -> str:
    return f"{sorted(values)[len(values) // 2]:.2f}" if values else "-"
