"""Operating points that move: what lasts, what changes along the motion, what is refused."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import NumericalFailure, SceneError
from tests.support.scenes.linear import pendulum

SPIN, MASS, STIFF, DAMPING = 3.0, 2.0, 200.0, 2.0
SOLID = {"inertia": [0.1, 0.1, 0.1]}


def compile_tables(**scene: Any) -> mstmm.Model:
    return mstmm.compile(mstmm.Scene(**{"gravity": (0, 0, 0), **scene}), engine="looped")


def turntable(drive: str = "3*t", on: str = "ground", **more: Any) -> mstmm.Model:
    """A slider on a spring along a table that turns about z, on the ground or on a mount."""
    rail = {"type": "prismatic", "axis": [1, 0, 0],
            "law": {"stiffness": STIFF, "damping": DAMPING}}  # fmt: skip
    table = {"name": "turn", "type": "pin", "inboard": on, "outboard": "table"}
    bodies = [{"name": "mount", "mass": 5.0, **SOLID}] if on == "mount" else []
    hinges = [rail | {"name": "spring", "inboard": "ground", "outboard": "mount"}] if bodies else []
    return compile_tables(
        body=[*bodies, {"name": "table", "mass": 1.0, **SOLID},
              {"name": "slider", "mass": MASS, **SOLID}],
        hinge=[*hinges, table | ({"drive": drive} if drive else {}),
               rail | {"name": "rail", "inboard": "table", "outboard": "slider"}],
        **more,
    )  # fmt: skip


def test_what_turns_along_answers() -> None:
    """m x'' + c x' + (k - m W^2) x = F in axes of the table."""
    omega, model = np.array([1.0, 9.0, 20.0]), turntable()
    found = model.frequency_response(omega, ["rail.effort"], ["rail.displacement"])
    expected = 1 / (STIFF - MASS * SPIN**2 - MASS * omega**2 + 1j * omega * DAMPING)
    np.testing.assert_allclose(found.response[:, 0, 0], expected, rtol=1e-12)
    assert found.trusted and model.modes().trusted and model.equilibrium().trusted
    assert not model.linearize().warnings
    along = model.frequency_response(omega, ["ground.acceleration.z"], ["rail.displacement"])
    assert not along.response.any()


@pytest.mark.parametrize("drive", ["3*t", ""])
def test_what_goes_round_is_refused_by_name(drive: str) -> None:
    """A force in axes of the ground on a table that is driven, or turns freely."""
    model = turntable(drive)
    linear = model.linearize([0.0, 0.0], [SPIN, 0.0], inputs=["rail.effort", "slider.force.x"])
    with pytest.raises(SceneError, match=r"motion of this state: slider\.force\.x, so"):
        linear.frequency_response([2.0], outputs=["rail.displacement"])
    with pytest.raises(SceneError, match=r"motion of this state: slider\.position\.x, so"):
        linear.frequency_response([2.0], ["rail.effort"], ["slider.x"])
    with pytest.raises(
        SceneError, match=r"motion of this state: ground\.acceleration\.x, .*\.y, so"
    ):
        model.linearize([0.0, 0.0], [SPIN, 0.0]).frequency_response([2.0])
    with pytest.raises(SceneError, match=r"no constant matrix gives slider\.position\.x"):
        linear.output_matrices(["rail.displacement", "slider.x"])
    assert linear.output_matrices(["rail.displacement"])[0].any()
    assert not linear.trusted
    assert any("the effect of slider.force.x changes" in text for text in linear.warnings)
    assert not any("rail.effort" in text for text in linear.warnings)


def test_only_what_is_asked_counts() -> None:
    """Forces in axes of the ground beside an effort of a hinge; along y of the table, at the angle
    0, the slider cannot move, but later it does."""
    inputs = ["slider.force.x", "slider.force.y", "rail.effort", "table.moment.z"]
    linear = turntable().linearize(inputs=inputs)
    assert [(risk.name, risk.element) for risk in linear.risks] == [
        ("changing-input", 'input "slider.force.x"'),
        ("changing-input", 'input "slider.force.y"'),
        ("input-without-effect", 'input "table.moment.z"'),
    ]
    found = linear.frequency_response([2.0], ["rail.effort"], ["rail.displacement"])
    assert found.trusted and not found.risks
    expected = 1 / (STIFF - MASS * SPIN**2 - MASS * 4 + 2j * DAMPING)
    assert found.response[0, 0, 0] == pytest.approx(expected, rel=1e-12)
    idle = linear.frequency_response([2.0], ["table.moment.z"], ["rail.displacement"])
    assert [risk.name for risk in idle.risks] == ["input-without-effect"]


