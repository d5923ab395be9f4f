"""Bodies that are rigid in the run, and their elastic response on top of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import mstmm
from mstmm.errors import SceneError
from mstmm.runtime.result.observations import Observations
from mstmm.runtime.result.one_way.response import (
    Cells,
    Oscillators,
    Response,
    modal_loads,
    rigidified_bodies,
)
from mstmm.runtime.result.one_way.result import OneWayResult
from tests.support.flexible.rigid_shapes import rigid_shapes
from tests.support.scenes import elastic_bar as bar

Array = NDArray[np.float64]


def arm(**changes: Any) -> dict[str, Any]:
    return {
        "name": "arm", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 50.0,
        "polar_inertia_per_length": 1e-3, "torsional_stiffness": 10.0,
        "modes": {"y": 2, "z": 2, "twist": 1},
    } | changes  # fmt: skip


#: A hub on a pin, the arm welded to its rim, a bob on a pin at the arm's tip, loads and a spring.
HUB = {"name": "hub", "mass": 20.0, "inertia": [2.0] * 3, "ends": {"rim": [0.1, 0, 0]}}
BOB = {"name": "bob", "mass": 0.2, "center_of_mass": [0.1, 0, 0], "inertia": [1e-3] * 3}
HINGES: list[dict[str, Any]] = [
    {"name": "axle", "type": "pin", "inboard": "ground", "outboard": "hub",
     "initial": {"q": [0.3]}},
    {"name": "root", "type": "fixed", "inboard": "hub.rim", "outboard": "arm"},
    {"name": "joint", "type": "pin", "axis": [0, 1, 0], "inboard": "arm.tip", "outboard": "bob"},
]  # fmt: skip
LOADS = [
    {"on": "arm.tip", "force": ["sin(3*t)", 0, 0.2]},
    {"name": "wind", "on": "arm", "force_per_length": [0, 0.5, 0.1], "span": [0.2, 0.6],
     "axes": "body"},
]  # fmt: skip
SPRING = {"from": "ground", "to": "arm.tip", "law": {"stiffness": 5.0, "rest": 0.2}}


def scene(**beam: Any) -> mstmm.Scene:
    return mstmm.Scene(
        gravity=[0, -9.81, 0], body=[HUB, BOB], beam=[arm(**beam)], hinge=HINGES, load=LOADS,
        spring=[SPRING],
    )  # fmt: skip


TIMES = np.linspace(0.0, 0.4, 21)


def simulate_level(level: str | None, **beam: Any) -> mstmm.Result:
    return mstmm.compile(scene(**beam), "looped", flexibility=level).simulate(
        0.4, output_times=TIMES
    )


def one_way(**beam: Any) -> OneWayResult:
    result = simulate_level("one-way", **beam)
    assert isinstance(result, OneWayResult)
    return result


# --- the rigid level ------------------------------------------------------------------------------


def by_hand() -> mstmm.Result:
    """The same with a rigid body written in place of the arm, its load per length as a force."""
    rod = {
        "name": "arm", "mass": 1.0, "center_of_mass": [0.5, 0, 0],
        "inertia": [1e-3, 1 / 12 + 5e-4, 1 / 12 + 5e-4],
        "ends": {"root": [0, 0, 0], "tip": [1, 0, 0], "middle": [0.4, 0, 0]},
    }  # fmt: skip
    wind = {"on": "arm.middle", "force": [0, 0.2, 0.04], "axes": "body"}
    tables: dict[str, Any] = {"body": [HUB, BOB, rod], "hinge": HINGES, "spring": [SPRING]}
    model = mstmm.compile(mstmm.Scene(gravity=[0, -9.81, 0], load=[LOADS[0], wind], **tables))
    return model.simulate(0.4, output_times=TIMES)


@pytest.mark.parametrize("level", ["rigid", "one-way"])
def test_rigid_run(level: str) -> None:
    """Mass, inertia, ends and loads are those of the undeformed arm, at both levels."""
    found, expected = simulate_level(level), by_hand()
    assert found.model.coordinate_layout.q_names == ["axle.angle", "joint.angle"]
    assert np.abs(found.q - expected.q).max() < 1e-9
    for hinge in ("axle", "root", "joint"):
        assert np.allclose(found.force(hinge), expected.force(hinge), atol=1e-7)
    if level == "rigid":
        assert np.allclose(found.position("arm.tip"), expected.position("arm.tip"), atol=1e-9)
        assert not isinstance(found, OneWayResult)


def test_the_bodys_own_key_and_the_option_agree(tmp_path: Path) -> None:
    option, key = one_way(), simulate_level(None, model="one-way")
    assert isinstance(key, OneWayResult)
    assert np.array_equal(option.position("bob"), key.position("bob"))
    assert not isinstance(simulate_level("coupled", model="one-way"), OneWayResult)
    loaded = mstmm.load_result(option.save(tmp_path / "run.nc"))
    assert isinstance(loaded, OneWayResult)
    assert np.allclose(loaded.position("bob"), option.position("bob"), atol=1e-12)


@pytest.mark.parametrize(
    ("level", "beam", "words"),
    [
        ("elastic", {}, 'flexibility: expected one of coupled, one-way, rigid, found "elastic"'),
        ("rigid", {"viscous_drag": 0.1}, 'beam "arm": viscous_drag needs model = "flexible"'),
    ],
)
def test_refused(level: str, beam: dict[str, Any], words: str) -> None:
    with pytest.raises(SceneError, match=words):
        simulate_level(level, **beam)


# --- the response ---------------------------------------------------------------------------------


def test_response_improves_on_the_rigid_run() -> None:
    """Heavy hub, stiff arm, no vibration: nearly the coupled motion of all that hangs on it.

    (Once it vibrates it does so without what it carries, at another frequency.)
    """
    stiff = {"bending_stiffness": 2000.0, "torsional_stiffness": 400.0, "initial": "static"}
    coupled, found, rigid = (simulate_level(x, **stiff) for x in ("coupled", "one-way", "rigid"))
    for name in ("arm.tip", "bob"):
        left = np.abs(found.position(name) - coupled.position(name)).max()
        assert left < 0.35 * np.abs(rigid.position(name) - coupled.position(name)).max()
    moved = found.deflection("arm", "tip")
    scale = np.abs(coupled.deflection("arm", "tip")).max()
    assert np.abs(moved - coupled.deflection("arm", "tip")).max() < 0.35 * scale


def test_static_deflection() -> None:
    """A load that does not change, at rest from the static shape: P L^3 / 3 EI and no vibration."""
    hinge = {"name": "wall", "type": "fixed", "inboard": "ground", "outboard": "arm"}
    held = mstmm.Scene(
        gravity=[0, 0, 0], hinge=[hinge], load=[{"on": "arm.tip", "force": [0, 0, 3.0]}],
        beam=[arm(initial="static", basis="static+fixed-interface")],
    )  # fmt: skip
    found = mstmm.compile(held, flexibility="one-way").simulate(0.5)
    tip = found.position("arm.tip")
    assert np.allclose(tip[:, 2], 3.0 / (3 * 50.0), rtol=1e-9)
    assert np.abs(found.velocity("arm.tip")).max() < 1e-9


@pytest.mark.parametrize("kind", ["position", "velocity"])
def test_rates_are_rates(kind: str) -> None:
    """Velocities and accelerations of the superposed motion are its derivatives."""
    step, then = 1e-5, 0.2
    times = then + step * np.arange(-2, 3)
    model = mstmm.compile(scene(), "looped", flexibility="one-way")
    found = model.simulate(0.4, output_times=[*times, 0.4])
    rates = {"position": found.velocity, "velocity": found.acceleration}
    for name in ("arm.tip", "bob", "arm"):
        values = getattr(found, kind)(name)
        slope = (values[3] - values[1]) / (2 * step)
        assert np.allclose(slope, rates[kind](name)[2], rtol=1e-6, atol=1e-6), name


def test_held_section_stays_where_the_hinge_holds_it() -> None:
    """Chord and mean frames: the root does not leave its pin, whatever the shapes do there."""
    pin = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "arm"}
    for frame in ("chord", "mean"):
        free = mstmm.Scene(gravity=[0, -9.81, 0], hinge=[pin], beam=[arm(frame=frame)])
        found = mstmm.compile(free, flexibility="one-way").simulate(0.3)
        assert np.abs(found.position("arm.root")).max() < 1e-12
        assert np.abs(found.velocity("arm.root")).max() < 1e-10
        assert np.abs(found.deflection("arm", 0.5)).max() > 3e-4


def test_finite_elements_respond_one_way() -> None:
    """A step load at the tip of the bar: each mode of a clamped beam swings to twice its share
    12 / beta^4 of the static deflection."""
    elastic = bar.table(model="one-way")
    held = bar.scene(elastic, load=[{"on": "bar.tip", "force": [0, 0, 50.0]}])
    scene_ = held.model_copy(update={"gravity": (0.0, 0.0, 0.0)})
    half = np.pi / 103.85
    found = mstmm.compile(scene_).simulate(half, output_times=[0, half / 2, half])
    tip = found.position("bar.tip")[:, 2]
    static = 50.0 / (3 * bar.EI_Z)
    betas = np.array([1.8751040687, 4.6940911330, 7.8547574382])
    phases = np.outer(found.t, betas**2 * np.sqrt(bar.EI_Z / bar.MASS))
    beam = static * (1 - np.cos(phases)) @ (12 / betas**4)
    assert np.allclose(tip, beam, atol=0.02 * static)
    assert isinstance(found, OneWayResult)
    assert found.response("bar").eta.shape == (3, 10)
    with pytest.raises(SceneError, match='"hub": expected a one-way body: bar'):
        found.response("hub")


def test_one_body_of_two() -> None:
    """A coupled beam on a one-way beam: the one runs, the other responds and carries it along."""
    first = arm(name="first", model="one-way")
    second = arm(name="second", modes={"y": 1})
    hinges = [
        {"name": "axle", "type": "pin", "inboard": "ground", "outboard": "hub"},
        {"name": "a", "type": "fixed", "inboard": "hub.rim", "outboard": "first"},
        {"name": "b", "type": "fixed", "inboard": "first.tip", "outboard": "second"},
    ]
    both = mstmm.Scene(gravity=[0, -9.81, 0], body=[HUB], beam=[first, second], hinge=hinges)
    found = mstmm.compile(both).simulate(0.2)
    assert isinstance(found, OneWayResult)
    assert found.model.coordinate_layout.q_names == ["axle.angle", "second.y1"]
    moved = found.position("second.root") - found.rigid.position("second.root")
    assert np.allclose(found.position("first.tip"), found.position("second.root"), atol=1e-12)
    assert np.abs(moved).max() > 1e-3
    assert np.abs(found.deflection("second", "tip")).max() > 5e-4


def test_loads_are_in_balance() -> None:
    """What acts on a rigid body, less its inertia, does no work in its rigid motions: every load
    on every end is there, and none twice, in space, with skew ends and all kinds of loads."""
    ends = {"side": {"position": 0.3, "orientation": [0.4, -0.2, 0.9]}}
    tree = mstmm.Scene(
        gravity=[1.0, -9.81, 2.0], body=[HUB, BOB, BOB | {"name": "other"}],
        beam=[arm(ends=ends, rotary_inertia=[2e-3, 3e-3], polar_inertia_per_length=5e-3)],
        hinge=[
            {"name": "axle", "type": "ball", "inboard": "ground", "outboard": "hub",
             "initial": {"u": [1.0, -2.0, 0.7]}},
            {"name": "root", "type": "prismatic", "axis": [0.3, 1, 0.2], "inboard": "hub.rim",
             "outboard": "arm", "law": {"stiffness": 100.0, "damping": 1.0}},
            {"name": "joint", "type": "universal", "axis": [0, 1, 0], "axis2": [1, 0, 0],
             "inboard": "arm.tip", "outboard": "bob"},
            {"name": "second", "type": "prismatic", "axis": [0, 1, 1], "inboard": "arm.side",
             "outboard": "other", "law": {"stiffness": 50.0}, "initial": {"q": [0.1]}},
        ],
        load=[*LOADS, {"on": "arm.side", "moment": [0.3, "sin(t)", 0.1], "axes": "body"}],
        spring=[SPRING],
    )  # fmt: skip
    found = mstmm.compile(tree, "looped", flexibility="one-way").simulate(0.5)
    assert isinstance(found, OneWayResult)
    (body,) = rigidified_bodies(found.model).one_way.values()
    observed = Observations(found.model, found.trajectory)
    left = modal_loads(found.model, rigid_shapes(body), observed)
    assert np.abs(found.force("root")).max() > 5
    assert np.abs(left).max() < 1e-9


def test_mass_points_have_no_part_in_it() -> None:
    """Momenta of a body that would carry its mass in points, were it coupled."""
    rotary = {"rotary_inertia": 5e-4}
    plain, points = one_way(**rotary), one_way(**rotary, quadrature=True)
    assert points.body_momentum("arm") == pytest.approx(plain.body_momentum("arm"), rel=1e-12)
    assert points.response("arm").eta == pytest.approx(plain.response("arm").eta, rel=1e-12)


def test_a_hinge_that_lets_go_is_told() -> None:
    hinge = {"name": "wall", "type": "fixed", "inboard": "ground", "outboard": "arm",
             "release": "t >= 0.1"}  # fmt: skip
    thrown = mstmm.Scene(gravity=[0, 0, 0], hinge=[hinge], beam=[arm()])
    found = mstmm.compile(thrown, "looped", flexibility="one-way").simulate(0.2)
    assert any('hinge "wall" releases "arm"' in warning for warning in found.warnings)


@pytest.mark.parametrize("upper", [0.3, 2.0])
@pytest.mark.parametrize("times", [None, np.linspace(0.0, 0.5, 26)])
def test_blows_are_told(upper: float, times: Array | None) -> None:
    """What turns a heavy hub round bends the coupled arm by its own speed, 1.9 rad/s, over that of
    the arm's first shape; the response to the loads between the blows has nothing of it."""
    stop = {"limits": {"upper": upper, "restitution": 0.9}}
    axle: dict[str, Any] = {**HINGES[0], "initial": {"q": [0.2], "u": [1.0]}, "law": stop}
    struck = mstmm.Scene(
        gravity=[0, -9.81, 0], body=[HUB], hinge=[axle, HINGES[1]],
        beam=[arm(mass_per_length=0.1, modes={"y": 2}, initial="static")],
    )  # fmt: skip
    swings = []
    for level in ("coupled", "one-way"):
        found = mstmm.compile(struck, "looped", flexibility=level).simulate(0.5, output_times=times)
        swings.append(np.ptp(found.deflection("arm", "tip")[:, 1]))
        told = [risk.name for risk in found.risks if risk.name == "one-way-blow"]
        assert bool(told) == (level == "one-way" and upper < 1)
    assert (swings[0] > 5 * swings[1]) == (upper < 1)


