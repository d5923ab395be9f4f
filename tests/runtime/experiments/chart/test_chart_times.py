"""When errors are looked at: more often where the motion is fast."""

from __future__ import annotations

import numpy as np
import pytest

import mstmm
from mstmm.runtime.experiments.chart.chart import equidistant_times, refine_times
from tests.support.scenes.chart import pendulum, stiff_rods


def test_slow_motions_keep_even_times() -> None:
    times = equidistant_times(2.0, 11)
    assert times.times == pytest.approx(np.linspace(0, 2, 11))
    assert times.description == "11 equidistant times up to 2 s"
    steps = np.array([0.0, 1e-3, 1e-2, 0.1, 0.7, 1.3, 2.0])  # as every run begins
    assert refine_times(times, steps) is times


def test_fast_moments_get_times_of_their_own() -> None:
    steps = np.array([0.0, 0.11, 0.12, 0.14, 0.16, 0.18, 0.5, 1.0])
    found = refine_times(equidistant_times(1.0, 11), steps)
    assert set(found.times) == {*equidistant_times(1.0, 11).times, 0.11, 0.12, 0.14, 0.16, 0.18}
    assert np.all(np.diff(found.times) > 0)
    assert (
        found.description == "11 equidistant times up to 1 s, and 5 more where the motion is fast"
    )


def test_there_is_an_end_to_it(rng: np.random.Generator) -> None:
    steps = np.sort(rng.uniform(0, 1, 5000))
    found = refine_times(equidistant_times(1.0, 11), steps)
    assert len(found.times) == 44
    assert found.times[0] == 0.0 and found.times[-1] == 1.0


def test_ends_of_steps_at_even_times_are_no_further_ones() -> None:
    steps = np.linspace(0, 1, 41) + 1e-16
    assert len(refine_times(equidistant_times(1.0, 11), steps).times) == 41


def test_a_chart_sees_what_lies_between_even_times() -> None:
    """Stiff bushings swing in within a part of the first even spacing: what a loose run errs by
    there, even times do not see."""
    model = mstmm.compile(stiff_rods(1e5), engine="looped")

    def error(samples: int | None) -> tuple[float, mstmm.Chart]:
        made = mstmm.chart(
            model, 1.0, methods=["rodas4p2"], samples=samples, rounds=0, budget=300,
            quantities=["one.velocity"],
        )  # fmt: skip
        (found,) = [p.error for p in made.points if p.setting.value == 1e-5]
        assert found is not None
        return found, made

    coarse, _ = error(101)
    seen, made = error(None)
    whole, _ = error(4001)
    assert seen > 10 * coarse
    assert seen > 0.5 * whole
    assert made.samples > 101
    assert "more where the motion is fast" in made.sampling_text
    assert made.sampling_text in made.to_html()
    assert made.to_dict()["times"] == made.sampling_text


def test_times_that_are_asked_for_are_kept() -> None:
    made = mstmm.chart(pendulum(), 1.0, methods=["dop853"], samples=7, rounds=0, budget=300)
    assert (made.samples, made.sampling_text) == (7, "7 equidistant times up to 1 s")