def test_matrices_that_depend_on_the_angle() -> None:
    """The table on a mount that moves along x: their inertia is coupled by m cos(W t)."""
    model = turntable(on="mount")
    linear = model.linearize(inputs=["spring.effort"], disturbances=[])
    (text,) = linear.warnings
    assert "the matrices change along the motion" in text
    assert not linear.trusted and not model.modes().trusted
    with pytest.raises(SceneError, match="the matrices, so that the response contains other"):
        linear.frequency_response([2.0], outputs=["spring.displacement"])
    assert not model.root_locus("spring.law.stiffness[0]", [200.0, 300.0]).trusted


def test_stiffness_that_goes_with_time() -> None:
    """Mathieu's equation: rest lasts, and its stiffness changes; nothing moves at t = 0."""
    model = mstmm.compile(pendulum(law={"effort": "-(4 + 2*cos(3*t))*q"}), engine="looped")
    assert model.equilibrium().trusted
    linear = model.linearize()
    assert not linear.trusted and "matrices change" in linear.warnings[0]
    assert not linear.frequency_response([1.0]).trusted


def rotor(off: float, drive: str = "20*t", gravity: float = 0.0) -> mstmm.Model:
    """A rotor of 2 kg, its mass off its axis, on a mass of 1 kg on a spring of 1000 N/m."""
    rail = {"type": "prismatic", "axis": [1, 0, 0], "law": {"stiffness": 1000.0}}
    return compile_tables(
        gravity=(0, 0, -gravity),
        body=[{"name": "frame", "mass": 1.0, **SOLID},
              {"name": "rotor", "mass": 2.0, "center_of_mass": [off, 0, 0], **SOLID,
               "ends": {"rim": [0.1, 0, 0]}}],
        hinge=[rail | {"name": "x", "inboard": "ground", "outboard": "frame"},
               {"name": "spin", "type": "pin", "inboard": "frame", "outboard": "rotor",
                "drive": drive}],
    )  # fmt: skip


def test_an_unbalanced_rotor_does_not_rest() -> None:
    """m e W^2 = 40 N along x at t = 0, and 40 cos(W t) afterwards."""
    model = rotor(0.05)
    with pytest.raises(NumericalFailure, match=r"drives move \(spin\), .* N along x\.disp"):
        model.equilibrium()
    linear = model.linearize()
    (risk,) = linear.risks
    assert risk.name == "unsteady-state" and risk.unit == "N" and not linear.trusted
    assert risk.value == pytest.approx(40 * (1 - math.cos(3.3)), rel=1e-9)
    assert not model.modes().trusted
    true = -2 * 0.05 * 400 / (1000 - 3 * 400)  # forced whirl, m e W^2/(k - m W^2), far from rest
    assert abs(linear.state.q[0]) < 0.3 * true


@pytest.mark.parametrize("off", [0.0, 1e-12])
def test_a_balanced_rotor_rests(off: float) -> None:
    model = rotor(off, gravity=9.81)
    assert model.equilibrium() == pytest.approx([0.0, 0.0], abs=1e-9)
    assert model.equilibrium().trusted and model.linearize().trusted
    assert model.modes().omega == pytest.approx([math.sqrt(1000 / 3)])


@pytest.mark.parametrize(
    "drive", ["0.1*sin(20*t)", "0.1*(1 - cos(20*t))", "where(t < 2, 0, (t - 2)^2)"]
)
def test_drives_that_do_not_go_on_steadily(drive: str) -> None:
    """They move, accelerate, or stand still at t = 0; the rotor is off its axis."""
    model = rotor(0.05, drive)
    linear = model.linearize()
    assert not linear.trusted and "is not steady" in linear.warnings[0]
    if "where" in drive:
        found = model.equilibrium()
        assert not found.trusted and "is not steady" in found.warnings[0]
    else:
        with pytest.raises(NumericalFailure, match="no equilibrium: the state"):
            model.equilibrium()


def test_loads_that_go_with_time() -> None:
    """A load, and an input that follows a signal: rest of a moment, which says so."""
    model = mstmm.compile(pendulum(law={"effort": "0.1*sin(7*t)"}), engine="looped")
    gust = {"name": "gust", "times": [0, 50, 51, 60], "values": [0, 0, 1, 1]}
    blown = compile_tables(
        gravity=(0, -9.81, 0), signal=[gust], input=[{"name": "wind", "value": "gust"}],
        body=[{"name": "bob", "mass": 1.0, "center_of_mass": [0, -1, 0], **SOLID}],
        hinge=[{"name": "pivot", "type": "pin", "inboard": "ground", "outboard": "bob",
                "law": {"effort": "wind"}}],
    )  # fmt: skip
    for one in (model, blown):
        found = one.equilibrium()
        assert found == pytest.approx([0.0]) and not found.trusted
        assert "as loads or drives change with time" in found.warnings[0]
        assert not one.linearize().trusted
    later = blown.equilibrium(t=55.0)
    assert later == pytest.approx([math.asin(1 / 9.81)]) and later.trusted


