"""Assembly: the nearest closed state of a start that does not close."""

from __future__ import annotations

import numpy as np
import pytest

import mstmm
from tests.support.scenes.published_mechanisms import Scene, andrews, four_bars
from tests.system.loops.test_four_bar import PINS, angles, linkage


def perturbed_scene(scene: Scene, seed: int, size: float, kept: str) -> Scene:
    """The scene with starts changed by up to `size`, except that of a hinge, which is held."""
    draw = np.random.default_rng(seed)
    for hinge in scene["hinge"]:
        start = hinge.setdefault("initial", {})
        start.pop("u", None)
        if hinge["name"] == kept:
            hinge["hold"] = True
        else:
            start["q"] = float(start.get("q", 0.0)) + float(draw.uniform(-size, size))
    return scene


@pytest.mark.parametrize("seed", range(10))
def test_a_crank_that_is_held(seed: int) -> None:
    model = mstmm.compile(
        mstmm.Scene(**perturbed_scene(linkage("closing_pin", laws=False), seed, 0.3, "crank_pin"))
    )
    q, _ = model.initial_state()
    assert q[0] == 0.7
    assert np.abs(q - angles(0.7)).max() < 1e-9


@pytest.mark.parametrize("seed", range(5))
def test_forty_windows_and_a_squeezer(seed: int) -> None:
    windows = mstmm.compile(mstmm.Scene(**perturbed_scene(four_bars(40, 1.2), seed, 0.3, "foot0")))
    q, _ = windows.initial_state()
    assert np.abs(np.abs(q[:41]) - 1.2).max() < 1e-8
    squeezer = mstmm.compile(mstmm.Scene(**perturbed_scene(andrews(), seed, 0.3, "beta")))
    assert abs(squeezer.initial_state()[0][0] + 0.0617138900142764) < 1e-15


@pytest.mark.parametrize("size", [1e-6, 1e3, 1e7])
def test_what_is_closed_stays_where_it_is(size: float) -> None:
    """Whatever its size: rounding of large places is no gap."""
    scene = four_bars(5, 0.7)
    for body in scene["body"]:
        body["center_of_mass"] = [size * x for x in body["center_of_mass"]]
        body["ends"] = {name: [size * x for x in end] for name, end in body["ends"].items()}
    for hinge in scene["hinge"]:
        if "position" in hinge:
            hinge["position"] = [size * x for x in hinge["position"]]
    model = mstmm.compile(mstmm.Scene(**scene))
    assert np.abs(np.abs(model.initial_state()[0]) - 0.7).max() < 1e-12
    assert model.loops.rank == 10


def test_what_cannot_close_is_told_with_the_least_gap() -> None:
    """Crank of 0.5 m at 0.7 rad, ground 1.2 m, rocker 0.8 m and a coupler of 0.1 m: in line the
    last two reach up to 0.9 m."""
    scene = linkage("closing_pin", laws=False)
    scene["body"][1]["ends"]["tip"] = [0.05, 0.0, 0.0]
    scene["body"][2]["ends"]["tip"] = [0.2, 0.0, 0.0]
    scene["hinge"][0]["hold"] = True
    tip = 0.5 * np.array([np.cos(0.7), np.sin(0.7)])
    gap = float(np.linalg.norm(tip - [1.2, 0.0])) - 0.25
    with pytest.raises(mstmm.SceneError) as caught:
        mstmm.compile(mstmm.Scene(**scene))
    text = str(caught.value)
    assert 'hinge "closing_pin"' in text and '"crank_pin" fixed' in text
    numbers = [float(word) for word in text.replace(";", " ").split() if word[:1].isdigit()]
    assert abs(numbers[0] - gap) < 0.3 * gap  # of the gap's two components the larger


def test_assemble_near_any_state() -> None:
    model = mstmm.compile(mstmm.Scene(**linkage("rocker_pin", laws=False)))
    wish = model.initial_state()[0]
    wish[model.coordinate_layout.hinges["crank_pin"].q] = 1.3
    q, u = model.assemble(wish, np.zeros(model.nu), hold=["crank_pin"])
    assert (
        np.abs(np.array([q[model.coordinate_layout.hinges[n].q] for n in PINS]) - angles(1.3)).max()
        < 1e-9
    )
    assert not u.any()
    with pytest.raises(mstmm.SceneError, match='hold: there is no hinge "crank"'):
        model.assemble(hold=["crank"])


def test_speeds_that_are_given_stay_what_they_are() -> None:
    model = mstmm.compile(mstmm.Scene(**linkage("closing_pin", laws=False)))
    _, u = model.initial_state()
    assert abs(u[0] - 1.0) < 1e-15
    step = 1e-6
    wanted = (np.array(angles(0.7 + step)) - np.array(angles(0.7 - step))) / (2 * step)
    assert np.abs(u - wanted).max() < 1e-8


def test_a_whole_state_is_a_wish() -> None:
    """With more speeds than freedoms none can be kept: what `assemble` gives is where a run begins
    that is given the same state."""
    model = mstmm.compile(mstmm.Scene(**linkage("closing_pin", laws=False)))
    q, _ = model.initial_state()
    wish, speeds = q + 0.01, np.array([1.5, -0.4, 0.7, 0.2])
    closed, moving = model.assemble(wish, speeds)
    begun = model.simulate(0.0, "dop853", initial=(wish, speeds))
    np.testing.assert_allclose(closed, begun.q[0], rtol=0, atol=1e-3)
    slips = model.simulate(0.0, "dop853", initial=(closed, moving)).u[0] - moving
    assert np.abs(slips).max() < 1e-12 and np.abs(moving).min() > 0.01
    again = model.assemble(closed, moving)
    np.testing.assert_allclose(again, (closed, moving), rtol=0, atol=1e-9)


def test_speeds_that_contradict_each_other() -> None:
    scene = linkage("closing_pin", laws=False)
    scene["hinge"][2]["initial"]["u"] = -3.0
    with pytest.raises(mstmm.SceneError, match="are inconsistent"):
        mstmm.compile(mstmm.Scene(**scene))


def test_a_chain_that_starts_in_line() -> None:
    """Stretched out nothing tells a chain of balls which way to bend; its end is reached anyway."""
    link: Scene = {"mass": 1.0, "inertia": [0.01, 0.01, 0.01], "center_of_mass": [0.05, 0, 0],
                   "ends": {"tip": [0.1, 0, 0]}}  # fmt: skip
    scene: Scene = {
        "gravity": [0, 0, -9.81],
        "chain": [{"name": "links", "count": 12, "inboard": "ground", "body": [link],
                   "hinge": [{"type": "ball"}]}],
        "body": [{"name": "last", "mass": 1.0, "inertia": [0.1, 0.1, 0.1],
                  "ends": {"end": [0.1, 0, 0]}}],
        "hinge": [
            {"name": "before", "type": "ball", "inboard": "links[11].tip", "outboard": "last"},
            {"name": "wall", "type": "ball", "inboard": "ground", "position": [1.0, 0, 0],
             "outboard": "last.end"},
        ],
    }  # fmt: skip
    model = mstmm.compile(mstmm.Scene(**scene))
    assert (model.loops.rank, model.loops.mobility) == (3, 36)
    result = model.simulate(0.3, rtol=1e-8, output_times=[0.0, 0.15, 0.3])
    assert result.success, result.message
    assert np.abs(result.position("last.end") - [1.0, 0.0, 0.0]).max() < 1e-7
    assert np.ptp(result.energy()) < 1e-5
