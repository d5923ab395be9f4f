"""Events that bounce: closed forms, hand calculations, Carnot's law, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.integrate.c_loop import Status
from tests.runtime.engine.loops.test_acceleration_refinement import LENGTHS, chain
from tests.support.models import compile_scene
from tests.support.scenes.published_mechanisms import rod
from tests.system.loops.test_four_bar import linkage

Scene = dict[str, Any]
G = 9.81


def ball(**event: Any) -> Scene:
    """Two kilograms that fall from 1 m."""
    floor = {"name": "floor", "when": "ball.y <= 0", "do": "bounce", "restitution": 0.8} | event
    return {
        "gravity": [0, -G, 0], "event": [floor],
        "body": [{"name": "ball", "mass": 2.0, "inertia": [0.1, 0.1, 0.1]}],
        "hinge": [{"name": "fall", "type": "prismatic", "inboard": "ground", "outboard": "ball",
                   "axis": [0, 1, 0], "initial": {"q": 1.0}}],
    }  # fmt: skip


@pytest.mark.parametrize("when", ["ball.y <= 0", "fall.q < 0"])
@pytest.mark.parametrize("method", ["dop853", "scipy-DOP853"])
def test_a_ball_loses_its_height_by_squares(when: str, method: str) -> None:
    """Heights e^(2k), times of flight 2 sqrt(2 h / g) each; then it rests, before the end of the
    run, which says so and is no success."""
    result = compile_scene(ball(when=when)).simulate(
        20.0, method, rtol=1e-10, atol=1e-12, certify=True
    )
    assert result.status is Status.CAME_TO_REST and not result.success and not result.trusted
    assert "come to rest" in result.message
    assert "come to rest" in str(result.certificate.verdict())
    assert result.certificate.error is not None
    assert abs(result.t[-1] - np.sqrt(2 / G) * (1 + 2 * 0.8 / 0.2)) < 1e-5
    again = np.flatnonzero(result.trajectory.event > 0)[:20]
    heights = result.u[again, 0] ** 2 / (2 * G)
    assert np.abs(heights / 0.64 ** np.arange(1, 21) - 1).max() < 1e-9


@pytest.mark.parametrize("method", ["dop853", "rodas4p2", "scipy-Radau", "scipy-DOP853"])
@pytest.mark.parametrize("engine", ["looped", "fused"])
def test_blows_alone_do_work(engine: str, method: str) -> None:
    """Where no law and no load does, so that the scene's code has nothing to say of power: the
    first blow takes 1 - e^2 of m g h."""
    run = mstmm.compile(mstmm.Scene(**ball()), engine=engine).simulate(0.7, method)
    assert run.success, run.message
    lost = (1 - 0.8**2) * 2.0 * G
    assert run.quantity("work").values[-1] == pytest.approx(-lost, rel=1e-6)
    assert run.energy()[0] - run.energy()[-1] == pytest.approx(lost, rel=1e-6)


def test_a_wall_that_comes_to_meet() -> None:
    """A floor that rises by 0.5 m/s throws the ball up by e times the speed that they meet with."""
    result = compile_scene(ball(when="ball.y <= 0.5*t", restitution=1.0)).simulate(0.6, rtol=1e-10)
    hit = int(np.flatnonzero(result.trajectory.event > 0)[0])
    before = result.u[hit - 1, 0] - 0.5
    assert before < 0 and abs(result.u[hit, 0] - 0.5 + before) < 1e-12


def pendulum() -> Scene:
    """Two rods on pins; the tip of the second one strikes a wall at x = 0.8 m."""
    hinges = [
        {"name": "top", "type": "pin", "inboard": "ground", "outboard": "upper",
         "initial": {"q": -1.4, "u": 1.5}},
        {"name": "knee", "type": "pin", "inboard": "upper.tip", "outboard": "lower",
         "initial": {"q": 0.2}},
    ]  # fmt: skip
    wall = {"name": "wall", "when": "lower.tip.x > 0.8", "do": "bounce", "restitution": 0.6}
    return {"gravity": [0, -G, 0], "body": [rod("upper", 1.0, 1.0), rod("lower", 0.7, 0.5)],
            "hinge": hinges, "event": [wall]}  # fmt: skip


def test_a_double_pendulum_strikes_a_wall() -> None:
    """u' = u - (1 + e) (A u) / (A M^-1 A^T) M^-1 A^T with M and A of both angles by hand."""
    one = compile_scene(pendulum())
    result = one.simulate(3.0, rtol=1e-10, atol=1e-12)
    hit = int(np.flatnonzero(result.trajectory.event > 0)[0])
    a, b = result.q[hit, 0], result.q[hit].sum()
    before = np.array([result.u[hit - 1, 0], result.u[hit - 1].sum()])
    both = 0.5 * 1.0 * 0.35 * np.cos(a - b)
    mass = np.array([[1 / 3 + 0.5, both], [both, 0.5 * 0.49 / 3]])
    row = np.array([-np.sin(a), -0.7 * np.sin(b)])
    answer = np.linalg.solve(mass, row)
    wanted = before - 1.6 * (row @ before) / (row @ answer) * answer
    found = np.array([result.u[hit, 0], result.u[hit].sum()])
    assert np.abs(found - wanted).max() < 1e-11 * np.abs(wanted).max()
    assert np.all(result.position("lower.tip")[:, 0] < 0.8 + 1e-9)


