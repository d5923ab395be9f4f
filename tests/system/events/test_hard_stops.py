"""Limits of hinges that throw back: closed forms, hand calculations, loops, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from tests.support.models import compile_scene
from tests.support.scenes.linkages import four_bar
from tests.support.scenes.published_mechanisms import rod

Scene = dict[str, Any]
G = 9.81


def slider(limits: Any, kind: str = "prismatic", **start: Any) -> Scene:
    """A body that goes on by itself until something stops it."""
    hinge = {"name": "rail", "type": kind, "inboard": "ground", "outboard": "block",
             "law": {"limits": limits}, "initial": start}  # fmt: skip
    return {"gravity": [0, 0, 0], "hinge": [hinge],
            "body": [{"name": "block", "mass": 2.0, "inertia": [0.1, 0.1, 0.1]}]}  # fmt: skip


@pytest.mark.parametrize("method", ["dop853", "rk4", "scipy-DOP853", "rodas4p2"])
def test_between_two_stops(method: str) -> None:
    """2 m/s from the middle of 2 m: 0.5 s to the first stop, then 2, 4 s from one to the other."""
    one = compile_scene(slider({"lower": -1.0, "upper": 1.0, "restitution": 0.5}, q=0.0, u=2.0))
    result = one.simulate(7.0, method, step=0.01 if method == "rk4" else None)
    assert result.success, result.message
    assert np.abs(result.t[result.trajectory.event > 0] - [0.5, 2.5, 6.5]).max() < 1e-9
    assert abs(result.u[-1, 0] + 0.25) < 1e-12
    assert abs(result.q[-1, 0] - 0.875) < 1e-9


def test_one_coordinate_of_several() -> None:
    """y of three is stopped: x and the angle go on."""
    stop = {"upper": 0.3, "restitution": 0.6}
    one = compile_scene(slider([{}, stop, {}], "planar", q=[0, 0, 0], u=[0.2, 1.0, 0.7]))
    result = one.simulate(1.0)
    assert np.abs(result.u[-1] - [0.2, -0.6, 0.7]).max() < 1e-12
    assert [stop.name for stop in one.scene.events] == ["rail.upper[1]"]


def test_the_knee_of_a_chain() -> None:
    """u' = u - (1 + e) (a u) / (a M^-1 a) M^-1 a, with M of both absolute angles by hand."""
    table = {"mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [0, 1 / 12, 1 / 12],
             "ends": {"tip": [1.0, 0, 0]}}  # fmt: skip
    top = {"type": "pin", "initial": {"q": 0.1, "u": -0.5}}
    knee = {"type": "pin", "initial": {"q": 0.2, "u": 0.8},
            "law": {"limits": {"lower": -0.4, "upper": 0.5, "restitution": 0.3}}}  # fmt: skip
    chain = {"name": "arm", "count": 2, "inboard": "ground", "body": [table, table],
             "hinge": [top, knee]}  # fmt: skip
    result = compile_scene({"gravity": [0, -G, 0], "chain": [chain]}).simulate(2.0, rtol=1e-10)
    hit = int(np.flatnonzero(result.trajectory.event > 0)[0])
    assert abs(abs(result.q[hit, 1] - 0.05) - 0.45) < 1e-12
    both = 0.5 * np.cos(result.q[hit, 1])
    mass = np.array([[1 / 3 + 1, both], [both, 1 / 3]])
    row = np.array([-1.0, 1.0])
    before = np.cumsum(result.u[hit - 1])
    answer = np.linalg.solve(mass, row)
    wanted = before - 1.3 * (row @ before) / (row @ answer) * answer
    assert np.abs(np.cumsum(result.u[hit]) - wanted).max() < 1e-11 * np.abs(wanted).max()


@pytest.mark.parametrize("cut", ["tip", "end"])
def test_a_rocker_between_stops(cut: str) -> None:
    """One freedom: all speeds turn round alike, the loop stays closed and the balance is kept."""
    stops = {"lower": 1.35, "upper": 1.6, "restitution": 0.7}
    one = compile_scene(four_bar(speed=2.0, cut=cut, laws={"end": {"limits": stops}}))
    result = one.simulate(1.0, rtol=1e-9, certify=True)
    assert result.success, result.message
    for hit in np.flatnonzero(result.trajectory.event > 0):
        before, behind = result.u[hit - 1], result.u[hit]
        assert np.abs(behind + 0.7 * before).max() < 1e-12 * np.abs(before).max()
    rocker = result.q[:, one.coordinate_layout.hinges["end"].q]
    assert rocker.max() < 1.6 + 1e-12 and rocker.min() > 1.35 - 1e-12
    assert (result.trajectory.event > 0).sum() >= 2
    certificate = result.certificate
    assert certificate.loop_closure is not None and certificate.loop_closure.gap < 1e-12
    assert certificate.energy.relative < 1e-8


