"""What is seen before a run: in masses, laws, shapes, drives and loads."""

from __future__ import annotations

from typing import Any

import pytest

import mstmm
from mstmm.risk import Risk
from mstmm.runtime.integrate.settings import Settings
from mstmm.runtime.result.checks.check import RunStart
from mstmm.runtime.result.checks.run_checks import check_before_run
from tests.support.scenes.results import motor, rod


def risks_before_run(scene: mstmm.Scene, t_end: float = 10.0, **settings: Any) -> list[Risk]:
    model = mstmm.compile(scene, engine="looped", sweep="riccati")
    found = check_before_run(
        RunStart(model, Settings(t_end, **settings), *model.initial_state())
    ).risks
    assert all(risk.seen_before_run for risk in found)
    return list(found)


def chain(masses: list[float]) -> mstmm.Scene:
    hinges = [
        {"name": f"pin{i}", "type": "pin", "inboard": f"rod{i - 1}.tip" if i else "ground",
         "outboard": f"rod{i}", "initial": {"q": [0.3 + 0.4 * i]}}
        for i in range(len(masses))
    ]  # fmt: skip
    bodies = [rod(f"rod{i}", mass) for i, mass in enumerate(masses)]
    return mstmm.Scene(gravity=(0, -9.81, 0), body=bodies, hinge=hinges)


# --- masses ---------------------------------------------------------------------------------------


def test_a_heavy_tip_is_seen() -> None:
    (risk,) = risks_before_run(chain([1.0, 1.0, 1.0, 1.0, 1e11]))
    assert risk.name == "pivot-loss" and risk.element.startswith('hinge "pin')
    assert risk.value is not None and risk.value > 1e9


@pytest.mark.parametrize("root, tip", [(1.0, 1.0), (1e11, 1.0), (1.0, 1e3)])
def test_a_heavy_root_and_a_light_weight_are_let_be(root: float, tip: float) -> None:
    assert not risks_before_run(chain([root, 1.0, 1.0, 1.0, tip]))


def test_masses_that_are_alike_are_not_even_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse_call(*_: Any) -> None:
        raise AssertionError("pivots were computed")

    monkeypatch.setattr("mstmm.runtime.result.checks.conditioning.pivot_loss", refuse_call)
    assert not risks_before_run(chain([1.0, 2.0, 5.0]))


# --- angles ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("angle, drive, told", [
    (1.570796, None, True), (1.0, None, False), (0.0, "0.3*t", True), (0.0, "0.1*t", False),
])  # fmt: skip
def test_three_angles_that_begin_or_are_driven_into_their_lock(
    angle: float, drive: str | None, told: bool
) -> None:
    body = {"name": "top", "mass": 1.0, "inertia": [0.1, 0.2, 0.3]}
    rings: dict[str, Any] = {"name": "rings", "type": "gimbal", "inboard": "ground",
                             "outboard": "top"}  # fmt: skip
    how: dict[str, Any] = {"initial": {"q": [0.0, angle, 0.0]}}
    if drive is not None:
        how = {"drive": ["free", drive, "free"]}
    found = risks_before_run(mstmm.Scene(gravity=(0, 0, 0), body=[body], hinge=[rings | how]))
    assert [(risk.name, risk.element) for risk in found] == (
        [("gimbal", 'hinge "rings"')] if told else []
    )


@pytest.mark.parametrize("kind", ["elastic", "free", "ball", "fixed", "planar"])
def test_hinges_without_such_angles_are_let_be(kind: str) -> None:
    held = {"name": "held", "type": kind, "inboard": "ground", "outboard": "rod"}
    scene = mstmm.Scene(gravity=(0, 0, 0), body=[rod("rod")], hinge=[held])
    assert not risks_before_run(scene)


# --- spin -----------------------------------------------------------------------------------------


def blade(stiffening: bool, **hinge: Any) -> mstmm.Scene:
    """A beam of first frequency 3.516 rad/s at a hub."""
    beam = {"name": "blade", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 1.0,
            "modes": {"y": 2}, "frame": "tangent", "stiffening": stiffening}  # fmt: skip
    hub = {"name": "hub", "type": "pin", "inboard": "ground", "outboard": "blade", **hinge}
    return mstmm.Scene(gravity=(0, 0, 0), beam=[beam], hinge=[hub])


