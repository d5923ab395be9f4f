"""Couplings by implicit methods, at rest, and where motors drive them."""

from __future__ import annotations

import numpy as np
import pytest

import mstmm
from tests.support.scenes.gears import (
    RING,
    SUN,
    Scene,
    coupled_model,
    inertia,
    pair,
    pin,
    planetary,
    wheel,
)
from tests.support.scenes.linkages import rod

GEAR = {"name": "gear", "expression": "A.q + 3*B.q"}


def _oscillating() -> mstmm.Model:
    """A planetary gear with springs at the sun and at the carrier, turned at the start."""
    model = planetary(
        {}, sun={"stiffness": 3.0, "damping": 1e-3}, carrier={"stiffness": 20.0}
    )  # fmt: skip
    return model


@pytest.mark.parametrize("method", ["rodas5p", "rodas4p2", "kvaerno5", "esdirk436", "auto"])
def test_implicit_methods_keep_the_ratio_of_willis(method: str) -> None:
    """Sun and ring turn against the carrier as their teeth say, and as explicit steps do."""
    model = _oscillating()
    q, u = model.assemble(np.array([0.3, 0, 0.1, 0, 0, 0]), np.zeros(6), hold=["sun", "carrier"])
    run: Scene = {"initial": (q, u), "output_times": [0.0, 0.2]}
    wanted = model.simulate(0.2, "dop853", rtol=1e-11, **run)
    found = model.simulate(0.2, method, rtol=1e-8, **run)
    assert found.success, found.message
    sun, ring, carrier = found.u[-1, :3]
    assert abs((sun - carrier) * SUN + (ring - carrier) * RING) < 1e-13
    assert np.abs(found.q[-1] - wanted.q[-1]).max() < 2e-6
    assert found.certificate.energy.relative < 1e-5


def test_stiff_teeth_turn_auto_to_an_implicit_method() -> None:
    """What holds the carrier stiffly sets the steps, though gears lie between it and the sun."""
    model = planetary(
        {"sun": 1.0}, ring={"stiffness": 1.0}, carrier={"stiffness": 1e7, "damping": 1e3}
    )  # fmt: skip
    result = model.simulate(0.5, "auto", rtol=1e-6, output_times=[0.0, 0.5])
    assert [one.method for one in result.method_history] == ["dop853", "rodas5p"]
    held = model.simulate(0.5, "rodas5p", rtol=1e-9, output_times=[0.0, 0.5])
    assert np.abs(result.q[-1] - held.q[-1]).max() < 1e-5


def test_generalised_alpha_is_of_second_order() -> None:
    model = _oscillating()
    q, u = model.assemble(np.array([0.3, 0, 0.1, 0, 0, 0]), np.zeros(6), hold=["sun", "carrier"])
    run: Scene = {"initial": (q, u), "output_times": [0.0, 0.1]}
    wanted = model.simulate(0.1, "dop853", rtol=1e-11, **run).q[-1]
    errors = [
        np.abs(model.simulate(0.1, "genalpha", step=step, **run).q[-1] - wanted).max()
        for step in (1e-3, 5e-4)
    ]
    assert 3.5 < errors[0] / errors[1] < 4.5


def test_a_screw_at_rest() -> None:
    """m g p = k theta of a weight on a nut, p its rise per radian."""
    rise, mass, stiffness = 0.004, 3.0, 0.05
    hinges = [
        pin("turn", "nut", law={"stiffness": stiffness}),
        {"name": "lift", "type": "prismatic", "inboard": "ground", "outboard": "weight",
         "axis": [0, 0, 1]},
    ]  # fmt: skip
    model = coupled_model(
        [wheel("nut", 1e-3), wheel("weight", 1e-3, mass)], hinges,
        {"expression": f"lift.q - {rise}*turn.q"}, gravity=[0, 0, -9.81],
    )  # fmt: skip
    theta = -mass * 9.81 * rise / stiffness
    assert np.abs(model.equilibrium() - [theta, rise * theta]).max() < 1e-10


def test_a_differential_at_rest() -> None:
    """Half of what the case is given turns each side against its spring."""
    hinges = [
        pin("case", "a", law={"effort": 2.0}), pin("left", "b", law={"stiffness": 4.0}),
        pin("right", "c", law={"stiffness": 10.0}),
    ]  # fmt: skip
    model = coupled_model(
        [wheel("a", 0.1), wheel("b", 0.02), wheel("c", 0.03)], hinges,
        {"expression": "left.q + right.q - 2*case.q"},
    )  # fmt: skip
    assert np.abs(model.equilibrium() - [0.175, 0.25, 0.1]).max() < 1e-12


