"""Generalised alpha on rows of positions: against the equations as they are printed, and beside the
method whose loops are closed behind its steps."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import SceneError
from mstmm.runtime.engine.loops.loop_calls import LoopCalls
from mstmm.runtime.integrate.steppers.alpha_family import generalised_alpha
from tests.support.scenes.constraints import cycloid, governor, on_a_plane, on_a_road
from tests.support.scenes.linkages import four_bar, rod
from tests.system.loops.test_implicit_methods import scene_of_laws

Array = np.ndarray[Any, Any]

#: A rod that swings about one end: mass, moment about its centre, length to the centre, gravity.
MASS, MOMENT, ARM, GRAVITY = 1.3, 0.4, 0.7, 9.81
ANGLE, SPEED = 0.4, 3.0


def pendulum() -> mstmm.Scene:
    """The rod by its centre's place and its angle, and a pin that closes a loop with the ground."""
    place = [ARM * np.cos(ANGLE), ARM * np.sin(ANGLE), ANGLE]
    turning = [-SPEED * ARM * np.sin(ANGLE), SPEED * ARM * np.cos(ANGLE), SPEED]
    rod = {"name": "rod", "mass": MASS, "inertia": [MOMENT] * 3, "ends": {"top": [-ARM, 0, 0]}}
    plane = {"name": "plane", "type": "planar", "inboard": "ground", "outboard": "rod",
             "cut": False, "initial": {"q": place, "u": turning}}  # fmt: skip
    pin = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod.top", "cut": True,
           "initial": {"q": ANGLE}}  # fmt: skip
    return mstmm.Scene(gravity=[0, -GRAVITY, 0], body=[rod], hinge=[plane, pin])


def reference_motion(radius: float, h: float, steps: int) -> tuple[Array, Array, Array]:
    """q, u (steps + 1, 3) and multipliers (steps, 2) of equations (12), (18) to (21) of M. Arnold,
    O. Brüls, Multibody System Dynamics 18 (2007) 185-202, on M q'' + Phi_q^T lambda = f, Phi = 0,
    by a full Newton matrix; auxiliary accelerations begin with q''."""
    c = vars(generalised_alpha(radius))
    mass, force = np.diag([MASS, MASS, MOMENT]), np.array([0.0, -MASS * GRAVITY, 0.0])

    def rows(q: Array) -> tuple[Array, Array]:
        cosine, sine = np.cos(q[2]), np.sin(q[2])
        phi = q[:2] - ARM * np.array([cosine, sine])
        return phi, np.array([[1, 0, ARM * sine], [0, 1, -ARM * cosine]])

    q = np.array([ARM * np.cos(ANGLE), ARM * np.sin(ANGLE), ANGLE])
    u = SPEED * np.array([-q[1], q[0], 1.0])
    phi_q, gamma = rows(q)[1], -(SPEED**2) * q[:2]
    whole = np.block([[mass, phi_q.T], [phi_q, np.zeros((2, 2))]])
    rate = np.linalg.solve(whole, [*force, *gamma])[:3]
    a, lam = rate.copy(), np.zeros(2)
    found, multipliers = [(q, u)], []
    part, last = (1 - c["alpha_f"]) / (1 - c["alpha_m"]), 1 / (1 - c["alpha_m"])
    for _ in range(steps):
        new = rate.copy()
        for _ in range(12):
            aux = part * new + last * (c["alpha_f"] * rate - c["alpha_m"] * a)
            q_1 = q + h * u + h * h * ((0.5 - c["beta"]) * a + c["beta"] * aux)
            phi, phi_q = rows(q_1)
            turned = np.zeros((3, 3))
            turned[2, 2] = ARM * (lam @ [np.cos(q_1[2]), np.sin(q_1[2])])
            cq = h * h * c["beta"] * part
            whole = np.block([[mass + cq * turned, phi_q.T], [cq * phi_q, np.zeros((2, 2))]])
            step = np.linalg.solve(whole, -np.array([*(mass @ new + phi_q.T @ lam - force), *phi]))
            new, lam = new + step[:3], lam + step[3:]
        u = u + h * ((1 - c["gamma"]) * a + c["gamma"] * aux)
        q, rate, a = q_1, new, aux
        found.append((q, u))
        multipliers.append(lam)
    return np.array([x for x, _ in found]), np.array([x for _, x in found]), np.array(multipliers)


