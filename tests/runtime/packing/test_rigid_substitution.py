"""Bodies that respond one way in closed loops: a rod's vibration by its own equations, the same for
every cut, beside coupled bodies, and what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mstmm
from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.runtime.result.flexible.modal_participation import participation_by_body
from mstmm.runtime.result.observations import Observations
from mstmm.runtime.result.one_way.response import modal_loads, rigidified_bodies
from mstmm.runtime.result.one_way.result import OneWayResult
from tests.support.flexible.rigid_shapes import rigid_shapes
from tests.system.loops.test_flexible_against_tree import ANGLE, CRANK, ROD, Scene, slider_crank

CUTS = ("wrist", "turned", "guide")
STIFFNESS, LINE, SPEED, RATIO = 300.0, 1.5, 8.0, 0.01
TIMES = np.linspace(0.0, 0.5, 26)


def linkage(cut: str = "wrist", driven: bool = False, **beam: Any) -> Scene:
    """The slider-crank, its rod between pins with the shapes of their own."""
    scene = slider_crank(cut, STIFFNESS)
    own = {"frame": "chord", "basis": "simply-supported", "damping": RATIO} | beam
    scene["beam"][0] |= own
    if driven:
        del scene["hinge"][0]["initial"]
        scene["hinge"][0]["drive"] = f"{ANGLE} + {SPEED}*t"
    return scene


def responding(scene: Scene, level: str | None = "one-way") -> OneWayResult:
    model = mstmm.compile(mstmm.Scene(**scene), "looped", flexibility=level)
    result = model.simulate(TIMES[-1], output_times=TIMES, rtol=1e-10, atol=1e-12)
    assert isinstance(result, OneWayResult)
    return result


def rod_by_itself() -> Array:
    """Deflection (times,) of the middle of a rod between a crank that turns steadily and a slider:
    EI w_xxxx + m (w_tt + a + x alpha) = 0 on two supports, a the acceleration of the crank's end
    across the rod with the weight, alpha the angular one, by two sine shapes."""
    k = np.arange(1, 3)
    omega = np.sqrt(STIFFNESS / LINE) * (k * np.pi / ROD) ** 2
    of_shift, of_turn = 2 * (1 - (-1.0) ** k) / (k * np.pi), -2 * ROD * (-1.0) ** k / (k * np.pi)

    def slope(t: float, y: Array) -> Array:
        turned = ANGLE + SPEED * t
        sine, cosine = np.sin(turned), np.cos(turned)
        lean = np.arcsin(CRANK * sine / ROD)
        rate = CRANK * SPEED * cosine / (ROD * np.cos(lean))
        second = (rate**2 * np.sin(lean) - CRANK / ROD * SPEED**2 * sine) / np.cos(lean)
        end = np.array([0, 9.81]) - CRANK * SPEED**2 * np.array([cosine, sine])
        load = -of_shift * (end @ [np.sin(lean), np.cos(lean)]) + of_turn * second
        return np.concatenate([y[2:], load - 2 * RATIO * omega * y[2:] - omega**2 * y[:2]])

    run = solve_ivp(slope, (0, TIMES[-1]), np.zeros(4), "DOP853", TIMES, rtol=1e-10, atol=1e-14)
    return np.asarray(np.sin(k * np.pi / 2) @ run.y[:2])


@pytest.mark.parametrize("cut", CUTS)
def test_a_rod_vibrates_by_its_own_equations(cut: str) -> None:
    """Whichever hinge closes the loop; its ends stay on their pins and the slider on its way."""
    found, expected = responding(linkage(cut, driven=True)), rod_by_itself()
    bent = found.deflection("bar", ROD / 2)
    np.testing.assert_allclose(bent[:, 1], expected, atol=1e-6 * np.abs(expected).max())
    assert np.abs(expected).max() > 5e-4
    for end, rigid in (("bar.root", "crank.tip"), ("bar.tip", "slider"), ("slider", "slider")):
        apart = found.position(end) - found.rigid.position(rigid)
        assert np.abs(apart).max() < 1e-10


@pytest.mark.parametrize("cut", CUTS)
def test_the_end_turns_with_the_shapes_and_the_slider_does_not(cut: str) -> None:
    found = responding(linkage(cut, driven=True))
    (body,) = rigidified_bodies(found.model).one_way.values()
    expected = found.response("bar").eta @ body.ports["tip"].theta[2]
    np.testing.assert_allclose(response_angles(found, "bar.tip"), expected, atol=1e-9)
    assert np.abs(expected).max() > 1e-3
    assert np.abs(response_angles(found, "slider")).max() == 0


def response_angles(found: OneWayResult, name: str) -> Array:
    """Angles (times,) about z by which the response turns a body or an end."""
    half = [np.arctan2(q[:, 3], q[:, 0]) for q in
            (found.orientation(name), found.rigid.orientation(name))]  # fmt: skip
    return np.angle(np.exp(2j * (half[0] - half[1])))


@pytest.mark.parametrize("cut", CUTS)
def test_loads_are_in_balance(cut: str) -> None:
    """What acts on the rod in the run, less its inertia, does no work in its rigid motions."""
    scene = linkage(cut)
    scene["load"] = [{"on": "bar.tip", "force": [3.0, "sin(5*t)", 0]},
                     {"name": "wind", "on": "bar", "force_per_length": [0, 2.0, 0]}]  # fmt: skip
    scene["spring"] = [
        {"from": "ground", "to": "bar.root", "law": {"stiffness": 50.0, "rest": 0.1}}
    ]
    found = responding(scene)
    (body,) = rigidified_bodies(found.model).one_way.values()
    observed = Observations(found.model, found.trajectory)
    left = modal_loads(found.model, rigid_shapes(body), observed)
    assert np.abs(found.force("knee")).max() > 20
    assert np.abs(left).max() < 1e-8


def test_a_constraint_in_place_of_a_hinge() -> None:
    """The tip held on the way of the slider, and no slider: that of one almost without mass."""
    scene = linkage()
    scene["body"] = [body for body in scene["body"] if body["name"] != "slider"]
    scene["hinge"] = scene["hinge"][:2]
    scene["constraint"] = [{"name": "way", "type": "point-on-plane", "from": "ground",
                            "to": "bar.tip", "normal": [0, 1, 0]}]  # fmt: skip
    light = linkage()
    light["body"][1] |= {"mass": 1e-9, "inertia": [1e-9] * 3}
    one, other = responding(scene), responding(light)
    scale = np.abs(other.response("bar").eta).max()
    np.testing.assert_allclose(
        one.response("bar").eta, other.response("bar").eta, atol=1e-6 * scale
    )
    np.testing.assert_allclose(one.position("bar.tip")[:, 1], 0, atol=1e-11)
    np.testing.assert_allclose(one.position("bar.tip"), other.position("bar.tip"), atol=1e-7)


def test_a_stiff_rod_is_nearly_that_of_the_coupled_run() -> None:
    """Its crank driven, vibration damped away: what is left out is of second order."""
    scene = linkage(driven=True, damping=0.5)
    scene["beam"][0]["bending_stiffness"] = 3000.0
    coupled = mstmm.compile(mstmm.Scene(**scene), "looped").simulate(
        TIMES[-1], output_times=TIMES, rtol=1e-9
    )
    found, expected = (r.deflection("bar", ROD / 2)[5:, 1] for r in (responding(scene), coupled))
    assert np.abs(found - expected).max() < 2e-3 * np.abs(expected).max()


@pytest.mark.parametrize("cut", CUTS)
@pytest.mark.parametrize("heavy", [1.0, 1000.0])
def test_share_of_the_inertia_that_the_mechanism_shows(cut: str, heavy: float) -> None:
    """chi of one shape: omega^2 with the crank held is (1 - chi) of that with the crank free."""
    scene = linkage(cut, modes={"y": 1, "z": 0})
    scene["hinge"][0]["initial"]["u"] = 0.0
    crank = scene["body"][0]
    crank["mass"], crank["inertia"] = heavy, [heavy * x for x in crank["inertia"]]
    chi = float(participation_by_body(responding(scene)._flexible)["bar"][0])
    free = mstmm.compile(mstmm.Scene(**(scene | {"gravity": [0, 0, 0]})), "looped").modes(
        2, damped=False
    )
    own = np.sqrt(STIFFNESS / LINE) * (np.pi / ROD) ** 2
    assert 1 - (own / free.omega[1]) ** 2 == pytest.approx(chi, rel=1e-6, abs=1e-9)
    assert (chi > 0.02) == (heavy == 1.0)


def test_what_hangs_on_the_rod_beside_the_loop_moves_along(tmp_path: Path) -> None:
    """A bob on the pin of the tip turns with the section, as on an open tree; saved and loaded."""
    scene = linkage(driven=True)
    bob = {"name": "bob", "mass": 0.1, "center_of_mass": [0, -0.1, 0], "inertia": [1e-3] * 3}
    scene["body"].append(bob)
    scene["hinge"].append({"name": "bolt", "type": "pin", "inboard": "bar.tip", "outboard": "bob"})
    found = responding(scene)
    (body,) = rigidified_bodies(found.model).one_way.values()
    turn = found.response("bar").eta @ body.ports["tip"].theta[2]
    np.testing.assert_allclose(response_angles(found, "bob"), turn, atol=1e-9)
    assert np.abs(turn).max() > 1e-3
    loaded = mstmm.load_result(found.save(tmp_path / "run.nc"))
    assert isinstance(loaded, OneWayResult)
    np.testing.assert_allclose(loaded.orientation("bob"), found.orientation("bob"), atol=1e-9)


def test_loads_of_sections_are_told_by_the_shapes_alone() -> None:
    """The pins' loads of the rigid run do not carry the vibration: no equilibrium is asked for."""
    found = responding(linkage(driven=True, modes={"y": 6, "z": 0}))
    moment = found.bending_moment("bar", ROD / 2, source="shapes")
    coupled = mstmm.compile(mstmm.Scene(**linkage(driven=True)), "looped")
    run = coupled.simulate(TIMES[-1], output_times=TIMES, rtol=1e-9)
    expected = run.bending_moment("bar", ROD / 2)
    np.testing.assert_allclose(moment, expected, atol=0.03 * np.abs(expected).max())
    with pytest.raises(SceneError, match='"bar": loop loads on its ends are those of the rig'):
        found.section_force("bar", 0.1)
    assert "missed" not in str(found.certificate) and not found.warnings


