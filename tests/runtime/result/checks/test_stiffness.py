"""An implicit method is advised where it costs less, and only there."""

from __future__ import annotations

from typing import Any

import pytest

import mstmm
from mstmm.risk import Risk
from tests.support.scenes.results import motor, pins

#: A vibration that is there to stay.
VIBRATING = pins(4, [0.3, 0.3, 0.1, 0.1], stiffness=1e5, damping=0.1)


def swinging() -> mstmm.Scene:
    """Two rods that swing as one: what is stiff between them stays at rest."""
    data = pins(2, [0.8, 0.0]).model_dump(by_alias=True, exclude_unset=True)
    data["hinge"][1]["law"] = {"stiffness": 1e6, "damping": 100.0}
    return mstmm.Scene.from_data(data)


def stiffness_risks(
    scene: mstmm.Scene, t_end: float, engine: str = "looped", **how: Any
) -> list[Risk]:
    run = mstmm.compile(scene, engine=engine).simulate(t_end, **how)
    return [risk for risk in run.risks if risk.name == "stiff"]


@pytest.mark.parametrize("engine", ["looped", "fused"])
@pytest.mark.parametrize("method", ["dop853", "dopri5"])
def test_what_is_advised_saves_as_much_as_is_said(method: str, engine: str) -> None:
    how: dict[str, Any] = {"rtol": 1e-3, "atol": 1e-6}
    (risk,) = stiffness_risks(swinging(), 5.0, engine, method=method, **how)
    assert not risk.invalidates and risk.value is not None and risk.limit is not None
    assert 'method = "rodas4p2"' in risk.remedy
    run = mstmm.compile(swinging(), engine=engine).simulate(5.0, method="rodas4p2", **how)
    each = 30.0 if engine == "looped" else 60.0
    assert run.statistics is not None
    assert 0.5 < risk.limit / each / run.statistics.steps < 3.0
    assert 1.5 * each * run.statistics.steps < risk.value


@pytest.mark.parametrize("engine", ["looped", "fused"])
@pytest.mark.parametrize("method", ["dop853", "dopri5"])
def test_a_vibration_that_steps_must_follow_is_let_be(method: str, engine: str) -> None:
    """Though stability sets many of the steps."""
    model = mstmm.compile(VIBRATING, engine=engine)
    run = model.simulate(5.0, method=method, rtol=1e-3, atol=1e-6)
    assert run.statistics is not None and run.statistics.stability_limited
    assert "stiff" not in {risk.name for risk in run.risks}
    implicit = model.simulate(5.0, method="rodas4p2", rtol=1e-3, atol=1e-6)
    assert implicit.statistics is not None
    assert 30.0 * implicit.statistics.steps > run.statistics.evaluations


def test_before_a_run_the_start_is_looked_at() -> None:
    (risk,) = stiffness_risks(
        motor("0", damping=1e3), 100.0, method=mstmm.methods.Method("dop853", max_steps=100)
    )
    assert (
        risk.seen_before_run
        and "which limits dop853 to about 5e+04 steps in 100 s" in risk.description
    )


@pytest.mark.parametrize("how", [
    {"method": "auto"}, {"method": "rodas4p2"}, {"method": "rk4", "step": 1e-3},
])  # fmt: skip
def test_other_methods_are_let_be(how: dict[str, Any]) -> None:
    assert not stiffness_risks(motor("sin(t)", damping=100.0), 2.0, **how)