# --- oscillators ----------------------------------------------------------------------------------


def loads(t: Array) -> Array:
    """Three loads, one of which jumps at t = 1."""
    return np.stack([np.where(t < 1, np.sin(2 * t), 0.5), np.exp(-t), np.cos(3 * t)], axis=-1)


def test_oscillators_follow_any_load() -> None:
    """General damping, frequencies 1 to 100 rad/s, a jump between cells: against an integrator."""
    draw = np.random.default_rng(1).normal(size=(3, 3))
    mass, damping = np.eye(3) + 0.1, 0.1 * draw @ draw.T
    stiffness = np.diag([1.0, 100.0, 1e4]) + 0.5
    start = np.array([0.1, 0, 0, 0, 0.2, 0])

    def rate(t: float, y: Array) -> Array:
        force = loads(np.array(t)) - damping @ y[3:] - stiffness @ y[:3]
        return np.concatenate([y[3:], np.linalg.solve(mass, force)])

    halves, state = [], start
    for begin, end in ((0.0, 1.0 - 1e-13), (1.0, 2.0)):
        times = np.linspace(begin, end, 6)
        part = solve_ivp(rate, (begin, end), state, "DOP853", times, rtol=1e-11, atol=1e-13)
        halves.append(part.y)
        state = part.y[:, -1]
    cells = Cells.from_times(np.array([0.0, 1.0, 2.0]), 24)
    polynomials = cells.polynomials(loads(cells.samples))
    times = np.concatenate([np.linspace(0, 1.0 - 1e-13, 6), np.linspace(1, 2, 6)])
    found = Oscillators(stiffness, damping, mass).motion(
        cells, polynomials, (start[:3], start[3:]), times
    )
    expected = np.hstack(halves).T
    assert np.abs(found[0] - expected[:, :3]).max() < 1e-9
    assert np.abs(found[1] - expected[:, 3:]).max() < 1e-8
    balance = found[2] @ mass + found[1] @ damping + found[0] @ stiffness - loads(times)
    assert np.abs(balance).max() < 1e-7
    assert cells.jumps(polynomials).max() < 1e-9  # the jump at a break is none