def _cam() -> mstmm.Model:
    """A weight on a cord over a cam, whose lever changes as it turns."""
    hinges = [
        pin("cam", "a", law={"stiffness": 8.0}, initial={"q": 0.2}),
        {"name": "lift", "type": "prismatic", "inboard": "ground", "outboard": "weight",
         "axis": [0, 0, 1]},
    ]  # fmt: skip
    return coupled_model(
        [wheel("a", 0.1), wheel("weight", 1e-3, 1.5)], hinges,
        {"expression": "lift.q - 0.3*sin(cam.q)", "equals": 0}, gravity=[0, 0, -9.81],
    )  # fmt: skip


def test_a_curved_coupling_at_rest() -> None:
    """Virtual work."""
    model = _cam()
    angle = float(model.equilibrium()[0])
    assert abs(8.0 * angle + 1.5 * 9.81 * 0.3 * np.cos(angle)) < 1e-9


def test_motors_of_a_planetary_gear() -> None:
    """Efforts by Lagrange of any two of its three shafts, which have the same power."""
    model = planetary({})
    independent = [name.partition(".")[0] for name in model.loops.independent_speeds]
    assert independent == ["sun", "ring"]
    q, u = model.initial_state()
    ratios = np.array([[1, 0], [0, 1], [SUN / (SUN + RING), RING / (SUN + RING)]])
    matrix = inertia(ratios)
    assert np.abs(model.mass_matrix(q) - matrix).max() < 1e-15
    rates = np.array([30.0, -8.0])
    efforts = model.inverse_dynamics(q, u, rates)
    assert np.abs(efforts[:2] - matrix @ rates).max() < 1e-14 and not efforts[2:].any()
    other = model.inverse_dynamics(q, u, rates, actuators=["sun", "carrier"])
    assert np.abs(ratios.T @ other[:3] - matrix @ rates).max() < 1e-14 and other[1] == 0


def test_a_mimic_gripper() -> None:
    """Two fingers of two links each follow one motor: N^T M N of the open hand."""

    def hand(*rows: Scene) -> mstmm.Model:
        bodies = [
            rod(name, length)
            for name, length in (("near", 0.3), ("tip", 0.2), ("thumb", 0.3), ("nail", 0.2))
        ]
        hinges = [pin("knuckle", "near"), pin("root", "thumb", position=[0.1, 0, 0])]
        hinges += [
            {"name": name, "type": "pin", "inboard": f"{inboard}.tip", "outboard": outboard}
            for name, inboard, outboard in (("bend", "near", "tip"), ("bow", "thumb", "nail"))
        ]
        return coupled_model(bodies, hinges, *rows)

    model = hand(
        {"expression": "bend.q - 0.8*knuckle.q"}, {"expression": "root.q + knuckle.q"},
        {"expression": "bow.q + 0.8*sin(knuckle.q)"},
    )  # fmt: skip
    q, _ = model.assemble(np.array([0.4, 0, 0, 0]), np.zeros(4), hold=["knuckle"])
    ways = np.array([[1.0, -1.0, 0.8, -0.8 * np.cos(0.4)]]).T
    wanted = ways.T @ hand().mass_matrix(q) @ ways
    assert abs(model.mass_matrix(q)[0, 0] / wanted[0, 0] - 1) < 1e-13


def test_columns_of_efforts_know_nothing_of_time() -> None:
    """M^-1 of what `equals` moves is that of what it does not."""
    by_time = pair(GEAR | {"equals": "0.2 + 0.5*t^2"})
    still = pair(GEAR | {"equals": 0.2})
    q, _ = still.initial_state()
    assert np.abs(by_time.solve(q, np.eye(2)) - still.solve(q, np.eye(2))).max() < 1e-14
    row = np.array([[1.0, 3.0]])
    free = np.diag([1 / 0.02, 1 / 0.3])
    wanted = free - free @ row.T @ np.linalg.inv(row @ free @ row.T) @ row @ free
    assert np.abs(still.solve(q, np.eye(2)) - wanted).max() < 1e-12


