"""Fixed steps of implicit methods that are far too long say so, with a step that is not."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.integrate.steppers import IMPLICIT, get
from mstmm.runtime.result.result import Result
from tests.support.scenes.results import motor, pins, rod

ESTIMATING = [method for method in IMPLICIT if get(method).adaptive]


def simulate_rods(step: float, method: str | mstmm.methods.Method, **more: Any) -> Result:
    """Two rods that swing from near the horizontal."""
    model = mstmm.compile(pins(2, [-0.3, 0.2]), engine="looped")
    return model.simulate(2.0, method, step, **more)


def step_warnings(result: Result) -> list[str]:
    return [text for text in result.warnings if "too long for the motion" in text]


@pytest.mark.parametrize("method", ["genalpha", "dttmm", "hht", "newmark", "rodas4", "rodas4p2"])
def test_a_step_that_misses_the_motion_is_named_with_one_that_does_not(method: str) -> None:
    step = 0.15 if get(method).order == 2 else 0.1
    (text,) = step_warnings(simulate_rods(step, method))
    assert text.startswith(f"step = {step} s is too long for the motion")
    found = re.search(r"steps (\d+)% of the distance .* use a step below ([\d.]+) s", text)
    assert found is not None
    assert int(found[1]) >= 2
    shorter = float(found[2])
    assert step / 10 < shorter < step
    assert not step_warnings(
        simulate_rods(0.9 * shorter, method, output_times=np.linspace(0.0, 2.0, 41))
    )


@pytest.mark.parametrize("method", ESTIMATING)
def test_a_step_that_resolves_the_motion_is_not(method: str) -> None:
    result = simulate_rods(0.01, method)
    assert result.success
    assert not step_warnings(result)


@pytest.mark.parametrize("method", ["genalpha", "wilson", "rodas4p2"])
def test_a_step_longer_than_the_run_is_named(method: str) -> None:
    words = "is longer than the run"
    assert any(words in text for text in simulate_rods(2.1, method).warnings)
    assert not any(words in text for text in simulate_rods(2.0, method).warnings)


def test_the_length_of_a_run_does_not_matter() -> None:
    # What is damped and driven forgets its errors, however many there are.
    scene = motor("3*sin(2*t)", stiffness=5.0, damping=0.5)
    model = mstmm.compile(scene, engine="looped")
    result = model.simulate(200.0, "genalpha", 0.1, output_times=np.arange(0.0, 200.1, 0.1))
    assert result.statistics is not None
    assert result.statistics.sum_of_local_errors is not None
    assert result.statistics.sum_of_local_errors > 0.05 * np.ptp(result.q)
    assert not step_warnings(result)


def test_energies_are_no_errors_of_the_motion() -> None:
    # Where everything is driven nothing is left to err but the work, and that is in J.
    heavy = rod("rod", mass=1e9)
    hinge = {"name": "motor", "type": "pin", "inboard": "ground", "outboard": "rod",
             "drive": "0.5*sin(3*t)"}  # fmt: skip
    scene = mstmm.Scene(gravity=(0, 0, 0), body=[heavy], hinge=[hinge])
    model = mstmm.compile(scene, engine="looped")
    for method in ("genalpha", "rodas4p2"):
        result = model.simulate(1.0, method, 0.1)
        assert np.ptp(result.work) > 1e8
        assert result.statistics is not None
        assert result.statistics.sum_of_local_errors == 0.0
        assert not step_warnings(result)


def test_what_rests_is_not_said_to_be_missed() -> None:
    result = mstmm.compile(pins(2, [-np.pi / 2, 0.0]), engine="looped").simulate(
        1.0, "genalpha", 0.5
    )
    assert result.success
    assert not step_warnings(result)


def test_a_longest_step_beside_a_fixed_one_is_refused() -> None:
    with pytest.raises(mstmm.SceneError, match=r"max_step = 0\.1: .* step = 0\.01 fixes all steps"):
        simulate_rods(0.01, mstmm.methods.Method("genalpha", max_step=0.1))
    assert simulate_rods(0.01, mstmm.methods.Method("genalpha", max_step=np.inf)).success
