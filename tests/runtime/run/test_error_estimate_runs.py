"""The second run must differ from the first one, whatever cuts their steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.integrate.settings import Settings
from mstmm.runtime.result.result import Result
from mstmm.runtime.run import run_execution
from mstmm.runtime.run.error_estimate import made_same_steps, reference_settings
from mstmm.runtime.run.trajectory import Trajectory
from tests.support.models import model_of
from tests.support.scenes.results import motor, pins


def true_error(run: Result) -> float:
    """Largest error of q against a run at 1e-12."""
    times, first = np.unique(run.t, return_index=True)
    best = model_of(run).simulate(float(times[-1]), rtol=1e-12, atol=1e-14, output_times=times)
    return float(np.abs(run.q[first] - best.q).max())


def estimated_error(run: Result) -> float:
    error = run.certificate.error
    assert error is not None
    return max(error.difference().values())


@pytest.mark.parametrize("step", [0.3, 0.6, 1.0, 1.5, 2.5, 40.0])
def test_a_step_longer_than_the_run_is_judged_by_shorter_ones(step: float) -> None:
    run = mstmm.compile(pins(1, [1.0])).simulate(1.0, method="rk4", step=step, certify=True)
    assert true_error(run) / 3 < estimated_error(run) < 30 * true_error(run)
    assert true_error(run) > 0.05


def test_breaks_that_cut_every_step_are_halved() -> None:
    """An effort that switches every 0.5 s makes steps of 0.5 s, however long they may be."""
    effort = "+".join(f"where(t > {k / 2}, {(-1) ** k}, 0)" for k in range(1, 8))
    model = mstmm.compile(motor(f"{effort} - q - q^3"))
    for step in (0.6, 3.0):
        run = model.simulate(4.0, method="rk4", step=step, certify=True)
        assert true_error(run) / 3 < estimated_error(run) < 30 * true_error(run)
        assert true_error(run) > 1e-3


def test_an_adaptive_run_of_one_step_is_judged_by_several() -> None:
    run = mstmm.compile(pins(1, [1.0])).simulate(0.01, "dopri5", certify=True, rtol=1e-3, atol=1e-3)
    assert run.statistics is not None
    assert run.statistics.steps <= 2
    assert estimated_error(run) >= true_error(run) / 3 > 0


@pytest.mark.parametrize("rtol", [0.5, 1.0, 3.0, 100.0])
@pytest.mark.parametrize("method", ["scipy-LSODA", "scipy-BDF", "scipy-RK45", "dopri5"])
def test_a_tolerance_that_bounds_nothing(method: str, rtol: float) -> None:
    for scene, t_end in ((motor("sin(t)"), 0.5), (pins(1, [1.0]), 2.0)):
        options: dict[str, Any] = {"method": method, "rtol": rtol, "atol": 1e-12}
        run = mstmm.compile(scene).simulate(t_end, certify=True, **options)
        assert run.success
        assert estimated_error(run) >= true_error(run) / 3


def test_a_run_that_repeats_the_first_gives_no_estimate() -> None:
    model = mstmm.compile(pins(1, [1.0]))
    first = model.simulate(1.0).trajectory
    assert made_same_steps(first, first)
    settings, _ = reference_settings(first)
    assert settings.output_times is not None
    again = model.simulate(1.0, rtol=settings.rtol, atol=settings.atol, output_times=first.t)
    assert not made_same_steps(first, again.trajectory)
    still = model.simulate(0.0, certify=True)
    assert still.certificate.error is None
    assert any("the same steps as the first" in text for text in still.warnings)


def test_one_output_time_is_enough_for_an_estimate() -> None:
    run = mstmm.compile(pins(1, [1.0])).simulate(3.0, output_times=[3.0], certify=True, rtol=1e-6)
    assert true_error(run) / 3 <= estimated_error(run) < 30 * true_error(run)
    lost = mstmm.compile(pins(2, [0.3, 0.5])).simulate(
        30.0, output_times=[30.0], certify=True, rtol=1e-6
    )
    error = lost.certificate.error
    assert error is not None
    assert error.divergence_time == 0.0
    assert estimated_error(lost) > 0.1


def test_a_second_run_that_fails_tells_only_of_the_time_that_it_covers(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """It is given up after fifty steps: nothing vouches for what the first run did beyond."""

    def given_up(first: Trajectory, breaks: Sequence[float] = ()) -> tuple[Settings, str]:
        settings, reference = reference_settings(first, breaks)
        return replace(settings, max_steps=50), reference

    model, times = mstmm.compile(pins(2, [1.0, 0.5])), np.linspace(0.0, 5.0, 101)
    assert model.simulate(5.0, rtol=1e-6, output_times=times, certify=True).trusted
    monkeypatch.setattr(run_execution, "reference_settings", given_up)
    run = model.simulate(5.0, rtol=1e-6, output_times=times, certify=True)
    error = run.certificate.error
    assert run.success and not run.trusted
    assert error is not None and error.covered is not None and 0.1 < error.covered < 4.0
    assert error.covered == error.t[-1]
    told = f"up to t = {error.covered:.6g} s, unknown afterwards"
    assert told in run.certificate.as_text()
    assert "the error is unknown after" in str(run.certificate.verdict())
    again = mstmm.load_result(run.save(tmp_path / "run.nc"))
    assert told in again.certificate.as_text() and not again.trusted
