"""A four-bar linkage: whichever hinge is cut, coordinates, laws and drives stay what they are."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest

import mstmm
from tests.support.models import compile_scene
from tests.support.scenes.published_mechanisms import Scene, rod

LENGTHS = {"crank": 0.5, "coupler": 1.1, "rocker": 0.8}
GROUND = 1.2
PINS = ("crank_pin", "coupler_pin", "rocker_pin", "closing_pin")

#: A spring, a damper, friction, an effort and a rotor, spread over the pins.
LAWS: dict[str, Scene] = {
    "crank_pin": {"stiffness": 3.0, "effort": "0.5*cos(3*t)", "inertia": 0.02},
    "coupler_pin": {"damping": 0.2, "inertia": 0.05},
    "rocker_pin": {"stiffness": 2.0, "rest": 0.3, "friction": {"coulomb": 0.1}},
    "closing_pin": {"stiffness": 1.0, "damping": 0.1, "effort": "0.2*u", "inertia": 0.03},
}


def angles(crank: float) -> tuple[float, float, float, float]:
    """Coordinates of the pins with the coupler above the crank."""
    a, b, c = LENGTHS.values()
    tip = a * np.array([np.cos(crank), np.sin(crank)])
    way = np.array([GROUND, 0.0]) - tip
    length = float(np.linalg.norm(way))
    coupler = float(np.arctan2(way[1], way[0]))
    coupler += float(np.arccos((b**2 + length**2 - c**2) / (2 * b * length)))
    top = tip + b * np.array([np.cos(coupler), np.sin(coupler)])
    rocker = float(np.arctan2(top[1], top[0] - GROUND))
    return crank, coupler - crank, rocker, rocker - coupler


def linkage(cut: str | None, laws: bool = True, **more: Scene) -> Scene:
    """The linkage with `more` keys of pins; crank at 0.7 rad and 1 rad/s."""
    ends = (("ground", "crank"), ("crank.tip", "coupler"), ("ground", "rocker"),
            ("coupler.tip", "rocker.tip"))  # fmt: skip
    hinges: list[Scene] = []
    for name, (inboard, outboard), angle in zip(PINS, ends, angles(0.7), strict=False):
        hinge: Scene = {"name": name, "type": "pin", "inboard": inboard, "outboard": outboard}
        hinge["initial"] = {"q": angle}
        if laws:
            hinge["law"] = copy.deepcopy(LAWS[name])
        hinges.append(hinge | more.get(name, {}))
    hinges[2]["position"] = [GROUND, 0, 0]
    if "drive" not in hinges[0]:
        hinges[0]["initial"]["u"] = 1.0
    else:
        del hinges[0]["initial"]
    for hinge in hinges:
        if cut is not None and hinge["name"] == cut:
            hinge["cut"] = True
    return {"gravity": [0, -9.81, 0], "body": [rod(n, x) for n, x in LENGTHS.items()],
            "hinge": hinges}  # fmt: skip


#: Every body keeps one of the pins that hold it: only these can be cut.
CUTS = ("rocker_pin", "closing_pin")


def test_cutting_another_hinge_changes_nothing() -> None:
    found = []
    for cut in CUTS:
        one = compile_scene(linkage(cut))
        assert one.loops.cut_hinges == (cut,)
        q, u = one.initial_state()
        result = one.simulate(3.0, rtol=1e-10, atol=1e-12, output_times=[0.0, 1.5, 3.0])
        assert result.success, result.message
        loads = [np.concatenate([result.force(n), result.moment(n)], axis=1) for n in PINS]
        efforts = [result.effort(n) for n in PINS]
        found.append((q, u, one.accelerations(q, u), result.q, loads, efforts, result.energy()))
    for a, b in zip(*found, strict=True):
        assert np.abs(np.array(a) - np.array(b)).max() < 2e-8 * max(1.0, np.abs(np.array(b)).max())
    assert np.abs(found[0][2] - found[1][2]).max() < 1e-11


def lagrange(q: np.ndarray[Any, Any], u: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Accelerations of three uniform rods without laws, by Lagrange's equations of the first kind
    in the absolute angles."""
    a, b, c = LENGTHS.values()
    angle = np.array([q[0], q[0] + q[1], q[2]])
    rate = np.array([u[0], u[0] + u[1], u[2]])
    turn = np.cos(angle[0] - angle[1]), np.sin(angle[0] - angle[1])
    mass = np.array([
        [a * a / 3 + a * a, a * b / 2 * turn[0], 0.0],
        [a * b / 2 * turn[0], b * b / 3, 0.0],
        [0.0, 0.0, c * c / 3],
    ])  # fmt: skip
    force = np.array([
        -a * b / 2 * turn[1] * rate[1] ** 2 - 9.81 * (a / 2 + a) * np.cos(angle[0]),
        a * b / 2 * turn[1] * rate[0] ** 2 - 9.81 * b / 2 * np.cos(angle[1]),
        -9.81 * c / 2 * np.cos(angle[2]),
    ])  # fmt: skip
    arms = np.array([a, b, -c])
    rows = arms * np.array([-np.sin(angle), np.cos(angle)])
    drift = (arms * np.array([np.cos(angle), np.sin(angle)])) @ rate**2
    system = np.block([[mass, rows.T], [rows, np.zeros((2, 2))]])
    absolute = np.linalg.solve(system, np.concatenate([force, drift]))[:3]
    one, two, three = absolute
    return np.array([one, two - one, three, three - two])


@pytest.mark.parametrize("cut", CUTS)
def test_accelerations_are_those_of_lagrange(cut: str) -> None:
    one = compile_scene(linkage(cut, laws=False))
    q, u = one.initial_state()
    assert np.abs(one.accelerations(q, u) - lagrange(q, u)).max() < 1e-12


