"""Expressions of the state that switch: the step ends there, however narrow the window."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.integrate.c_loop import Samples, Status
from mstmm.runtime.integrate.settings import Settings
from mstmm.runtime.run.integration_run import make_run
from mstmm.runtime.run.scene_system import SceneSystem

METHODS = ("dopri5", "dop853", "pirk13", "scipy-RK45", "scipy-DOP853")

MASS = {"name": "m", "mass": 1.0, "inertia": [1, 1, 1]}
RAIL = {
    "name": "h", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground", "outboard": "m",
}  # fmt: skip


def scene(effort: str, q: float = 0.0, u: float = 1.0, **more: Any) -> mstmm.Scene:
    """One kilogram on a rail under an effort of its state."""
    hinge = RAIL | {"initial": {"q": [q], "u": [u]}, "law": {"effort": effort}}
    return mstmm.Scene.from_data({"gravity": [0, 0, 0], "body": [MASS], "hinge": [hinge]} | more)


def simulate_effort(
    effort: str, t_end: float, q: float = 0.0, u: float = 1.0, **options: Any
) -> mstmm.Result:
    return mstmm.compile(scene(effort, q, u), engine="looped").simulate(t_end, **options)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("width", [0.1, 1e-4])
def test_a_wall_turns_the_mass_back(method: str, width: float) -> None:
    push = 2.0 / width  # stops 1 m/s after a quarter of the wall
    wall = f"where(q > 5, where(q < 5 + {width}, -{push}, 0), 0)"
    result = simulate_effort(wall, 10.0, method=method)
    inside = 2 / push
    assert result.success
    assert result.u[-1, 0] == pytest.approx(-1.0, abs=3e-6)
    assert result.q[-1, 0] == pytest.approx(inside, abs=2e-5)
    assert result.statistics is not None and result.statistics.switch_crossings == 2


@pytest.mark.parametrize("method", ["dop853", "scipy-RK45"])
@pytest.mark.parametrize(
    "window",
    [
        "where(abs(q - 5) < 0.001, -{0}, 0)",
        "where((q - 5)^2 < 0.000001, -{0}, 0)",
        "-{0}*max(0, sign(q - 4.999)*sign(5.001 - q))",
    ],
)
def test_a_thin_window_slows_the_mass_down(method: str, window: str) -> None:
    result = simulate_effort(window.format(100.0), 10.0, method=method)
    speed = np.sqrt(1 - 2 * 100.0 * 0.002)
    assert result.u[-1, 0] == pytest.approx(speed, abs=1e-6)


def test_a_thin_bump_without_jumps_is_met() -> None:
    result = simulate_effort("-1e5*max(0, 0.001 - abs(q - 5))", 10.0)
    assert result.u[-1, 0] == pytest.approx(np.sqrt(1 - 2 * 1e5 * 1e-6), abs=1e-7)


@pytest.mark.parametrize("step", [0.1, 0.0103])
def test_fixed_steps_meet_the_wall_too(step: float) -> None:
    result = simulate_effort(
        "where(q > 5, where(q < 5.1, -20, 0), 0)", 10.0, method="rk4", step=step
    )
    assert result.u[-1, 0] == pytest.approx(-1.0, abs=1e-9)


def test_samples_beside_a_switch_are_those_of_their_side() -> None:
    times = np.linspace(0, 6, 601)
    result = simulate_effort("where(q > 5, -1, 0)", 6.0, output_times=times)
    late = np.maximum(times - 5, 0)
    np.testing.assert_allclose(result.q[:, 0], times - late**2 / 2, atol=1e-9)
    np.testing.assert_allclose(result.u[:, 0], 1 - late, atol=1e-9)


def spring_scene(effort: str) -> mstmm.Scene:
    hinge = RAIL | {"initial": {"q": [1.0], "u": [1.0]}}
    spring = {"name": "s", "from": "ground", "to": "m", "position": [0, 0, 0],
              "law": {"effort": effort}}  # fmt: skip
    return mstmm.Scene.from_data(
        {"gravity": [0, 0, 0], "body": [MASS], "hinge": [hinge], "spring": [spring]}
    )


def test_the_length_of_a_spring_switches_too() -> None:
    model = mstmm.compile(spring_scene("where(q > 5, where(q < 5.1, -20, 0), 0)"), engine="looped")
    result = model.simulate(10.0)
    assert result.u[-1, 0] == pytest.approx(-1.0, abs=1e-6)


@pytest.mark.parametrize("method", ["dop853", "dopri5", "rk4", "scipy-RK45"])
@pytest.mark.parametrize("when", ["abs(h.q - 5) < 0.001", "max(h.q - 5.001, 4.999 - h.q) < 0"])
def test_an_event_at_a_narrow_peak_is_found(method: str, when: str) -> None:
    events: dict[str, Any] = {"event": [{"name": "there", "when": when, "do": "stop"}]}
    step = 0.25 if method == "rk4" else None
    model = mstmm.compile(scene("0", **events), engine="looped")
    result = model.simulate(10.0, method=method, step=step)
    assert result.status is Status.STOPPED
    assert result.q[-1, 0] == pytest.approx(4.999, abs=1e-9)


@pytest.mark.parametrize("method", ["dop853", "dopri5"])
def test_a_motion_that_sticks_ends_with_a_reason(method: str) -> None:
    result = simulate_effort(
        "-10*sign(u) + 3*sin(t)", 10.0, u=0.3, method=method, output_times=[0.0, 10.0]
    )
    assert result.status is Status.TOO_MANY_STEPS and not result.success
    assert "no end in sight" in result.message
    assert "'sign(u)' (effort of hinge \"h\") chatters" in result.message
    assert result.trajectory.last_state is not None
    assert result.trajectory.last_state[0] == pytest.approx(0.0300, abs=2e-3)


def test_a_limit_of_steps_is_the_only_one() -> None:
    result = simulate_effort(
        "-10*sign(u)", 10.0, u=0.3, method=mstmm.methods.Method(max_steps=9000)
    )
    assert result.status is Status.TOO_MANY_STEPS and "more steps than allowed" in result.message
    assert any("chatters" in text for text in result.warnings)


def test_switches_passed_in_turn_are_all_met() -> None:
    """A relay drives the mass to and fro: the period is known."""
    result = simulate_effort("-sign(q)", 16.0, q=0.5, u=0.0)
    assert result.q[-1, 0] == pytest.approx(0.5 - 0.0, abs=1e-7)  # four periods of 4 s
    assert result.statistics is not None and result.statistics.switch_crossings == 8


def test_batches_meet_walls_as_single_runs_do() -> None:
    model = mstmm.compile(scene("where(q > 5, where(q < 5.1, -20, 0), 0)"), engine="looped")
    batch = model.simulate_batch(([[0.0], [0.5]], [[1.0]]), t_end=10.0)
    np.testing.assert_allclose(batch.u[:, -1, 0], -1.0, atol=1e-6)


def test_scenes_that_do_not_switch_have_nothing_to_watch() -> None:
    model = mstmm.compile(scene("-3*q - 0.1*u*sin(t)"), engine="looped")
    result = model.simulate(2.0)
    assert result.statistics is not None and result.statistics.switch_crossings == 0
    assert SceneSystem(model.looped).run.n_switches == 0


def test_a_run_is_cut_anywhere_bit_for_bit() -> None:
    model = mstmm.compile(scene("-sign(q)*where(q < 0.3, 1, 2) - 0.1*abs(u)*u"), engine="looped")
    settings = Settings(7.0, output_times=tuple(np.linspace(0, 7, 50).tolist()))
    systems = [SceneSystem(model.looped)]
    whole = make_run(systems[0], settings, *model.initial_state())
    assert whole.advance(np.inf) is Status.FINISHED
    systems.append(SceneSystem(model.looped))
    run = make_run(systems[1], settings, *model.initial_state())
    rows = []
    while run.advance(0.0) is Status.RUNNING:
        rows.append(run.take_samples())
        state = run.state()
        systems.append(SceneSystem(model.looped))
        run = make_run(systems[-1], settings, *model.initial_state())
        run.restore(state)
    assert whole.statistics.switch_crossings > 5 and len(rows) > 50
    assert np.array_equal(Samples.join([*rows, run.samples]).y, whole.samples.y)
    assert run.statistics == whole.statistics


def test_scipys_methods_end_where_a_motion_sticks() -> None:
    result = simulate_effort(
        "-10*sign(u)", 10.0, u=0.3, method="scipy-RK45", output_times=[0.0, 10.0]
    )
    assert result.status is Status.TOO_MANY_STEPS
    assert "'sign(u)' (effort of hinge \"h\") chatters" in result.message


def test_many_conditions_are_watched_up_to_a_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mstmm.runtime.packing.event_functions.MAX_SWITCHES", 1)
    monkeypatch.setattr("mstmm.runtime.run.scene_system.MAX_SWITCHES", 1)
    monkeypatch.setattr("mstmm.runtime.result.checks.run_checks.MAX_SWITCHES", 1)
    result = simulate_effort("where(q > 1, where(q < 2, 0.1, 0), 0)", 1.0)
    assert any("more than 1 conditions depend on the motion" in text for text in result.warnings)


#: Methods that end where a motion sticks, by the status they end with; houbolt and wilson take
#: fixed steps.
STICKING = [
    *((method, None) for method in ("rodas4", "kvaerno5", "esdirk436", "genalpha", "hht")),
    *((method, 0.01) for method in ("kvaerno5", "genalpha", "newmark", "wilson", "houbolt")),
]


@pytest.mark.parametrize("method, step", STICKING)
@pytest.mark.parametrize("effort", ["-sign(u)", "sin(t) - 2*sign(u)"])
def test_implicit_methods_name_what_a_motion_sticks_to(
    effort: str, method: str, step: float | None
) -> None:
    result = simulate_effort(
        effort, 5.0, u=0.3, method=mstmm.methods.Method(method, max_steps=5000), step=step
    )
    assert result.status in (Status.TOO_MANY_STEPS, Status.NOT_CONVERGED), result.message
    words = ("switches there", "chatters from")
    assert any(f"'sign(u)' (effort of hinge \"h\") {x}" in result.message for x in words)
    assert result.message.count("make it smooth") == 1


def test_a_switch_far_from_the_end_is_not_blamed() -> None:
    result = simulate_effort(
        "-1e-3*sign(u) - q", 50.0, u=1.0, method=mstmm.methods.Method("kvaerno5", max_steps=20)
    )
    assert result.status is Status.TOO_MANY_STEPS and "sign(u)" not in result.message