def test_what_lies_on_a_stop_needs_one_that_carries() -> None:
    """Thrown back ever lower until t = 2 v / g / (1 - e) after the first blow."""
    scene = slider({"lower": 0.0, "restitution": 0.5}, q=1.0)
    scene |= {"gravity": [0, 0, -G]}
    result = compile_scene(scene).simulate(5.0, rtol=1e-10)
    assert 'stop "rail.lower"' in result.message and "with a stiffness" in result.message
    assert abs(result.t[-1] - np.sqrt(2 / G) * (1 + 2 * 0.5 / 0.5)) < 1e-5


def test_nothing_gives_way() -> None:
    scene = slider({"upper": 0.5, "restitution": 0.5})
    scene["hinge"][0] |= {"drive": "t"}
    del scene["hinge"][0]["initial"]
    result = compile_scene(scene).simulate(1.0)
    assert 'stop "rail.upper"' in result.message and "no motion can respond" in result.message


@pytest.mark.parametrize(
    ("limits", "start", "said"),
    [
        ({"upper": 1.0, "restitution": 0.0}, {}, "more than 0"),
        ({"upper": 1.0, "restitution": 1.5}, {}, "at most 1"),
        ({"upper": 1.0, "restitution": 0.5, "stiffness": 1e4}, {}, "give one"),
        ({"restitution": 0.5}, {}, "lower, upper or both"),
        ({"upper": 1.0}, {}, "a stiffness above 0 .* or a restitution"),
        ({"upper": 1.0, "restitution": 0.5}, {"q": 1.2}, "past the stop"),
        ({"upper": 1.0, "restitution": 0.5}, {"q": 1.0}, "at rest on the stop"),
    ],
)
def test_refused(limits: Scene, start: Scene, said: str) -> None:
    with pytest.raises(mstmm.SceneError, match=said) as caught:
        compile_scene(slider(limits, **start)).simulate(0.1)
    assert "rail" in str(caught.value)


def test_a_start_that_leaves_a_stop_is_taken() -> None:
    one = compile_scene(slider({"upper": 1.0, "restitution": 0.5}, q=1.0, u=-1.0))
    assert one.simulate(0.5).q[-1, 0] == pytest.approx(0.5)


def test_a_start_that_moves_against_a_stop_is_thrown_back() -> None:
    one = compile_scene(slider({"upper": 1.0, "restitution": 0.5}, q=1.0, u=1.0))
    assert one.simulate(0.5).q[-1, 0] == pytest.approx(0.75)


@pytest.mark.parametrize("number", [1, 5])
def test_speeds_that_are_no_rates(number: int) -> None:
    """One message, and none that leads to a stop which would be refused as well."""
    limits: list[Scene] = [{}] * 6
    limits[number] = {"upper": 1.0, "restitution": 0.5}
    with pytest.raises(mstmm.SceneError, match="a free hinge has no limits") as caught:
        mstmm.Scene(**slider(limits, "free"))
    assert "stiffness" not in str(caught.value)


def test_a_knee_stops_as_an_event_does() -> None:
    """The same numbers as the bounce that says it in words."""

    def arm(**more: Any) -> Scene:
        hinges = [
            {"name": "top", "type": "pin", "inboard": "ground", "outboard": "upper",
             "initial": {"q": -1.0, "u": 1.5}},
            {"name": "knee", "type": "pin", "inboard": "upper.tip", "outboard": "lower",
             "initial": {"q": 0.2}, **more},
        ]  # fmt: skip
        return {"gravity": [0, -G, 0], "hinge": hinges,
                "body": [rod("upper", 1.0, 1.0), rod("lower", 0.7, 0.5)]}  # fmt: skip

    law = {"limits": {"upper": 0.3, "restitution": 0.4}}
    stopped = compile_scene(arm(law=law)).simulate(2.0)
    event = {"when": "knee.q[0] > 0.3", "do": "bounce", "restitution": 0.4}
    told = compile_scene(arm() | {"event": [event]}).simulate(2.0)
    assert (stopped.trajectory.event > 0).any()
    assert np.array_equal(stopped.q, told.q) and np.array_equal(stopped.u, told.u)
