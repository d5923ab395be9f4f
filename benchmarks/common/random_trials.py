"""Trials on random scenes: run side by side, stored after every scene, counted by target error."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict
from multiprocessing import get_context
from pathlib import Path
from typing import Any

#: Function of one task: name of the scene, its outcomes, error of its reference.
RunScene = Callable[[Any], tuple[str, Sequence[Any], float]]
#: Criterion of an outcome; None leaves the outcome out.
Criterion = Callable[[Any], bool | None]


def run_and_store(
    run_scene: RunScene,
    tasks: Iterable[Any],
    jobs: int,
    data: dict[str, Any],
    table: Callable[[Sequence[Any], dict[str, Any]], str],
    folder: Path,
) -> None:
    """Run all tasks, `jobs` at a time; print, and write both result files, after every scene."""
    outcomes: list[Any] = []
    scenes_without_reference: dict[str, float] = {}
    with get_context("spawn").Pool(jobs) as pool:
        for name, new_outcomes, reference_error in pool.imap_unordered(run_scene, tasks):
            if not new_outcomes:
                scenes_without_reference[name] = reference_error
            outcomes += new_outcomes
            print(*(outcome.text() for outcome in new_outcomes), sep="\n", flush=True)
            data |= {
                "without_reference": scenes_without_reference,
                "outcomes": [asdict(outcome) for outcome in outcomes],
            }
            text = json.dumps(data, indent=1) + "\n"
            (folder / "result.json").write_text(text, encoding="utf-8")
            (folder / "result.md").write_text(table(outcomes, data), encoding="utf-8")


def share(outcomes: Sequence[Any], criterion: Criterion) -> str:
    """Share as text: 45 of 50 (90 %)."""
    values = [value for outcome in outcomes if (value := criterion(outcome)) is not None]
    part = 100 * sum(values) / len(values) if values else 0.0
    return f"{sum(values)} of {len(values)} ({part:.0f} %)"


def count_lines(
    outcomes: Sequence[Any], errors: Sequence[float], counts: Iterable[tuple[str, Criterion, int]]
) -> list[str]:
    """Markdown table of shares over all outcomes and by target error.

    `counts` holds text, criterion and target share in percent (0: none) of each row.
    """
    lines = [
        "| | target | all | " + " | ".join(f"{error:.0e}" for error in errors) + " |",
        "|---|---|---|" + "---|" * len(errors),
    ]
    for text, criterion, percent in counts:
        cells = [
            share([outcome for outcome in outcomes if outcome.target == error], criterion)
            for error in errors
        ]
        goal = f"{percent} %" if percent else ""
        lines.append(f"| {text} | {goal} | {share(outcomes, criterion)} | {' | '.join(cells)} |")
    return lines


def reference_note(data: dict[str, Any]) -> list[str]:
    """Markdown lines that name the scenes without a reference; empty if there are none."""
    names = ", ".join(data["without_reference"])
    return ["", f"Without a sufficient reference: {names}"] if names else []