def test_energy_is_kept_and_the_loop_stays_closed() -> None:
    """10 000 steps of fixed length; angles follow the crank turn by turn."""
    scene = linkage("closing_pin", laws=False)
    scene["hinge"][0]["initial"]["u"] = 8.0
    one = compile_scene(scene)
    result = one.simulate(20.0, "rk4", step=2e-3, output_times=np.linspace(0.0, 20.0, 41))
    assert result.success, result.message
    energy = result.energy()
    assert np.abs(energy - energy[0]).max() < 1e-5 * np.abs(energy).max()
    assert abs(result.q[-1, 0]) > 4 * np.pi
    for q in result.q:
        for name, wanted in zip(PINS[1:], angles(q[0])[1:], strict=True):
            found = q[one.coordinate_layout.hinges[name].q]
            assert abs(np.remainder(found - wanted + np.pi, 2 * np.pi) - np.pi) < 1e-11


@pytest.mark.parametrize("pin", PINS)
def test_driven_pins_in_the_tree_and_cut(pin: str) -> None:
    """The motion and the effort of a drive do not depend on where its pin stands."""
    start = dict(zip(PINS, angles(0.7), strict=True))[pin]
    drive: dict[str, Scene] = {pin: {"drive": f"{start!r} + 0.2*sin(3*t)", "law": {}}}
    found = []
    for cut in CUTS:
        scene = linkage(cut, True, **drive)
        for hinge in scene["hinge"]:
            hinge["initial"] = {"q": dict(zip(PINS, angles(0.7), strict=True))[hinge["name"]]}
            if "drive" in hinge:
                del hinge["initial"]
        one = compile_scene(scene)
        assert one.loops.mobility == 0
        result = one.simulate(0.5, rtol=1e-10, atol=1e-12, output_times=[0.0, 0.25, 0.5])
        assert result.success, result.message
        found.append((result.q, result.u, result.effort(pin)))
    for a, b in zip(*found, strict=True):
        assert np.abs(a - b).max() < 1e-8 * max(1.0, np.abs(b).max())


@pytest.mark.parametrize("kind", ["pin", "fixed"])
@pytest.mark.parametrize("cut", CUTS)
def test_a_hinge_that_lets_go(kind: str, cut: str) -> None:
    """Held until 0.2 s the linkage stands still; then it moves as if it started there, also where
    rows that repeated others while it was held are needed from then on."""
    scene = linkage(cut, laws=False)
    scene["hinge"][0]["initial"].pop("u")
    start = dict(zip(PINS, angles(0.7), strict=True))
    held = scene["hinge"][3]
    held["release"] = "t >= 0.2"
    if kind == "fixed":
        held.pop("initial")
        held["type"] = "fixed"
        held["orientation"] = [0.0, 0.0, start["closing_pin"]]
        for body in scene["body"]:
            body["inertia"][0] = 0.01
    else:
        held.pop("initial")
        held["drive"] = f"{start['closing_pin']!r}"
    one = compile_scene(scene)
    assert one.loops.mobility == 0
    result = one.simulate(0.7, rtol=1e-10, atol=1e-12, output_times=[0.0, 0.2, 0.7])
    assert result.success, result.message
    assert np.abs(result.q[1] - result.q[0]).max() < 1e-9
    closure = result.certificate.loop_closure
    assert closure is not None and closure.gap < 1e-12 and closure.slip < 1e-11
    if kind == "pin":
        free = linkage(cut, laws=False)
        free["hinge"][0]["initial"].pop("u")
        wanted = compile_scene(free).simulate(0.5, rtol=1e-10, atol=1e-12, output_times=[0.0, 0.5])
        assert np.abs(result.q[-1] - wanted.q[-1]).max() < 1e-7
    else:
        assert np.ptp(result.energy()) < 1e-8


def test_a_free_hinge_closes_nothing() -> None:
    scene = linkage(None, laws=False)
    scene["hinge"][3] |= {"type": "free", "cut": True, "initial": {}}
    one = compile_scene(scene)
    assert (one.loops.rank, one.loops.constraint_rows, one.loops.mobility) == (0, (), 3)
    result = one.simulate(0.6, output_times=[0.0, 0.6])
    tree = linkage(None, laws=False)
    del tree["hinge"][3]
    wanted = compile_scene(tree).simulate(0.6, output_times=[0.0, 0.6])
    assert np.abs(result.q[-1, :3] - wanted.q[-1]).max() < 1e-7


def test_an_event_reads_a_cut_hinge() -> None:
    scene = linkage("closing_pin", laws=False)
    scene["event"] = [{"when": "closing_pin.q > 1.0", "do": "stop"}]
    result = compile_scene(scene).simulate(3.0)
    assert "stopped by event" in result.message
    assert abs(result.q[-1, 3] - 1.0) < 1e-8


def rocker_driven() -> mstmm.Model:
    """The rocker turns on beyond its dead centres, where the loop would have to tear."""
    start = dict(zip(PINS, angles(0.7), strict=True))["rocker_pin"]
    scene = linkage("closing_pin", False, rocker_pin={"drive": f"{start!r} + t"})
    scene["hinge"][2].pop("initial")
    scene["hinge"][0]["initial"].pop("u")
    return compile_scene(scene)


def test_a_start_that_cannot_be_closed_is_refused() -> None:
    with pytest.raises(mstmm.SceneError, match=r'"closing_pin" at t = 2 s: its loop is open'):
        rocker_driven().simulate(2.1, t_start=2.0)


def test_a_drive_beyond_the_mechanism_ends_the_run() -> None:
    result = rocker_driven().simulate(5.0, mstmm.methods.Method(max_steps=20000), rtol=1e-6)
    assert not result.success
    assert result.t[-1] < 2.0