def test_the_end_that_holds_a_body_is_that_of_the_tree() -> None:
    """Whatever stands first: loads of the sections of a coupled rod, its wrist written first."""
    scene = linkage("turned", driven=True)
    runs = []
    for hinges in (scene["hinge"], scene["hinge"][::-1]):
        model = mstmm.compile(mstmm.Scene(**scene | {"hinge": hinges}), "looped")
        run = model.simulate(0.1, output_times=[0.1], rtol=1e-10, atol=1e-12)
        runs.append(run.bending_moment("bar", ROD / 3))
    np.testing.assert_allclose(runs[0], runs[1], rtol=1e-6)


@pytest.mark.parametrize(
    ("beam", "clamped", "words"),
    [
        ({"frame": "tangent", "basis": "clamped-free"}, False, 'shape y1 moves the end "tip"'),
        (
            {"frame": "mean", "basis": "free-free"},
            False,
            'shape y. moves the end "root", where hin',
        ),
        ({}, True, 'shape y. rotates the end "tip", where hinge "wrist" closes a loop'),
    ],
)
def test_shapes_that_open_the_loop_are_refused(
    beam: dict[str, Any], clamped: bool, words: str
) -> None:
    """Ends that leave their place, and a clamped end that would turn."""
    scene = linkage(**beam)
    if clamped:
        scene["hinge"][3]["type"] = "fixed"
        scene["hinge"][2] = {"name": "guide", "type": "planar", "inboard": "ground",
                             "outboard": "slider", "cut": True}  # fmt: skip
        del scene["hinge"][3]["cut"]
    with pytest.raises(SceneError, match=words):
        responding(scene)


