"""Advice judges by time; here by what its runs computed, so that load changes nothing."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pytest

from mstmm.runtime.chart.trial_run import Runs
from mstmm.runtime.model.model import Model
from mstmm.runtime.result.result import Result

EVALUATION = 1e-6
"""Time (s) that is said of an evaluation with one speed."""


@pytest.fixture(autouse=True)
def _counted_time(monkeypatch: pytest.MonkeyPatch) -> None:
    called = Runs.simulate_with

    def simulate_and_count(
        self: Runs, model: Model, options: Mapping[str, Any], limit: float, own_steps: bool = False
    ) -> tuple[Result, float]:
        result, _ = called(self, model, options, limit, own_steps)
        s = result.statistics
        assert s is not None
        each = s.evaluations + s.residuals + 3 * s.tangents + s.solves
        return result, EVALUATION * max(model.nu, 1) * max(each, 1)

    monkeypatch.setattr(Runs, "simulate_with", simulate_and_count)