def test_torsional_frequencies_of_a_planetary_gear() -> None:
    """Two springs and two motions: closed form over sun and ring, and response to the sun."""
    model = planetary({}, sun={"stiffness": 3.0, "damping": 1e-3}, carrier={"stiffness": 20.0})
    ratios = np.array([[1, 0], [0, 1], [SUN / (SUN + RING), RING / (SUN + RING)]])
    mass, stiffness = inertia(ratios), ratios.T @ np.diag([3.0, 0.0, 20.0]) @ ratios
    linear = model.linearize()
    assert linear.coordinate_names == ("sun.angle", "ring.angle")
    assert np.abs(linear.M / mass - 1).max() < 1e-12
    assert np.abs(linear.K - stiffness).max() < 1e-12
    omega = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real))
    assert np.abs(model.modes().omega / omega - 1).max() < 1e-4  # the damping
    at = np.array([50.0, 300.0])
    found = model.frequency_response(at, inputs=["sun.effort"], outputs=["carrier.q"])
    damping = np.diag([1e-3, 0.0])
    wanted = [
        ratios[2] @ np.linalg.solve(stiffness + 1j * w * damping - w * w * mass, [1.0, 0.0])
        for w in at
    ]
    assert np.abs(found.response[:, 0, 0] / wanted - 1).max() < 1e-10


def test_loads_of_curved_couplings_have_stiffness() -> None:
    """A cam's lever shortens as it turns under the weight: V'' of the one coordinate."""
    model = _cam()
    angle = float(model.equilibrium()[0])
    mass = 0.1 + 1.5 * (0.3 * np.cos(angle)) ** 2
    stiffness = 8.0 - 1.5 * 9.81 * 0.3 * np.sin(angle)
    assert abs(model.modes().omega[0] / np.sqrt(stiffness / mass) - 1) < 1e-9


def test_a_drive_that_lets_go_in_implicit_steps() -> None:
    """The damper stops both wheels once the drive is gone, as it does in explicit steps."""
    model = pair(GEAR, a={"drive": "t", "release": "t > 0.5"}, b={"law": {"damping": 0.1}})
    result = model.simulate(1.0, "rodas5p", rtol=1e-9, output_times=[0.0, 1.0])
    assert result.success, result.message
    rate = np.exp(-0.1 / 9 * 0.5 / (0.02 + 0.3 / 9))
    assert np.abs(result.u[-1] - [rate, -rate / 3]).max() < 1e-7


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_a_rack_that_bounces_throws_its_pinion_back(method: str) -> None:
    """Whatever the inertia of the pinion, e of the speed comes back to both."""
    rack = {"name": "R", "type": "prismatic", "inboard": "ground", "outboard": "rack",
            "axis": [0, 1, 0], "initial": {"q": 0.5}}  # fmt: skip
    model = coupled_model(
        [wheel("pinion", 0.05), wheel("rack", 1.0, 4.0)], [pin("P", "pinion"), rack],
        {"expression": "0.2*P.q - R.q"}, gravity=[0, -9.81, 0],
        event=[{"name": "stop", "when": "R.q < 0", "do": "bounce", "restitution": 0.6}],
    )  # fmt: skip
    fall = 9.81 / (1 + 0.05 / (4.0 * 0.2**2))
    down, speed = np.sqrt(2 * 0.5 / fall), np.sqrt(2 * 0.5 * fall)
    after = 0.3
    result = model.simulate(down + after, method, rtol=1e-9, output_times=[0.0, down + after])
    assert result.success, result.message
    up = 0.6 * speed - fall * after
    assert np.abs(result.u[-1] - [up / 0.2, up]).max() < 1e-6
    assert abs(result.q[-1, 1] - (0.6 * speed * after - fall * after**2 / 2)) < 1e-6


#: A takes half the turns of B, backwards; of the pair's wheels 0.02 + 0.3 / 4 kg m^2 are felt at A.
_GEAR, _FELT = {"expression": "A.q + 2*B.q"}, 0.095


def test_couplings_that_go_by_time_leave_one_speed_free() -> None:
    model = pair(_GEAR | {"equals": "0.1*t"})
    q, u = model.initial_state()
    assert model.loops.independent_speeds == ("A.angle_rate",)
    assert model.mass_matrix(q) == pytest.approx(np.array([[_FELT]]), rel=1e-12)
    pushed = model.inverse_dynamics(q, u, np.zeros(2), actuators=["A"])
    assert pushed == pytest.approx(np.zeros(2), abs=1e-12)


def test_modal_damping_of_a_pair_is_that_of_the_pair() -> None:
    """1 / response = K - M w^2 + i 2 zeta w sqrt(K M) of the one motion that is left."""
    model = pair(_GEAR, a={"law": {"stiffness": 20.0}})
    found = model.frequency_response([2.0], ["A.effort"], ["A.angle"], modal=0.02)
    stiff = 20.0 - _FELT * 4 + 2j * 0.02 * 2.0 * np.sqrt(20.0 * _FELT)
    assert 1 / found.response[0, 0, 0] == pytest.approx(stiff, rel=1e-10)


def test_a_coupling_has_a_name_of_its_own() -> None:
    with pytest.raises(mstmm.SceneError, match='"A" is also the name of a hinge'):
        pair(_GEAR | {"name": "A"})
