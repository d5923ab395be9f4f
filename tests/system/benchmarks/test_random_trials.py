"""Counts by target error, and the stored pages of the benchmarks on random scenes."""

from __future__ import annotations

import json
from dataclasses import dataclass
from types import ModuleType

import pytest

from benchmarks.advice import report as advice_report
from benchmarks.advice import trials as advice_trials
from benchmarks.common.random_trials import count_lines
from benchmarks.error_control import report as error_report
from benchmarks.error_control import trials as error_trials
from tests.support.paths import ROOT


@dataclass
class Outcome:
    """One scene, one target error."""

    target: float
    is_met: bool | None


def test_counts_by_target_error() -> None:
    """Outcomes without a value are left out, here and in the column of all."""
    outcomes = [Outcome(1e-3, True), Outcome(1e-3, False), Outcome(1e-5, True), Outcome(1e-5, None)]
    rows = count_lines(outcomes, [1e-3, 1e-5], [("met", lambda outcome: outcome.is_met, 90)])
    assert rows == [
        "| | target | all | 1e-03 | 1e-05 |",
        "|---|---|---|---|---|",
        "| met | 90 % | 2 of 3 (67 %) | 1 of 2 (50 %) | 1 of 1 (100 %) |",
    ]


@pytest.mark.parametrize(
    ("name", "report", "trials"),
    [("advice", advice_report, advice_trials), ("error_control", error_report, error_trials)],
)
def test_stored_pages_follow_from_the_records(
    name: str, report: ModuleType, trials: ModuleType
) -> None:
    folder = ROOT / "benchmarks" / name
    data = json.loads((folder / "result.json").read_text())
    outcomes = [trials.Outcome(**outcome) for outcome in data["outcomes"]]
    assert (folder / "result.md").read_text() == report.table(outcomes, data)