@pytest.fixture(scope="module")
def pendulum_model() -> mstmm.Model:
    return mstmm.compile(pendulum())


@pytest.mark.parametrize("radius", [0.0, 0.6, 0.9])
def test_printed_equations(radius: float, pendulum_model: mstmm.Model) -> None:
    h, steps = 0.02, 60
    q, u, _ = reference_motion(radius, h, steps)
    result = pendulum_model.simulate(
        h * steps,
        mstmm.methods.GeneralizedAlpha("genalpha-index3", radius=radius),
        step=h,
        rtol=1e-12,
        atol=1e-13,
        output_times=np.linspace(0.0, h * steps, steps + 1),
    )
    assert result.success, result.message
    # Iterations with fixed steps end at 1e-3 of a step's error.
    assert np.abs(result.q[:, :3] - q).max() < 3e-6
    assert np.abs(result.u[:, :3] - u).max() < 2e-5
    exact = pendulum_model.simulate(h * steps, rtol=1e-11, output_times=[0.0, h * steps]).q[-1, :3]
    assert np.abs(exact - q[-1]).max() > 1e-4
    assert np.abs(result.q[:, 3] - result.q[:, 2]).max() < 1e-12  # the pin's own angle


def test_multipliers_are_of_second_order(pendulum_model: mstmm.Model) -> None:
    """Those of the printed equations, and the load of the pin at states of the run."""
    end = 0.8
    wanted = pendulum_model.simulate(end, rtol=1e-12, atol=1e-13, output_times=[0.0, end]).force(
        "pin"
    )[-1]
    errors = []
    for steps in (80, 160):
        run = pendulum_model.simulate(
            end, "genalpha-index3", step=end / steps, rtol=1e-11, output_times=[0.0, end]
        )
        lam = reference_motion(0.8, end / steps, steps)[2][-1]
        errors.append([
            np.abs(run.force("pin")[-1] - wanted).max(), np.abs(-lam - wanted[:2]).max()
        ])  # fmt: skip
    print(errors)
    assert np.all(np.log2(np.array(errors[0]) / errors[1]) > 1.8)
    assert np.max(errors) < 0.1 * np.abs(wanted).max()


def test_beside_loops_that_are_closed_behind_steps() -> None:
    """Springs, dampers, an effort of time and rotors: one limit, order 2, no gap; a slip of order
    2, which the certificate tells."""
    model, end = mstmm.compile(mstmm.Scene(**scene_of_laws())), 0.8
    wanted = model.simulate(end, rtol=1e-12, atol=1e-13, output_times=[0.0, end])
    calls, errors, slips = LoopCalls(model.looped, wanted.q[-1]), [], []
    for method in ("genalpha-index3", "hht-index3", "genalpha"):
        for steps in (80, 160):
            run = model.simulate(end, method, step=end / steps, output_times=[0.0, end])
            assert run.success, run.message
            closure = run.certificate.loop_closure
            assert closure is not None and closure.gap < 1e-14
            assert ("not removed by position-level steps" in str(closure)) == ("index3" in method)
            errors.append(float(np.abs(run.q[-1] - wanted.q[-1]).max()))
            slip = calls.correction(calls.velocity_level, run.q[-1], run.u[-1], t=end)[1]
            slips.append(float(np.abs(slip).max()))
    print(errors, slips)
    assert max(errors) < 1e-3 and errors[1] < 2 * errors[5]
    assert np.all(np.log2(np.divide(errors[::2], errors[1::2])) > 1.85)
    assert np.all(np.log2(np.divide(slips[:4:2], slips[1:4:2])) > 1.85) and max(slips[4:]) < 1e-14


def test_energy_falls_as_slowly() -> None:
    """A four-bar that turns for 20 s: both methods lose the more the less they leave of fast
    motion, and nothing blows up."""
    model = mstmm.compile(mstmm.Scene(**four_bar(speed=8.0) | {"gravity": [0, 0, 0]}))
    lost = {}
    for method in ("genalpha", "genalpha-index3"):
        for radius in (0.5, 0.9):
            run = model.simulate(
                20.0,
                mstmm.methods.GeneralizedAlpha(method, radius=radius),
                step=5e-3,
                output_times=[0.0, 20.0],
            )
            assert run.success, run.message
            energy = run.energy_components()["kinetic"]
            lost[method, radius] = 1 - float(energy[1] / energy[0])
    print(lost)
    for radius in (0.5, 0.9):
        assert abs(lost["genalpha-index3", radius]) < 0.05
    assert abs(lost["genalpha-index3", 0.9]) < abs(lost["genalpha-index3", 0.5])