def kinetic(q: np.ndarray, u: np.ndarray, masses: np.ndarray) -> float:
    """Energy of the rods of a chain in the plane, J."""
    turned, rates = 1j * np.exp(1j * np.cumsum(q[:6])) * LENGTHS, np.cumsum(u[:6])
    middle = np.cumsum(rates * turned) - rates * turned / 2
    own = np.array(LENGTHS) ** 2 / 12 * rates**2
    return float(np.sum(masses * (np.abs(middle) ** 2 + own)) / 2)


def bounce_run(scene: Scene, when: str, restitution: float, until: float) -> mstmm.Result:
    scene["event"] = [{"when": when, "do": "bounce", "restitution": restitution}]
    return compile_scene(scene).simulate(until, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("cut", ["rocker_pin", "closing_pin"])
@pytest.mark.parametrize("pin", ["rocker_pin", "closing_pin"])
def test_a_stop_in_a_four_bar(pin: str, cut: str) -> None:
    """Of one freedom all speeds turn round alike, whether the pin that is stopped is cut or not."""
    scene = linkage(cut, laws=False)
    start = compile_scene(scene)
    place = start.coordinate_layout.hinges[pin].q
    begin, end = (float(x) for x in start.simulate(0.05).q[[0, -1], place])
    result = bounce_run(scene, f"{pin}.q {'>' if end > begin else '<'} {end!r}", 0.4, 0.1)
    hit = int(np.flatnonzero(result.trajectory.event > 0)[0])
    before, behind = result.u[hit - 1], result.u[hit]
    assert np.abs(behind + 0.4 * before).max() < 1e-12 * np.abs(before).max()


def test_carnot_in_a_loop() -> None:
    """Six rods between two points, four freedoms: the loop stays closed where an end strikes, and
    the energy falls by (1-e)/(1+e) times that of the change."""
    masses = np.array([1.0, 0.5, 2.0, 1.0, 1.5, 1.0])
    scene = chain(masses.tolist())
    free = compile_scene(scene).simulate(0.2, output_times=[0.0, 0.2])
    path = free.position("rod2.tip")[:, 1]
    wall = float(path.mean())
    result = bounce_run(scene, f"rod2.tip.y {'>' if path[1] > path[0] else '<'} {wall!r}", 0.3, 0.2)
    hit = int(np.flatnonzero(result.trajectory.event > 0)[0])
    q, before, behind = result.q[hit], result.u[hit - 1], result.u[hit]
    rates = result.velocity("rod2.tip")[[hit - 1, hit], 1]
    assert abs(rates[1] + 0.3 * rates[0]) < 1e-12 * abs(rates[0])
    turning = np.cumsum(behind[:6]) * LENGTHS * 1j * np.exp(1j * np.cumsum(q[:6]))
    assert abs(turning.sum()) < 1e-12 * np.abs(turning).max()
    lost = kinetic(q, before, masses) - kinetic(q, behind, masses)
    whole = kinetic(q, before, masses)
    assert abs(lost - 0.7 / 1.3 * kinetic(q, before - behind, masses)) < 1e-13 * whole


@pytest.mark.parametrize(
    ("event", "said"),
    [
        ({"restitution": 0.0}, "more than 0"),
        ({"restitution": 1.5}, "at most 1"),
        ({"restitution": None}, "needs a number above 0"),
        ({"when": "ball.vy < -1"}, "needs a condition on positions"),
        ({"when": "t > 1"}, "needs a condition on a coordinate"),
        ({"do": "stop"}, 'only do = "bounce" has a restitution'),
    ],
)
def test_refused(event: Scene, said: str) -> None:
    with pytest.raises(mstmm.SceneError, match=said):
        compile_scene(ball(**event))


def test_nothing_gives_way() -> None:
    scene = ball()
    scene["hinge"][0] |= {"initial": {}, "drive": "1 - t"}
    result = compile_scene(scene).simulate(2.0)
    assert not result.success
    assert 'event "floor"' in result.message and "no motion can respond" in result.message


@pytest.mark.parametrize("wall", ["0", "0.2*sin(3*t)"])
def test_blows_do_work_and_balances_are_kept(wall: str) -> None:
    """What a blow takes, and a wall that moves brings, is work: the energy's balance is closed."""
    event = {"when": f"ball.y <= {wall}", "do": "bounce", "restitution": 0.8}
    ball = {"name": "ball", "mass": 0.2, "inertia": [1e-4, 1e-4, 1e-4]}
    fall = {"name": "fall", "type": "prismatic", "inboard": "ground", "outboard": "ball",
            "axis": [0, 1, 0], "initial": {"q": [2.0]}}  # fmt: skip
    scene = mstmm.Scene(gravity=[0, -9.81, 0], body=[ball], hinge=[fall], event=[event])
    run = mstmm.compile(scene, engine="looped").simulate(1.5, certify=True)
    assert run.certificate.energy.relative < 1e-9
    if wall == "0":  # 1 - 0.8^2 of what it fell with
        assert run.work[-1] == pytest.approx(-0.36 * 0.2 * 9.81 * 2.0, rel=1e-9)


def blade_model(when: str) -> mstmm.Model:
    """A hub that swings down with a blade, and a knob on a pin at the tip of that."""
    hub = {"name": "hub", "mass": 2.0, "inertia": [0.1, 0.1, 0.1], "ends": {"rim": [0.2, 0, 0]}}
    knob = rod("knob", 0.2, 0.3)
    hinges = [
        {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "hub",
         "initial": {"q": 0.3, "u": -1.0}},
        {"name": "weld", "type": "fixed", "inboard": "hub.rim", "outboard": "blade"},
        {"name": "ring", "type": "pin", "inboard": "blade.tip", "outboard": "knob",
         "initial": {"q": 0.5, "u": 0.7}},
    ]  # fmt: skip
    blade = {"name": "blade", "length": 1.0, "mass_per_length": 1.2, "bending_stiffness": 20.0,
             "modes": 2}  # fmt: skip
    event = {"name": "floor", "when": when, "do": "bounce", "restitution": 0.6}
    scene = {"gravity": [0, -G, 0], "body": [hub, knob], "hinge": hinges, "beam": [blade]}
    return compile_scene(scene | {"event": [event]})


@pytest.mark.parametrize(("end", "height"), [("blade.tip", -0.5), ("knob.tip", -0.6)])
def test_a_blade_strikes_the_floor(end: str, height: float) -> None:
    """All shapes are struck with it: the mass matrix, and slopes of the height by differences."""
    one = blade_model(f"{end}.y < {height}")
    run = one.simulate(1.0, rtol=1e-9, certify=True)
    assert run.is_comparable and run.certificate.energy.relative < 1e-8
    hit = int(np.flatnonzero(run.trajectory.event > 0)[0])
    q, before, behind = run.q[hit], run.u[hit - 1], run.u[hit]

    def heights(side: float) -> list[float]:
        moved = [q + side * 1e-5 * row for row in np.eye(one.nq)]
        return [float(one.positions(x, end)[1]) for x in moved]

    row = (np.array(heights(-1.0)) - heights(1.0)) / 2e-5
    answer = np.linalg.solve(one.mass_matrix(q), row)
    wanted = before - 1.6 * (row @ before) / (row @ answer) * answer
    assert np.abs(behind - wanted).max() < 1e-7 * np.abs(wanted).max()


def test_a_shape_alone_is_no_place() -> None:
    with pytest.raises(mstmm.SceneError, match="needs a condition on positions"):
        blade_model("blade.q[0] > 0.01").simulate(0.1)


def ball_model(when: str, height: float, speed: float, **more: Any) -> mstmm.Model:
    scene = ball(when=when)
    scene["hinge"][0]["initial"] = {"q": height, "u": speed}
    return compile_scene(scene | more)


@pytest.mark.parametrize("method", ["dop853", "rodas4p2", "scipy-DOP853"])
@pytest.mark.parametrize(
    ("when", "height", "speed"),
    [
        ("ball.y <= 0", 0.0, 0.0),
        ("ball.y <= 0", 1e-12, 0.0),
        ("ball.y <= 0", -0.1, 0.0),
        ("ball.y <= 0", -0.1, -2.0),
        ("fall.q < 0", 0.0, 0.0),
        ("ball.y^2 < 4", 2.0, 0.0),
        ("ball.y <= 0.5*t", 0.0, 0.5),
    ],
)
def test_what_begins_on_a_floor_must_leave_it(
    when: str, height: float, speed: float, method: str
) -> None:
    with pytest.raises(mstmm.SceneError, match='event "floor": the run starts'):
        ball_model(when, height, speed).simulate(0.1, method)


@pytest.mark.parametrize("method", ["dop853", "scipy-DOP853"])
@pytest.mark.parametrize("sinks", [0.0, 0.5])
def test_what_leaves_its_floor_comes_back_to_it(sinks: float, method: str) -> None:
    """3 m/s upwards from a floor that sinks: together again after 2 (3 + sinks) / g."""
    run = ball_model(f"ball.y <= -{sinks}*t", 0.0, 3.0).simulate(0.8, method, rtol=1e-10)
    assert run.t[run.event > 0][-1] == pytest.approx(2 * (3.0 + sinks) / G, rel=1e-9)
    assert run.success and run.u[-1, 0] > -3.0


def test_what_begins_with_a_blow_is_thrown_back_at_once() -> None:
    run = ball_model("ball.y <= 0", 0.0, -1.0).simulate(0.15)
    assert run.t[run.event > 0].tolist() == [0.0]
    assert run.u[-1, 0] == pytest.approx(0.8 - G * 0.15, rel=1e-9)


def test_from_behind_a_floor_the_way_out_is_open() -> None:
    """0.1 m below it by 3 m/s upwards: thrown back when the ball comes down to it."""
    run = ball_model("ball.y <= 0", -0.1, 3.0).simulate(0.7, rtol=1e-10)
    hits = run.t[run.event > 0]
    assert hits.tolist() == pytest.approx([(3.0 + np.sqrt(9.0 - 0.2 * G)) / G], rel=1e-9)


def test_what_an_acceleration_takes_away_may_begin_at_rest_on_a_wall() -> None:
    """A ceiling, and a rod whose tip is as near to a wall as it comes: both fall away from it."""
    assert ball_model("ball.y >= 1", 1.0, 0.0).simulate(0.4).q[-1, 0] == pytest.approx(1 - G * 0.08)
    hinge = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod"}
    wall = {"name": "wall", "when": "rod.tip.x >= 1", "do": "bounce", "restitution": 0.5}
    one = compile_scene({"gravity": [0, -G, 0], "body": [rod("rod", 1.0, 1.0)], "hinge": [hinge],
                 "event": [wall]})  # fmt: skip
    assert one.simulate(0.5).success


def test_two_balls_that_touch() -> None:
    """Both fall: nothing moves them together or apart."""
    bodies = [{"name": name, "mass": 1.0, "inertia": [0.1, 0.1, 0.1]} for name in "ab"]
    hinges = [{"name": f"f{name}", "type": "free", "inboard": "ground", "outboard": name,
               "initial": {"q": [place, 0, 0, 1, 0, 0, 0]}}
              for name, place in (("a", 0.0), ("b", 0.2))]  # fmt: skip
    event = {"name": "hit", "when": "(a.x - b.x)^2 + (a.y - b.y)^2 <= 0.04", "do": "bounce",
             "restitution": 1.0}  # fmt: skip
    scene = {"gravity": [0, -G, 0], "body": bodies, "hinge": hinges, "event": [event]}
    with pytest.raises(mstmm.SceneError, match='event "hit"'):
        compile_scene(scene).simulate(0.1)


@pytest.mark.parametrize("restitution", [0.5, 0.3, 0.1, 0.01])
@pytest.mark.parametrize(
    "method", ["dop853", "scipy-DOP853", "scipy-Radau", "scipy-LSODA", "sundials-BDF"]
)
def test_a_ball_comes_to_rest_on_its_floor(method: str, restitution: float) -> None:
    """Flights by flights shorter, none of which a step may span: t = sqrt(2 h / g) (1 + e)/(1 - e)
    if there were no end of them."""
    one = compile_scene(ball(when="ball.y <= 0", restitution=restitution))
    height = one.initial_state()[0][0]
    run = one.simulate(10.0, method)
    assert "bounces accumulate" in run.message
    assert run.q.min() > -1e-9
    ideal = np.sqrt(2 * height / G) * (1 + restitution) / (1 - restitution)
    assert run.t[-1] == pytest.approx(ideal, rel=1e-4)


def test_a_stop_that_was_asked_for_is_a_success() -> None:
    scene = ball(when="ball.y <= 0")
    low = {"name": "low", "when": "ball.y < 0.5", "do": "stop"}
    scene["event"] = [*scene["event"], low]
    run = compile_scene(scene).simulate(20.0)
    assert run.status is Status.STOPPED and run.success
    assert run.t[-1] == pytest.approx(np.sqrt(1.0 / G), rel=1e-9)


@pytest.mark.parametrize("push", [1.0, -1.0])
def test_what_a_controller_does_at_the_start_tells_a_start_on_a_stop(push: float) -> None:
    """Its input counts, not what the input was before it acted."""
    limits = {"lower": -1.0, "upper": 0.0, "restitution": 0.5}
    scene = {
        "gravity": [0, 0, 0], "body": [{"name": "cart", "mass": 1.0}],
        "input": [{"name": "motor", "value": -push}], "output": [{"name": "place", "of": "rail.q"}],
        "controller": [{"name": "c", "sample_time": 10.0, "inputs": ["place"],
                        "outputs": ["motor"], "D": [[0.0]], "offset": [push]}],
        "hinge": [{"name": "rail", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground",
                   "outboard": "cart", "law": {"effort": "motor", "limits": limits}}],
    }  # fmt: skip
    if push > 0:
        with pytest.raises(mstmm.SceneError, match="at rest on the stop"):
            compile_scene(scene).simulate(1.0)
    else:
        assert compile_scene(scene).simulate(1.0).q[-1, 0] == pytest.approx(-0.5)


@pytest.mark.parametrize("far", [0.0, 7e6])
def test_a_start_is_on_a_stop_by_its_own_coordinate(far: float) -> None:
    """However far and fast the rest of the scene is."""

    def begun_at(angle: float, rate: float) -> mstmm.Model:
        free = {"name": "orbit", "type": "free", "inboard": "ground", "outboard": "hub",
                "initial": {"q": [far, 0, 0, 1, 0, 0, 0],
                            "u": [0, far / 1e3, 0, 0, 0, 0]}}  # fmt: skip
        pin = {"name": "panel_pin", "type": "pin", "inboard": "hub", "outboard": "panel",
               "initial": {"q": angle, "u": rate},
               "law": {"limits": {"lower": -1.0, "upper": 0.0, "restitution": 0.5}}}  # fmt: skip
        bodies = [{"name": "hub", "mass": 100.0, "inertia": [10.0] * 3},
                  {"name": "panel", "mass": 5.0, "center_of_mass": [0.5, 0, 0],
                   "inertia": [0.1, 1.5, 1.5]}]  # fmt: skip
        return compile_scene({"gravity": [0, 0, 0], "body": bodies, "hinge": [free, pin]})

    assert begun_at(-5e-3, 0.0).simulate(0.1).success
    assert begun_at(0.0, -5e-6).simulate(0.1).success
    with pytest.raises(mstmm.SceneError, match="past the stop"):
        begun_at(5e-3, -0.1).simulate(0.1)


@pytest.mark.parametrize("rate", [10.0, 1e4])
def test_a_wheel_that_touches_at_its_lowest_point_goes_on(rate: float) -> None:
    wheel = {"name": "wheel", "mass": 1.0, "inertia": [0.1] * 3, "ends": {"rim": [1, 0, 0]}}
    pin = {"name": "axle", "type": "pin", "inboard": "ground", "outboard": "wheel",
           "initial": {"q": -np.pi / 2, "u": rate}}  # fmt: skip
    event = {"name": "floor", "when": "wheel.rim.y <= -1", "do": "bounce", "restitution": 0.5}
    scene = {"gravity": [0, 0, 0], "body": [wheel], "hinge": [pin], "event": [event]}
    run = compile_scene(scene).simulate(0.1 / rate)
    assert run.q[-1, 0] == pytest.approx(-np.pi / 2 + 0.1)
