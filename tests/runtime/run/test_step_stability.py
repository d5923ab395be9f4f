"""Fixed steps beside a stiff spring or a strong damper: stable below the limit, not above it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.integrate.settings import Settings
from mstmm.runtime.result import result_record
from mstmm.runtime.run.step_stability import check_step
from tests.support.scenes.rods import ROD, chain

#: RK4 is stable for h w below 2 sqrt 2 on the imaginary axis, for h |lambda| below 2.785 on the
#: real one: |1 + z + z^2/2 + z^3/6 + z^4/24| = 1.
IMAGINARY, REAL = 2 * np.sqrt(2), 2.785293563405282

#: Inertia of the rod about the pin.
MU = ROD + 0.25


def rod(stiffness: float, damping: float) -> mstmm.Model:
    scene = chain(["pin"], gravity=(0, 0, 0))
    scene["hinge"][0]["law"] = {"stiffness": stiffness, "damping": damping}
    scene["hinge"][0]["initial"] = {"q": [1e-3], "u": [0.0]}
    return mstmm.compile(mstmm.Scene(**scene))


def growth(model: mstmm.Model, step: float, steps: int = 400) -> float:
    """Size of the last 20 samples over the first 20, each component against its own largest."""
    times = np.arange(steps + 1) * step
    result = model.simulate(times[-1], "rk4", step=step, output_times=times)
    size = np.abs(result.q[:, 0])
    return float(size[-20:].max() / size[:20].max())


@pytest.mark.parametrize("stiffness", [1e2, 1e5, 1e8])
def test_limit_of_an_undamped_spring(stiffness: float) -> None:
    limit = IMAGINARY / np.sqrt(stiffness / MU)
    model = rod(stiffness, 0.0)
    assert growth(model, 0.95 * limit) < 1.0
    assert growth(model, 1.05 * limit) > 1e6


@pytest.mark.parametrize("ratio", [1.0, 5.0])
@pytest.mark.parametrize("stiffness", [1e2, 1e6])
def test_limit_of_a_damped_spring(stiffness: float, ratio: float) -> None:
    rate = np.sqrt(stiffness / MU)
    fastest = rate * (ratio + np.sqrt(ratio**2 - 1))
    model = rod(stiffness, 2 * ratio * rate * MU)
    assert growth(model, 0.95 * REAL / fastest) < 1.0
    assert growth(model, 1.05 * REAL / fastest) > 1e3


@pytest.mark.parametrize(("part", "warns"), [(0.5, False), (0.95, False), (1.05, True)])
def test_a_step_near_the_limit_brings_a_warning(part: float, warns: bool) -> None:
    model = rod(1e6, 0.0)
    step = part * IMAGINARY / np.sqrt(1e6 / MU)
    result = model.simulate(20 * step, "rk4", step=step)
    named = [text for text in result.warnings if "hinge0" in text and "too long" in text]
    assert bool(named) == warns


@pytest.mark.parametrize("ratio", [0.0, 0.2, 1.0, 3.0])
@pytest.mark.parametrize("method", ["rk4", "dopri5", "dop853", "pirk13"])
def test_every_method_is_judged_by_its_own_limit_in_the_direction_of_the_motion(
    method: str, ratio: float
) -> None:
    """The run itself says where it grows: by 1.1 at least, or not."""
    rate, t_end = np.sqrt(1e4 / MU), 4.0
    model = rod(1e4, 2 * ratio * rate * MU)
    q, u = model.initial_state()
    some = check_step(model.looped, Settings(t_end, method=method, step=1e-3), q, u)
    assert some is not None
    for part, warns in (0.97, False), (1.03, True):
        run = model.simulate(t_end, method, part * some.stable_step)
        assert ("step-stability" in {risk.name for risk in run.risks}) == warns
        assert (np.abs(run.q[-20:, 0]).max() > 1.1 * np.abs(q[0])) == warns


@pytest.mark.parametrize("stiff", [0, 1, 2])
@pytest.mark.parametrize("law", ["stiffness", "damping"])
def test_the_warning_names_the_stiff_hinge(law: str, stiff: int) -> None:
    """Not a loose neighbour, though that moves more."""
    scene = chain(["pin", "ball", "pin"], 0.4, masses=[3.0, 1.0, 0.2])
    for number, hinge in enumerate(scene["hinge"]):
        value = 1e6 if number == stiff else 10.0
        hinge["law"] = {law: [value] * (3 if hinge["type"] == "ball" else 1)}
    result = mstmm.compile(mstmm.Scene(**scene)).simulate(0.02, "rk4", step=0.01)
    named = [text for text in result.warnings if "too long" in text]
    assert named
    assert f'hinge "hinge{stiff}"' in named[0]


def test_an_adaptive_run_takes_the_stiff_spring() -> None:
    model = rod(1e6, 0.0)
    times = np.linspace(0, 0.05, 30)
    result = model.simulate(times[-1], rtol=1e-10, atol=1e-14, output_times=times)
    expected = 1e-3 * np.cos(np.sqrt(1e6 / MU) * times)
    assert np.abs(result.q[:, 0] - expected).max() < 1e-11
    assert not result.warnings


@pytest.mark.parametrize("hinge", ["fixed", "pin"])
def test_a_failure_of_a_step_that_is_too_long_is_put_down_to_the_step(hinge: str) -> None:
    """What such a run runs into says nothing of the scene; and a beam is not called a hinge."""
    beam = {"name": "rod", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 50.0,
            "modes": {"y": 3}}  # fmt: skip
    holds = {"name": "wall", "type": hinge, "inboard": "ground", "outboard": "rod"}
    tip = {"name": "tip", "mass": 0.1, "inertia": [1e-4, 1e-4, 1e-4]}
    weld = {"name": "weld", "type": "fixed", "inboard": "rod.tip", "outboard": "tip"}
    scene = mstmm.Scene(gravity=(0, -9.81, 0), beam=[beam], body=[tip], hinge=[holds, weld])
    model = mstmm.compile(scene)
    fine = model.simulate(0.01, method="rk4", step=1e-5).certificate.step_stability
    assert fine is not None
    result = model.simulate(5.0, method="rk4", step=39 * fine.stable_step)
    assert not result.success
    assert result.message.startswith("step = ")
    assert 'flexible body "rod"' in result.message
    assert "last good state at t =" in result.message
    assert "split the body" not in result.message
    assert "shapes" not in result.message


def test_limit_of_a_spring_on_geared_rods() -> None:
    """The second rod turns -1/2 as fast and adds a quarter of its inertia to that of the first."""
    rods = [{"name": name, "mass": 1.0, "center_of_mass": [0.5, 0, 0],
             "inertia": [ROD, ROD, ROD]} for name in ("first", "second")]  # fmt: skip
    pins: list[dict[str, Any]] = [
        {"name": f"pin_{rod['name']}", "type": "pin", "outboard": rod["name"], "inboard": "ground",
         "position": [k, 0, 0]}
        for k, rod in enumerate(rods)
    ]  # fmt: skip
    pins[0]["law"] = {"stiffness": 1e6}
    gear = {"expression": "pin_first.angle + 2*pin_second.angle"}
    scene = mstmm.Scene(gravity=(0, 0, 0), body=rods, hinge=pins, coupling=[gear])
    model = mstmm.compile(scene, engine="looped")
    rate = np.sqrt(1e6 / (1.25 * MU))
    found = check_step(
        model.looped, Settings(t_end=1.0, method="rk4", step=3.0 / rate), *model.initial_state()
    )
    assert found is not None and found.risk is not None
    assert found.hinge == "pin_first"
    assert found.rate == pytest.approx(rate, rel=1e-6)
    assert found.stable_step == pytest.approx(IMAGINARY / rate, rel=1e-2)


def test_a_step_too_long_is_told_first_of_a_loop_with_a_beam() -> None:
    """A four-bar linkage whose coupler bends; what the beam runs into is the step's doing."""
    bodies = [
        {"name": "crank", "mass": 1.0, "center_of_mass": [0.1, 0, 0],
         "inertia": [1e-3, 1e-2, 1e-2], "ends": {"tip": [0.2, 0, 0]}},
        {"name": "rocker", "mass": 1.0, "center_of_mass": [0.4, 0, 0],
         "inertia": [1e-2, 0.1, 0.1], "ends": {"tip": [0.8, 0, 0]}},
    ]  # fmt: skip
    coupler = {"name": "coupler", "length": 1.0, "mass_per_length": 1.0,
               "bending_stiffness": 2e3, "modes": {"y": 2}}  # fmt: skip
    ends = (("ground", "crank", 1.2), ("crank.tip", "coupler", -0.9), ("ground", "rocker", 1.5),
            ("coupler.tip", "rocker.tip", 0.0))  # fmt: skip
    pins: list[dict[str, Any]] = [
        {"name": f"pin{k}", "type": "pin", "inboard": near, "outboard": far,
         "initial": {"q": [angle]}}
        for k, (near, far, angle) in enumerate(ends)
    ]  # fmt: skip
    pins[2]["position"] = [1.0, 0, 0]
    del pins[3]["initial"]
    scene = mstmm.Scene(gravity=(0, -9.81, 0), body=bodies, beam=[coupler], hinge=pins)
    run = mstmm.compile(scene, engine="looped").simulate(1.0, "rk4", step=0.02)
    assert not run.success
    assert run.message.startswith("step = 0.02 s is too long")
    assert "the run with it ended" in run.message


def test_a_step_that_becomes_too_long_is_said_first() -> None:
    """Nothing moves at the start of a double pendulum; what the step drives it to, numbers that
    are not finite or at which no hinge is determined, is not of the scene."""
    scene = mstmm.Scene(**chain(["pin", "pin"], gravity=(0, -9.81, 0)))
    run = mstmm.compile(scene, engine="looped").simulate(4.0, "rk4", step=0.4)
    assert not run.success
    assert run.certificate.step_stability is None
    assert run.message.startswith("step = 0.4 s is too long for the fastest motion at t = ")
    assert "; the run with it ended: " in run.message


def test_a_run_costs_no_look_at_its_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is looked at when somebody asks for what speaks against the numbers, once."""
    calls = []

    def record_check(*given: Any) -> Any:
        calls.append(given)
        return check_step(*given)

    monkeypatch.setattr(result_record, "check_step", record_check)
    run = rod(4e4, 0.0).simulate(0.2, method="rk4", step=0.05)
    assert run.success and not calls
    assert any("too long for the fastest motion" in text for text in run.warnings)
    assert run.certificate.step_stability is not None and not run.trusted and len(calls) == 1