def test_steps_that_choose_themselves() -> None:
    model = mstmm.compile(mstmm.Scene(**four_bar(speed=3.0)))
    wanted = model.simulate(1.0, rtol=1e-11, output_times=[0.0, 1.0])
    errors = []
    for rtol in (1e-4, 1e-6):
        run = model.simulate(1.0, "genalpha-index3", rtol=rtol, output_times=[0.0, 1.0])
        assert run.success, run.message
        errors.append(float(np.abs(run.q[-1] - wanted.q[-1]).max()))
    print(errors)
    assert errors[1] < 0.1 * errors[0] < 1e-2


def test_driven_and_in_sessions() -> None:
    """A crank that is driven; ticks of a session are the steps of one run."""
    scene = four_bar(foot={"drive": "0.9 + 0.5*sin(3*t)"})
    del scene["hinge"][0]["initial"]
    model = mstmm.compile(mstmm.Scene(**scene))
    run = model.simulate(0.4, "genalpha-index3", step=1e-3, output_times=[0.0, 0.4])
    wanted = model.simulate(0.4, rtol=1e-10, output_times=[0.0, 0.4])
    assert np.abs(run.q[-1] - wanted.q[-1]).max() < 1e-12
    assert np.abs(run.u[-1] - wanted.u[-1]).max() < 1e-4
    session = model.session(method="genalpha-index3", step=1e-3)
    for _ in range(4):
        session.advance(0.1)
    assert np.abs(session.q - run.q[-1]).max() < 1e-12  # code for the scene may have come between


END, STEP = 0.4, 1e-3


@pytest.fixture(scope="module")
def bar() -> mstmm.Model:
    return mstmm.compile(mstmm.Scene(**four_bar(speed=3.0)))


def largest_speed_error(run: mstmm.Result, model: mstmm.Model) -> float:
    """Largest error of the speeds, rad/s, beside DOP853."""
    assert run.success, run.message
    exact = model.simulate(float(run.t[-1]), rtol=1e-11, atol=1e-13, output_times=run.t)
    return float(np.abs(run.u - exact.u).max())


@pytest.mark.parametrize("method", ["genalpha-index3", "hht-index3"])
@pytest.mark.parametrize("before", [1e-4, 1e-6, 1e-8, 1e-11])
def test_a_break_just_before_the_grid(method: str, before: float, bar: mstmm.Model) -> None:
    """A load of next to nothing, switched on `before` (s) a point of the grid."""
    load = {"on": "coupler", "force": [f"where(t < {0.2 - before:.14f}, 0, 1e-9)", 0, 0]}
    model = mstmm.compile(mstmm.Scene(**four_bar(speed=3.0), load=[load]))
    at: dict[str, Any] = {"step": STEP, "output_times": np.linspace(0.2, END, 201)}
    errors = [largest_speed_error(one.simulate(END, method, **at), bar) for one in (model, bar)]
    print(errors)
    assert errors[0] < 1.2 * errors[1]


def off_in_ticks(model: mstmm.Model, tick: float, step: float, radius: float) -> float:
    """`largest_speed_error` of a session in ticks of `tick` s."""
    session = model.session(
        method=mstmm.methods.GeneralizedAlpha("genalpha-index3", radius=radius), step=step
    )
    exact, errors = model.session(method="dop853", rtol=1e-11, atol=1e-13), []
    while session.t < END:
        session.advance(tick)
        exact.advance(session.t - exact.t)
        errors.append(float(np.abs(session.u - exact.u).max()))
    return max(errors)


@pytest.mark.parametrize("radius", [0.0, 0.8, 0.95])
@pytest.mark.parametrize("tick", [3.3e-3, 3.0001e-3, 2.99999e-3, 1.0001e-3, 7e-4])
def test_ticks_cut_steps(tick: float, radius: float, bar: mstmm.Model) -> None:
    whole = off_in_ticks(bar, STEP, STEP, radius)
    errors = [off_in_ticks(bar, tick, step, radius) for step in (2 * STEP, STEP, STEP / 2)]
    print(whole, errors)
    assert errors[1] < 1.5 * whole and errors[2] < 0.5 * whole
    assert errors[0] < 6 * whole


