"""The counting of false alarms and misses, and that its scenes come out on both sides."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.risk_checks import motions
from benchmarks.risk_checks.report import CheckCase, counts, table
from benchmarks.risk_checks.trials import Trial

AFTER = CheckCase("slope", False, "bent", "force", "much")
BEFORE = CheckCase("slope", True, "bent", "force", "much")

TRIALS = [
    Trial(1.0, (), (), 0.5),
    Trial(2.0, ("slope",), ("slope", "turn"), 0.9),
    Trial(3.0, (), ("slope",), 1.5),
    Trial(4.0, (), ("turn",), 2.0),
    Trial(5.0, (), (), math.nan),
    Trial(6.0, (), (), math.inf, failed=True),
]


def test_counts() -> None:
    assert counts(AFTER, TRIALS) == {
        "wrong": 3, "misses": 2, "fine": 2, "false_alarms": 1, "unguarded": 1,
    }  # fmt: skip
    assert counts(BEFORE, TRIALS) == {
        "wrong": 4, "misses": 4, "fine": 2, "false_alarms": 1, "unguarded": 2,
    }  # fmt: skip


def test_the_page_has_a_row_for_each() -> None:
    text = table([AFTER, BEFORE], {"bent": TRIALS}, {"each": 6, "seed": 1, "tuning": True})
    assert "| `slope` | after | bent | force | much | 2 of 3 (67 %) | 1 of 2 (50 %) | 1 |" in text
    assert "| `slope` | before |" in text and "seed 1 (on which limits were set)" in text


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("family", [motions.pulse_in_time, motions.heavy_tip])
def test_both_sides_are_drawn_and_draw_the_same_again(family: object) -> None:
    assert callable(family)
    trials = [family(np.random.default_rng([1, i])) for i in range(12)]
    assert {trial.is_wrong for trial in trials} == {True, False}
    assert trials[0] == family(np.random.default_rng([1, 0]))


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_what_is_seen_of_a_fixed_step_counts_as_seen_before() -> None:
    """Nothing looks at it before the run unless it is asked to refuse."""
    trials = [motions.explicit_step(np.random.default_rng([1, i])) for i in range(12)]
    assert any("step-stability" in trial.reported_before for trial in trials if trial.is_wrong)
