"""Guards know the failing side of the case that belongs to them, and let its remedy be."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.atlas import cases, error_measures
from mstmm.atlas.shared_scenes import spinning_top
from mstmm.runtime.result.result import Result

#: Case -> its guard, a value of its parameter where the method holds, and one where it fails.
GUARDED = {
    "rk4-stiffness": ("step-stability", 1e6, 1e7),
    "rk4-damping": ("step-stability", 5e2, 2e3),
    "rk4-shapes": ("step-stability", 3, 9),
    "narrow-pulse": ("narrow-load", 0.3, 3e-3),
    "linear-beam": ("stiffening", 0.7, 5.0),
    "linear-weight": ("stiffening", 0.1, 3.0),
    "one-way": ("one-way-coupling", 300.0, 1.0),
    "single-frame": ("slope", 0.1, 1.0),
    "end-moment": ("shapes", 20, 2),
    "numerical-damping": ("energy-drift", 0.03, 1.5),
}

#: Whose remedy keeps more of the vibration, not all of it.
STILL_SEEN = {"numerical-damping"}


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> list[Result]:
    """Whatever a case runs from now on, nothing of which other tests have kept."""
    made, finished = list[Result](), error_measures.require_finished
    for name, module in list(sys.modules.items()):
        if name.startswith(cases.__name__):
            for one in vars(module).values():
                getattr(one, "cache_clear", lambda: None)()

    def record_run(run: Result) -> Result:
        made.append(run)
        return finished(run)

    monkeypatch.setattr(error_measures, "require_finished", record_run)
    return made


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("name", GUARDED)
def test_the_failing_side_is_known_and_the_others_are_let_be(name: str, runs: list[Result]) -> None:
    guard, holds, fails = GUARDED[name]
    (case,) = cases.select_cases([name])

    def failure_and_warning(measure: Callable[[float], float], at: float) -> tuple[bool, bool]:
        """(whether it is a failure, whether the guard reports one of its runs)."""
        runs.clear()
        try:
            bad = not measure(at) <= case.limit
        except mstmm.NumericalFailure:
            bad = True
        return bad, any(guard in {risk.name for risk in run.risks} for run in runs)

    assert failure_and_warning(case.method.measure, holds) == (False, False)
    assert failure_and_warning(case.method.measure, fails) == (True, True)
    assert failure_and_warning(case.remedy.measure, fails) == (False, name in STILL_SEEN)


@pytest.mark.parametrize("distance, told", [(0.1, False), (3e-3, True), (1e-4, True)])
def test_three_angles_at_fixed_steps(distance: float, told: bool) -> None:
    """The scene of the case gimbal-passage, with a sample at every step."""
    start = ([0.0, 0.0, distance], [np.sin(distance), np.cos(distance), 0.0])
    run = spinning_top("gimbal").simulate(2.0, "rk4", 1e-3, initial=start)
    assert ("gimbal" in {risk.name for risk in run.risks}) == told
    ball = ([np.cos(distance / 2), 0.0, 0.0, np.sin(distance / 2)], start[1])
    assert not spinning_top("ball").simulate(2.0, "rk4", 1e-3, initial=ball).risks


def test_chosen_steps_take_three_angles_nearer() -> None:
    start: Any = ([0.0, 0.0, 1e-3], [1e-3, 1.0, 0.0])
    assert not spinning_top("gimbal").simulate(2.0, initial=start).risks
