"""A run that would fill the memory with its samples stops, keeps them and says why."""

from __future__ import annotations

import pytest

import mstmm
from mstmm.runtime.run import integration_run
from tests.support.scenes.results import pins


def test_a_run_stops_before_its_samples_fill_the_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(integration_run, "MAX_SAMPLE_BYTES", 2**20)
    monkeypatch.setattr(integration_run, "SLICE", 0.01)
    model = mstmm.compile(pins(2, [0.3, 0.4]))
    run = model.simulate(1e6, "rk4", 1e-4)
    assert not run.success and "give output times" in run.message
    assert len(run.t) > 1000 and run.t[-1] < 1e6
    thin = model.simulate(20.0, "rk4", 1e-3, output_times=[0.0, 20.0])
    assert thin.success and len(thin.t) == 2