def test_bounces_just_before_the_grid() -> None:
    """The crank hits a stop at times around a point of the grid, some of them very near to it."""
    scene = four_bar(speed=3.0)
    end: dict[str, Any] = {"output_times": [0.25]}
    free = mstmm.compile(mstmm.Scene(**scene))
    there = free.simulate(0.2, "genalpha-index3", step=STEP, output_times=[0.2])
    errors = []
    for before in np.linspace(0.0, 4e-6, 9):
        stop = there.q[-1, 0] - before * there.u[-1, 0]
        event = {"when": f"foot.q > {stop:.12f}", "do": "bounce", "restitution": 0.6}
        model = mstmm.compile(mstmm.Scene(**scene, event=[event]))
        run = model.simulate(0.25, "genalpha-index3", step=STEP, **end)
        errors.append(largest_speed_error(run, model))
    print(errors)
    assert max(errors) < 2 * np.median(errors) < 1e-3


def test_equal_runs_give_equal_bits(bar: mstmm.Model) -> None:
    """A run stands where the last one began, and begins without slips as that did."""
    runs = [bar.simulate(0.1, "genalpha-index3", step=STEP) for _ in range(3)]
    assert all(np.array_equal(run.u, runs[0].u) for run in runs[1:])


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        (
            mstmm.methods.GeneralizedAlpha("genalpha-index3", radius=1.0),
            "radius = 1: .* would have no damping",
        ),
        ("newmark-index3", "newmark-index3.* would have no damping.*, or newmark, which"),
        ("rk4-index3", 'method "rk4-index3" is not known'),
    ],
)
def test_refused(
    asked: str | mstmm.methods.Method, words: str, pendulum_model: mstmm.Model
) -> None:
    with pytest.raises(SceneError, match=words):
        pendulum_model.simulate(0.1, asked, step=1e-2)


def test_a_tree_has_nothing_to_ask() -> None:
    scene = four_bar()
    scene["hinge"] = scene["hinge"][:2]
    scene["body"] = scene["body"][:2]
    model = mstmm.compile(mstmm.Scene(**scene))
    runs = [model.simulate(0.2, method, step=1e-2) for method in ("genalpha", "genalpha-index3")]
    assert np.array_equal(runs[0].q, runs[1].q)


BESIDE_HINGES: dict[str, dict[str, Any]] = {
    "distances": governor("constraint"), "plane": on_a_plane(), "wire": cycloid(0.4),
    "mimic": four_bar(speed=3.0) | {
        "coupling": [{"expression": "dial.q - foot.q - 0.3*foot.q^2"}],
        "body": [*four_bar()["body"], rod("dial", 0.3)],
        "hinge": [*four_bar(speed=3.0)["hinge"],
                  {"name": "dial", "type": "pin", "inboard": "ground", "outboard": "dial"}],
    },
}  # fmt: skip


@pytest.mark.parametrize("name", BESIDE_HINGES)
def test_constraints_and_couplings_of_coordinates(name: str) -> None:
    model = mstmm.compile(mstmm.Scene(**BESIDE_HINGES[name]), engine="looped")
    wanted = model.simulate(0.2, rtol=1e-11, output_times=[0.2]).q[-1]
    runs = [model.simulate(0.2, "genalpha-index3", step=step) for step in (2e-3, 1e-3)]
    for run in runs:
        closure = run.certificate.loop_closure
        assert run.success and closure is not None and closure.gap < 1e-13
    errors = [float(np.abs(run.q[-1] - wanted).max()) for run in runs]
    print(errors)
    assert errors[0] < 1e-3 and np.log2(errors[0] / errors[1]) > 1.85


@pytest.mark.parametrize(
    ("scene", "row"),
    [
        (on_a_road(), 'found constraint "road" on speeds'),
        (four_bar() | {"coupling": [{"name": "led", "speeds": "foot.u", "equals": 1.0}]},
         'found coupling "led" on speeds'),
    ],
)  # fmt: skip
def test_rows_of_speeds_have_no_positions(scene: dict[str, Any], row: str) -> None:
    model = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    with pytest.raises(mstmm.SceneError, match=f"{row}; use genalpha"):
        model.simulate(0.1, "genalpha-index3", step=1e-3)