@pytest.mark.parametrize("initial", [{}, {"initial": "static"}])
def test_the_response_begins_with_the_run_whatever_is_sampled(
    initial: dict[str, Any], tmp_path: Path
) -> None:
    """Samples that leave the start out, one sample, none: the vibration is the same."""
    model = mstmm.compile(scene(**initial), flexibility="one-way")
    whole = response_of(model.simulate(0.4, output_times=TIMES))
    for rows in ([10, 20], [20], [0], []):
        run = model.simulate(0.4, output_times=TIMES[rows])
        found = response_of(run)
        assert found.eta.shape == (len(rows), 5)
        for part in ("eta", "etad", "etadd"):
            ours, all_ = getattr(found, part), getattr(whole, part)
            scale = np.abs(all_).max() + 1e-12
            np.testing.assert_allclose(ours / scale, all_[rows] / scale, atol=2e-6)
        assert str(run.certificate)
    loaded = mstmm.load_result(model.simulate(0.4, output_times=[0.4]).save(tmp_path / "run.nc"))
    np.testing.assert_allclose(response_of(loaded).eta[-1], whole.eta[-1], rtol=1e-6, atol=1e-12)


def response_of(run: object) -> Response:
    assert isinstance(run, OneWayResult)
    return run.response("arm")


def test_a_run_that_cannot_be_repeated_is_named() -> None:
    model = mstmm.compile(scene(), flexibility="one-way")
    run = model.simulate(0.4, output_times=TIMES)
    again = replace(run.trajectory, settings=replace(run.settings, max_steps=2))
    with pytest.raises(mstmm.NumericalFailure, match="could not be repeated: more steps than"):
        OneWayResult(model, again).response("arm")


@pytest.mark.parametrize("rate", [1.0, 300.0])
def test_critically_damped(rate: float) -> None:
    """No eigenvectors to speak of: 1 - (1 + s) exp(-s) under a step."""
    cells = Cells.from_times(np.array([0.0, 2.0]), 4)
    times = np.linspace(0, 2, 9)
    still = (np.zeros(2), np.zeros(2))
    oscillators = Oscillators(rate**2 * np.eye(2), 2 * rate * np.eye(2), np.eye(2))
    found = oscillators.motion(cells, cells.polynomials(np.ones((24, 2))), still, times)
    s = rate * times
    assert np.allclose(rate**2 * found[0][:, 0], 1 - (1 + s) * np.exp(-s), atol=1e-7)