def test_a_body_beside_the_loop_may_do_as_it_likes() -> None:
    """A whip on the crank, of shapes that move its ends: as on a crank without rod and slider."""
    whip = {"name": "whip", "length": 0.5, "mass_per_length": 0.4, "bending_stiffness": 8.0,
            "modes": {"y": 2, "z": 0}, "model": "one-way"}  # fmt: skip
    weld = {"name": "weld", "type": "fixed", "inboard": "crank.tip", "outboard": "whip"}
    scene = linkage(driven=True, model="rigid")
    scene["beam"].append(whip)
    scene["hinge"].append(weld)
    alone = {"gravity": scene["gravity"], "body": scene["body"][:1], "beam": [whip],
             "hinge": [scene["hinge"][0], weld]}  # fmt: skip
    found, expected = (responding(one, None).position("whip.tip") for one in (scene, alone))
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_a_coupling_of_hinges_passes_no_loads_through_the_body() -> None:
    """A clamped whip on one of two geared hubs: as on a hub with the inertia of both."""
    hub = {"name": "hub", "mass": 2.0, "inertia": [0.3] * 3, "ends": {"rim": [0.1, 0, 0]}}
    whip = {"name": "whip", "length": 0.5, "mass_per_length": 0.4, "bending_stiffness": 8.0,
            "modes": {"y": 2, "z": 0}, "model": "one-way"}  # fmt: skip
    hinges: list[Scene] = [
        {"name": "axle", "type": "pin", "inboard": "ground", "outboard": "hub"},
        {"name": "weld", "type": "fixed", "inboard": "hub.rim", "outboard": "whip"},
    ]
    torque = {"on": "hub", "moment": [0, 0, "2*sin(9*t)"]}
    one = {"gravity": [0, 0, 0], "body": [hub | {"inertia": [0.6] * 3}], "beam": [whip],
           "hinge": hinges, "load": [torque]}  # fmt: skip
    other = {"name": "shaft", "type": "pin", "inboard": "ground", "outboard": "second"}
    geared = one | {
        "body": [hub, hub | {"name": "second", "ends": {}}], "hinge": [*hinges, other],
        "coupling": [{"name": "gear", "expression": "axle.q + shaft.q"}],
    }  # fmt: skip
    found, expected = (responding(scene, None).response("whip").eta for scene in (geared, one))
    scale = np.abs(expected).max()
    np.testing.assert_allclose(found, expected, atol=1e-6 * scale)
    assert scale > 1e-4
