"""Bounds of the step: kept from where they begin, and no further."""

from __future__ import annotations

import numpy as np
import pytest

from mstmm.errors import SceneError
from mstmm.runtime.integrate.c_loop import Status
from tests.support.integration.compiled_systems import Lab

STARTS, LONGEST = [0.0, 3.0, 3.5, 4.0, 8.0], [np.inf, 0.5, 0.01, 0.25, 2.0]


@pytest.mark.parametrize("method", ["dopri5", "dop853", "pirk13"])
def test_no_step_is_longer_than_its_bounds(lab: Lab, method: str) -> None:
    problem = lab.problem("harmonic", 2, 1e-3)
    run = problem.finished_run(
        method, 20.0, (1.0, 0.0), bounds=(STARTS, LONGEST), rtol=1e-6, atol=1e-6
    )
    t, ends = run.samples.t, [*STARTS[1:], np.inf]
    for begin, end, longest in zip(STARTS, ends, LONGEST, strict=True):
        touched = (t[1:] > begin * (1 + 1e-12)) & (t[:-1] < end)
        assert np.diff(t)[touched].max() <= longest * (1 + 1e-12)
    assert np.diff(t)[t[1:] <= 3.0].max() > 0.5
    assert np.diff(t)[t[:-1] >= 8.0].max() > 0.5


def test_a_tighter_max_step_goes_before(lab: Lab) -> None:
    problem = lab.problem("harmonic", 2, 1e-3)
    options = {"bounds": (STARTS, LONGEST), "max_step": 0.1, "rtol": 1e-6, "atol": 1e-6}
    run = problem.finished_run("dop853", 20.0, (1.0, 0.0), **options)
    assert 0.099 < np.diff(run.samples.t).max() <= 0.1 * (1 + 1e-12)


def test_bounds_do_not_depend_on_how_a_run_is_cut(lab: Lab) -> None:
    def options() -> dict[str, object]:
        return {"bounds": (STARTS, LONGEST), "rtol": 1e-6, "atol": 1e-6}

    wanted = lab.problem("harmonic", 2, 1e-3).finished_run("dop853", 20.0, (1.0, 0.0), **options())
    run = lab.problem("harmonic", 2, 1e-3).run("dop853", 20.0, (1.0, 0.0), **options())
    while run.advance(0.0) is Status.RUNNING:
        run.restore(run.state())
    assert np.array_equal(run.y, wanted.y)
    assert run.statistics.steps == wanted.statistics.steps


@pytest.mark.parametrize("bounds", [([0.0, 0.0], [1.0, 1.0]), ([0.0], [0.0]), ([np.nan], [1.0])])
def test_bounds_that_make_no_sense_are_refused(
    lab: Lab, bounds: tuple[list[float], list[float]]
) -> None:
    with pytest.raises(SceneError, match="bounds"):
        lab.problem("harmonic", 2, 1.0).run("dop853", 1.0, (1.0, 0.0), bounds=bounds)
