"""What balances are held to follows from how the steps were controlled, and so does the remedy."""

from __future__ import annotations

import re
from typing import Any

import pytest

import mstmm
from mstmm.risk import Risk
from mstmm.runtime.result.certificate_data import MAX_DRIFT, StepControl
from tests.support.scenes.results import motor, pins


def drift(angles: list[float], t_end: float = 5.0, **how: Any) -> Risk | None:
    """The energy's, of rods that swing widely; None where it is kept."""
    run = mstmm.compile(pins(len(angles), angles), engine="looped").simulate(t_end, **how)
    return next((risk for risk in run.risks if risk.name == "energy-drift"), None)


ONE, TWO = [1.5], [1.5, 0.3]


@pytest.mark.parametrize(("angles", "method", "step"), [
    (ONE, "rk4", 0.2), (ONE, "dopri5", 0.2), (ONE, "dop853", 0.5), (ONE, "genalpha", 0.05),
    (ONE, "esdirk436", 0.3), (ONE, "rodas4p2", 0.2), (ONE, "dttmm-classical", 0.02),
    (TWO, "rk4", 0.05), (TWO, "dopri5", 0.1), (TWO, "genalpha", 0.02), (TWO, "rodas4p2", 0.1),
])  # fmt: skip
def test_the_step_that_is_named_would_do(angles: list[float], method: str, step: float) -> None:
    risk = drift(angles, method=method, step=step)
    assert risk is not None and risk.limit == MAX_DRIFT
    found = re.search(r"use a step below (\S+) s", risk.remedy)
    assert found is not None and 0.005 * step < float(found[1]) < step
    assert drift(angles, method=method, step=float(found[1])) is None


@pytest.mark.parametrize("method", ["dop853", "dopri5", "rodas4p2", "scipy-RK45"])
@pytest.mark.parametrize("rtol", [1e-2, 3e-3])
def test_the_tolerances_that_are_named_would_do(method: str, rtol: float) -> None:
    risk = drift(TWO, 20.0, method=method, rtol=rtol, atol=rtol)
    assert risk is not None and risk.limit == MAX_DRIFT
    found = re.search(r"rtol = (\S+) and atol = (\S+), or less", risk.remedy)
    assert found is not None
    assert drift(TWO, 20.0, method=method, rtol=float(found[1]), atol=float(found[2])) is None


@pytest.mark.parametrize(("rtol", "bound"), [
    (1e-9, 1e-5), (1e-6, 1e-5), (1e-5, 1e-4), (1e-3, MAX_DRIFT),
])  # fmt: skip
def test_loose_tolerances_are_held_to_what_they_leave(rtol: float, bound: float) -> None:
    given = StepControl(None, rtol, rtol / 1e3, 8)
    assert given.bound == pytest.approx(bound)
    run = mstmm.compile(pins(1, [1.0]), engine="looped").simulate(5.0, rtol=rtol, atol=rtol / 1e3)
    assert run.certificate.step_control.bound == pytest.approx(bound)
    assert f"balances within {bound:g}" in run.certificate.verdict().bounds


def test_a_wanted_error_is_what_balances_are_held_to() -> None:
    run = mstmm.compile(pins(1, [1.0]), engine="looped").simulate(5.0, error=1e-3)
    assert run.certificate.step_control.bound == 1e-3
    text = run.certificate.step_control.finer(0.01)
    assert text == "request an error below 2e-07"


def test_where_no_tolerance_would_do_something_else_is_wrong() -> None:
    assert "unbounded values" in StepControl(None, 1e-9, 1e-12, 8).finer(0.5)


@pytest.mark.parametrize(("stiffer", "told"), [("-100*t*q", True), ("-10*t*q", False)])
def test_a_step_that_becomes_too_long_is_named_with_its_time(stiffer: str, told: bool) -> None:
    """The spring of a rod of 1/3 kg m2 stiffens: h omega = 0.05 sqrt(300 t) is 2.83 at 10.7 s."""
    run = mstmm.compile(motor(stiffer, speed=1.0), engine="looped").simulate(16.0, "rk4", 0.05)
    rows = [risk for risk in run.risks if risk.name == "step-stability"]
    assert bool(rows) == told
    for risk in rows:
        assert risk.element == 'hinge "motor"' and not risk.seen_before_run
        assert risk.limit == pytest.approx(2.83, abs=0.03)
        found = re.search(r"at t = (\S+) s", risk.description)
        assert found is not None and 10.7 < float(found[1]) < 13.0
