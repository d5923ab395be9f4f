"""Advice judges by time; here by what its runs computed, so that load changes nothing."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pytest

from mstmm.runtime.experiments.runs import Runs
from mstmm.runtime.experiments.simulation import SimulatedScene
from mstmm.runtime.result.result import Result

EVALUATION = 1e-6
"""Time (s) that is said of an evaluation with one speed."""


@pytest.fixture(autouse=True)
def _counted_time(monkeypatch: pytest.MonkeyPatch) -> None:
    called = Runs.simulate

    def simulate_and_count(
        self: Runs,
        model: SimulatedScene,
        options: Mapping[str, Any],
        limit: float,
        own_steps: bool = False,
    ) -> tuple[Result, float]:  # fmt: skip
        result, _ = called(self, model, options, limit, own_steps)
        s = result.statistics
        assert s is not None
        each = s.evaluations + s.residuals + 3 * s.tangents + s.solves
        return result, EVALUATION * max(model.nu, 1) * max(each, 1)

    monkeypatch.setattr(Runs, "simulate", simulate_and_count)
