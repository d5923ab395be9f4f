"""Couplings against dense equations, and against motions told by fewer coordinates."""

from __future__ import annotations

import copy

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mstmm
from tests.reference import couplings
from tests.reference import newton_euler as dense
from tests.reference.compare import worst
from tests.reference.random_couplings import random_coupled
from tests.reference.tree import read
from tests.support import planar_four_bar as planar
from tests.support.scenes.gears import Scene, coupled_model, pin, wheel
from tests.support.scenes.linkages import four_bar, rod


@pytest.mark.parametrize("seed", [0, 3, 4, 6, 7, 10])
def test_random_mechanisms(seed: int) -> None:
    """Accelerations of mechanisms with loops and couplings, hinges that are cut and free bodies
    among those coupled; the rows hold after a while, and the balance of energy closes."""
    scene, q, u = random_coupled(seed)
    tree = read(scene)
    columns, drift, slip = couplings.rows(scene["coupling"], tree, q, u)
    assert np.abs(slip).max(initial=0.0) < 1e-12
    found = dense.solve(scene, q, u, coupled=(columns, drift))
    model = mstmm.compile(mstmm.Scene(**copy.deepcopy(scene)))
    assert worst(model.accelerations(q, u), found.udot) < 1e-11
    result = model.simulate(0.2, "dop853", rtol=1e-9, initial=(q, u), output_times=[0.0, 0.2])
    assert result.success, result.message
    _, _, slip = couplings.rows(scene["coupling"], tree, result.q[-1], result.u[-1], 0.2)
    assert np.abs(slip).max() < 1e-12
    assert result.certificate.energy.relative < 1e-8


@pytest.mark.parametrize("cut", planar.NAMES)
def test_a_flywheel_on_any_hinge_of_a_loop(cut: str) -> None:
    """Geared to a hinge it is a rotor of ratio^2 times its moment, whether that hinge is cut or in
    the tree."""
    scene = four_bar(speed=3.0, cut=cut, laws={"tip": {"damping": 0.2}})
    scene["body"].append(wheel("flywheel", 0.05))
    scene["hinge"].append(pin("F", "flywheel"))
    scene["coupling"] = [{"expression": "F.q - 3*tip.q"}]
    model = mstmm.compile(mstmm.Scene(**scene))
    laws = {"tip": {"damping": 0.2, "inertia": 9 * 0.05}}
    rates = planar.accelerations(*planar.start(0.9, 3.0), laws)
    found = model.accelerations(*model.initial_state())
    foot = found[[hinge["name"] for hinge in scene["hinge"]].index("foot")]
    assert abs(foot - rates[0]) < 1e-11 * max(1.0, abs(rates[0]))
    result = model.simulate(1.0, "dop853", rtol=1e-10, output_times=[0.0, 1.0])
    assert result.success, result.message
    wanted = planar.motion(0.9, 3.0, laws, np.array([0.0, 1.0]))[0][-1, 0]
    assert abs(result.q[-1, 0] - wanted) < 1e-8


def _arms(*rows: Scene) -> mstmm.Model:
    """Two rods that hang on each other."""
    hinges = [
        pin("shoulder", "upper", initial={"q": 0.4, "u": 1.0}),
        {"name": "elbow", "type": "pin", "inboard": "upper.tip", "outboard": "lower"},
    ]
    return coupled_model(
        [rod("upper", 0.7), rod("lower", 0.5)], hinges, *rows, gravity=[0, -9.81, 0]
    )


def test_a_mimic_joint_that_time_shifts() -> None:
    """One coordinate s with q = (s, 2 s + b(t)): efforts of the open arm along it vanish."""
    model = _arms({"expression": "elbow.q - 2*shoulder.q", "equals": "0.3 + 0.2*sin(3*t)"})
    arm, along = _arms(), np.array([1.0, 2.0])

    def rates(t: float, y: np.ndarray) -> list[float]:
        q = np.array([y[0], 2 * y[0] + 0.3 + 0.2 * np.sin(3 * t)])
        u = np.array([y[1], 2 * y[1] + 0.6 * np.cos(3 * t)])
        given = np.array([0.0, -1.8 * np.sin(3 * t)])
        lack = along @ arm.inverse_dynamics(q, u, given)
        return [y[1], -lack / (along @ arm.mass_matrix(q) @ along)]

    q, u = model.initial_state()
    wanted = solve_ivp(rates, (0.0, 1.0), [q[0], u[0]], "DOP853", rtol=1e-11, atol=1e-11)
    result = model.simulate(1.0, "dop853", rtol=1e-11, output_times=[0.0, 1.0])
    assert result.success, result.message
    assert abs(result.q[-1, 0] - wanted.y[0, -1]) < 1e-9
    assert abs(result.q[-1, 1] - 2 * result.q[-1, 0] - 0.3 - 0.2 * np.sin(3.0)) < 1e-13
    assert result.certificate.energy.relative < 1e-9