SPIN_UP = "0.1*t^2"  # 2 rad/s at 10 s


@pytest.mark.parametrize("stiffening", [False, True])
def test_a_linear_beam_that_will_be_spun_up(stiffening: bool) -> None:
    found = risks_before_run(blade(stiffening, drive=SPIN_UP))
    assert [risk.name for risk in found] == ([] if stiffening else ["stiffening"])
    for risk in found:
        assert risk.value == pytest.approx(2 / 3.516, rel=0.01)
        assert risk.remedy == "leave stiffening on"


def test_the_end_of_the_run_and_the_start_count() -> None:
    assert not risks_before_run(blade(False, drive=SPIN_UP), t_end=4.0)
    spinning = {"initial": {"u": [2.0]}}
    assert [
        risk.name for risk in risks_before_run(blade(False, **spinning)) if risk.invalidates
    ] == ["stiffening"]


def test_a_run_that_spins_a_linear_beam_is_refused() -> None:
    model = mstmm.compile(blade(False, drive=SPIN_UP), engine="looped")
    with pytest.raises(mstmm.RiskRefused, match='stiffening: "blade" has no geometric') as told:
        model.simulate(10.0, execution=mstmm.Execution(on_risk="refuse"))
    assert told.value.result is None


# --- frequencies ----------------------------------------------------------------------------------


@pytest.mark.parametrize("rate, told", [(10.0, False), (60.0, True)])
def test_a_drive_faster_than_the_shapes(rate: float, told: bool) -> None:
    """Two shapes: 3.5 and 22 rad/s."""
    found = risks_before_run(blade(True, drive=f"0.001*sin({rate}*t)"))
    assert [(risk.name, risk.element, risk.invalidates) for risk in found] == (
        [("shapes", '"blade"', False)] if told else []
    )


@pytest.mark.parametrize("damping, method, told", [
    (1e3, "dop853", True), (1e3, "auto", False), (1e3, "rodas4p2", False), (1.0, "dop853", False),
])  # fmt: skip
def test_a_damper_that_explicit_steps_must_follow(damping: float, method: str, told: bool) -> None:
    """A rod of 1/3 kg m2: 3000 1/s over 10 s."""
    found = risks_before_run(motor("0", damping=damping), method=method)
    assert [(risk.name, risk.invalidates) for risk in found] == ([("stiff", False)] if told else [])


# --- loads ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("step, told", [(0.1, True), (1e-4, False), (None, False)])
def test_a_pulse_that_fixed_steps_pass_over(step: float | None, told: bool) -> None:
    scene = motor("exp(-((t - 5)/0.001)^2)")
    method = "dop853" if step is None else "rk4"
    found = risks_before_run(scene, method=method, step=step)
    assert [risk.name for risk in found] == (["narrow-load"] if told else [])


# --- loops ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("speeds, told", [((8, 0, 0, 0), True), ((8, -8, 8, 8), False)])
def test_a_start_from_which_a_mechanism_can_go_on_two_ways(
    speeds: tuple[float, ...], told: bool
) -> None:
    """A parallelogram with all rods in line: it may stay one, or cross."""
    hinges: list[dict[str, Any]] = [
        {"name": "foot", "inboard": "ground", "outboard": "crank"},
        {"name": "knee", "inboard": "crank.tip", "outboard": "coupler"},
        {"name": "end", "inboard": "ground", "outboard": "rocker", "position": [1, 0, 0]},
        {"name": "top", "inboard": "coupler.tip", "outboard": "rocker.tip"},
    ]
    given = [
        hinge | {"type": "pin", "initial": {"u": [speed]}}
        for hinge, speed in zip(hinges, speeds, strict=True)
    ]
    bodies = [rod(name) for name in ("crank", "coupler", "rocker")]
    found = risks_before_run(mstmm.Scene(gravity=(0, -9.81, 0), body=bodies, hinge=given))
    assert [risk.name for risk in found] == (["branching-start"] if told else [])