@pytest.mark.parametrize("speed", [1e-16, 1e-10, 1e-4])
def test_creep_is_followed_for_a_thousand_seconds(speed: float) -> None:
    """A pendulum that hangs creeps: by 1e-13 rad in 1000 s it has not moved, by 0.1 rad its weight
    pulls it back with m g l sin."""
    linear = mstmm.compile(pendulum(), engine="looped").linearize([0.0], [speed])
    found = [risk for risk in linear.risks if risk.name == "unsteady-state"]
    assert len(found) == (speed > 1e-5) and linear.trusted == (not found)
    for risk in found:
        (t,) = re.findall(r"at t = (\S+) s", str(risk))
        assert 900 < float(t) < 1100
        assert risk.value == pytest.approx(2 * 9.81 * 0.5 * math.sin(speed * float(t)), rel=1e-5)


def test_a_carriage_that_moves_on_is_steady() -> None:
    rail = {"name": "rail", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground",
            "outboard": "car", "drive": "2*t"}  # fmt: skip
    model = compile_tables(
        gravity=(0, -9.81, 0),
        body=[{"name": "car", "mass": 1.0, **SOLID},
              {"name": "bob", "mass": 1.0, "center_of_mass": [0, -1, 0], **SOLID}],
        hinge=[rail, {"name": "pivot", "type": "pin", "inboard": "car", "outboard": "bob"}],
    )  # fmt: skip
    assert model.equilibrium().trusted and not model.linearize().warnings
    found = model.frequency_response([1.0], ["ground.acceleration.x"], ["pivot.angle", "bob.x"])
    assert found.response[0, 0, 0] == pytest.approx(-1 / (9.81 - 1.1))


def test_closed_loops_that_turn() -> None:
    """A parallelogram on a driven shaft: its swing answers an effort; the ground goes round. With
    the shaft on a mount its inertia is coupled by the angle."""

    def model(mounted: bool) -> mstmm.Model:
        arm = {"mass": 0.5, "center_of_mass": [0, -0.15, 0], "inertia": [4e-3, 1e-4, 4e-3],
               "ends": {"tip": [0, -0.3, 0]}}  # fmt: skip
        pin = {"type": "pin", "axis": [0, 0, 1], "law": {"stiffness": 8.0}}
        shaft = "mount" if mounted else "ground"
        bodies = [{"name": "mount", "mass": 4.0, **SOLID}] if mounted else []
        hinges = (
            [
                {
                    "name": "x",
                    "type": "prismatic",
                    "axis": [1, 0, 0],
                    "inboard": "ground",
                    "outboard": "mount",
                    "law": {"stiffness": 500.0},
                }
            ]
            if mounted
            else []
        )
        return compile_tables(
            body=[*bodies, {"name": "shaft", "mass": 1.0, **SOLID, "ends": {"far": [0.2, 0, 0]}},
                  arm | {"name": "a"}, arm | {"name": "b"},
                  {"name": "bar", "mass": 0.3, "center_of_mass": [0.1, 0, 0], **SOLID,
                   "ends": {"far": [0.2, 0, 0]}}],
            hinge=[*hinges,
                   {"name": "spin", "type": "pin", "axis": [0, 1, 0], "inboard": shaft,
                    "outboard": "shaft", "drive": "4*t"},
                   pin | {"name": "one", "inboard": "shaft", "outboard": "a"},
                   pin | {"name": "two", "inboard": "shaft.far", "outboard": "b"},
                   pin | {"name": "under", "inboard": "a.tip", "outboard": "bar"},
                   pin | {"name": "close", "inboard": "bar.far", "outboard": "b.tip"}],
        )  # fmt: skip

    steady = model(False)
    linear = steady.linearize(inputs=["one.effort"])
    assert linear.trusted and steady.equilibrium().trusted
    assert linear.frequency_response([3.0], outputs=["one.angle"]).trusted
    with pytest.raises(
        SceneError, match=r"motion of this state: ground\.acceleration\.x, .*\.z, so"
    ):
        steady.frequency_response([3.0])
    mounted = model(True)
    with pytest.raises(NumericalFailure, match=r"drives move \(spin\)"):
        mounted.equilibrium()
    names = {risk.name for risk in mounted.linearize().risks}
    assert {"unsteady-state", "changing-coefficients"} <= names


def test_a_response_beside_a_motion_that_is_given() -> None:
    """m x'' + c x' + (k - m W^2) x = F of a table that turns freely, held at W by no drive: its
    angle answers too, by the angular momentum, m x0 = 0 at the axis."""
    omega, model = np.array([1.0, 9.0]), turntable("")
    found = model.frequency_response(
        omega, ["rail.effort"], ["rail.displacement"], [0.0, 0.0], u=[SPIN, 0.0]
    )
    expected = 1 / (STIFF - MASS * SPIN**2 - MASS * omega**2 + 1j * omega * DAMPING)
    np.testing.assert_allclose(found.response[:, 0, 0], expected, rtol=1e-12)