def test_speeds_that_say_what_coordinates_could() -> None:
    """A row of speeds keeps no position, and still holds the motion of the row of coordinates."""
    rows = ({"expression": "elbow.q - 2*shoulder.q"}, {"speeds": "elbow.u - 2*shoulder.u"})
    ends = [_arms(row).simulate(1.0, "dop853", rtol=1e-11).q[-1] for row in rows]
    assert np.abs(ends[0] - ends[1]).max() < 1e-9
    assert abs(ends[1][1] - 2 * (ends[1][0] - 0.4)) < 1e-9


def test_a_sleigh() -> None:
    """Caplygin's sleigh: v' = a w^2, w' = -m a v w / (I + m a^2), without slip across the blade."""
    ahead, mass, moment = 0.3, 2.0, 0.5
    body = {"name": "sleigh", "mass": mass, "center_of_mass": [ahead, 0, 0],
            "inertia": [0.3, 0.3, moment]}  # fmt: skip
    hinge = {"name": "P", "type": "planar", "inboard": "ground", "outboard": "sleigh",
             "initial": {"u": [1.0, 0.0, 1.5]}}  # fmt: skip
    model = coupled_model([body], [hinge], {"speeds": "cos(P.q[2])*P.u[1] - sin(P.q[2])*P.u[0]"})
    assert model.loops.mobility == 2 and model.loops.constraint_rows == (("coupling1", "speeds"),)
    result = model.simulate(3.0, "dop853", rtol=1e-11, output_times=[0.0, 1.5, 3.0])
    assert result.success, result.message

    def rates(_: float, y: np.ndarray) -> list[float]:
        turned = mass * ahead * y[0] * y[1] / (moment + mass * ahead**2)
        return [ahead * y[1] ** 2, -turned]

    wanted = solve_ivp(rates, (0, 3), [1.0, 1.5], "DOP853", [0.0, 1.5, 3.0], rtol=1e-12, atol=1e-12)
    angle, (vx, vy, turning) = result.q[:, 2], result.u.T
    assert np.abs(np.cos(angle) * vx + np.sin(angle) * vy - wanted.y[0]).max() < 1e-9
    assert np.abs(turning - wanted.y[1]).max() < 1e-9
    slip = np.abs(np.cos(angle) * vy - np.sin(angle) * vx)
    assert slip[-1] < 1e-13 and slip.max() < 1e-7


def test_batches_and_sessions() -> None:
    model = _arms({"expression": "elbow.q - 2*shoulder.q"})
    q, u = model.initial_state()
    alone = model.simulate(0.3, "dop853", initial=(q, 2 * u), output_times=[0.0, 0.3])
    batch = model.simulate_batch((np.array([q, q]), np.array([u, 2 * u])), t_end=0.3)
    assert batch.success.all()
    assert np.abs(batch.q[1, -1] - alone.q[-1]).max() < 1e-7
    session = model.session(q=q, u=2 * u, method="dop853")
    for _ in range(3):
        session.advance(0.1)
    assert np.abs(session.q - alone.q[-1]).max() < 1e-7


@pytest.mark.parametrize("engine", ["looped", "fused"])
def test_a_batch_by_numbers_and_starts_of_its_own(engine: str) -> None:
    """Scenes that nothing but a coupling closes: every trajectory is that of a run alone."""
    bodies = [wheel("a", 0.1) | {"center_of_mass": [0.1, 0, 0]}, wheel("b", 0.2)]
    scene = coupled_model(
        bodies, [pin("A", "a", initial={"q": 0.3}), pin("B", "b", initial={"q": 0.5})],
        {"expression": "A.q - k*B.q", "equals": "-0.7"}, constants={"k": 2.0},
    ).scene  # fmt: skip
    model = mstmm.compile(scene, engine=engine)
    ratios, starts = [2.0, 2.5, 3.0], np.array([[0.3, 0.5], [1.0, 0.1], [0.3, 0.5]])
    times = np.linspace(0.0, 0.5, 8)
    batch = model.simulate_batch(
        (starts, np.zeros((3, 2))), {"constants.k": ratios}, t_end=0.5, output_times=times
    )
    assert batch.success.all(), batch.messages
    for k, ratio in enumerate(ratios):
        alone = model.with_parameters({"constants.k": ratio}).simulate(
            0.5, "dop853", initial=(starts[k], np.zeros(2)), output_times=times
        )
        assert np.abs(batch.q[k] - alone.q).max() < 1e-8
        for q in (batch.q[k], alone.q):
            assert np.abs(q[:, 0] - ratio * q[:, 1] + 0.7).max() < 1e-13


@pytest.mark.parametrize("method", ["dop853", "kvaerno5"])
def test_samples_between_steps_keep_what_is_coupled(method: str) -> None:
    model = _arms({"expression": "elbow.q - 2*shoulder.q^2"})
    times = np.linspace(0.0, 1.0, 101)
    q = model.simulate(1.0, method, rtol=1e-3, output_times=times).q
    gap = q[:, 1] - 2 * q[:, 0] ** 2
    assert len(q) == 101 and np.ptp(gap) < 1e-12
