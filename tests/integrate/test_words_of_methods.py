"""What messages say of a method is true of it."""

from __future__ import annotations

from functools import cache

import pytest

import mstmm
from mstmm.runtime.integrate.loop import Failure, Status, failure_text
from mstmm.runtime.integrate.steppers import BUILT_IN, EXPLICIT, get
from mstmm.runtime.model.model import Model

ADAPTIVE = [method for method in BUILT_IN if get(method).adaptive]


@cache
def runaway() -> Model:
    """u' = u^3 from u = 1 is infinite at t = 0.5 s."""
    hinge = {"name": "rail", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground",
             "outboard": "mass", "law": {"effort": "u^3"}, "initial": {"u": [1.0]}}  # fmt: skip
    body = {"name": "mass", "mass": 1.0}
    return mstmm.compile(
        mstmm.Scene(gravity=(0, 0, 0), body=[body], hinge=[hinge]), engine="looped"
    )


@pytest.mark.parametrize("method", ADAPTIVE)
def test_explicit_methods_alone_are_called_explicit(method: str) -> None:
    run = runaway().simulate(1.0, method)
    assert run.status is Status.STEP_TOO_SMALL and "the motion may be singular or" in run.message
    assert ("too stiff for an explicit method" in run.message) == (method in EXPLICIT)
    assert run.last_state[0] == pytest.approx(0.5, abs=1e-5)


@pytest.mark.parametrize("implicit", [False, True])
def test_no_end_in_sight(implicit: bool) -> None:
    text = failure_text(Failure(Status.TOO_MANY_STEPS, 1.0, None, None, 1), implicit=implicit)
    assert ("too stiff" in text) == (not implicit) and "sticks" in text
