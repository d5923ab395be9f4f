"""Wishes that contradict each other, misfits, and starts beside singular poses."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest

import mstmm
from tests.support.models import compile_scene
from tests.support.scenes.linkages import angles, cranks, four_bar
from tests.support.scenes.published_mechanisms import four_bars

Scene = dict[str, Any]


def hinge(scene: Scene, name: str) -> Scene:
    found: Scene = next(one for one in scene["hinge"] if one["name"] == name)
    return found


def driven_four_bar(**drives: str) -> Scene:
    scene = four_bar()
    for name, text in drives.items():
        hinge(scene, name).pop("initial", None)
        hinge(scene, name)["drive"] = text
    return scene


def hold_hinges(*names: str, off: float = 0.0) -> Scene:
    scene = four_bar()
    for name in names:
        hinge(scene, name)["hold"] = True
    hinge(scene, names[-1])["initial"]["q"] += off
    return scene


def fast(**speeds: float) -> Scene:
    scene = four_bar()
    for name, speed in speeds.items():
        hinge(scene, name).setdefault("initial", {})["u"] = speed
    return scene


REST = angles(0.9)[1]
SHARED = (
    r'the drives of hinges "foot" and "end" move the same degree of freedom .*; omit one of these'
)
LEAD = {"name": "lead", "expression": "end.q", "equals": "1 + t"}
REFUSED = {
    "drives that cannot be": (
        driven_four_bar(foot="0.9", end="1.2"),
        r'has a gap of 0\.10.* m with "foot", "end" fixed; ' + SHARED,
    ),
    "drives at odds in speed": (
        driven_four_bar(foot="0.9 + t", end=f"{REST!r}"),
        r'speeds given for "foot", "end" are inconsistent .* m/s.*; ' + SHARED,
    ),
    "drives a little apart": (
        driven_four_bar(foot="0.9 + t", end=f"{REST + 4e-3!r} + t"),
        r"(violated by|gap of) 0\.00.*[:;] " + SHARED,
    ),
    "drives of cut hinges": (
        driven_four_bar(foot="0.9 + t", tip="0.3 + t"),
        r'rad with "foot", "tip" fixed; '
        r'the drives of hinges "foot" and "tip" move the same degree of freedom',
    ),
    "a drive and a wish": (
        driven_four_bar(foot="0.9 + t") | {"coupling": [LEAD]},
        r'with "foot" fixed.*drive fewer',
    ),
    "more held than is free": (
        hold_hinges("foot", "end", off=0.2),
        r'with "foot", "end" fixed.*fix or drive fewer.*; hold fixes 2 '
        r"coordinates, the mechanism has 1 degree of freedom$",
    ),
    "one held out of reach": (hold_hinges("end", off=-1.3), r'with "end" fixed; [^;]*$'),
    "speeds at odds": (fast(foot=1.0, end=5.0), r'speeds given for "foot", "end" are inconsistent'),
    "an axis off by a hundredth": (
        four_bar(end={"axis": [math.sin(0.01), 0, math.cos(0.01)]}),
        'axis of hinge "end" is 0.01 rad',
    ),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_is_refused_is_told(what: str) -> None:
    scene, words = REFUSED[what]
    with pytest.raises(mstmm.SceneError, match=words) as caught:
        compile_scene(scene)
    assert "; " in str(caught.value)


def test_drives_that_part_on_the_way_are_told() -> None:
    """At rest at the start they agree."""
    result = compile_scene(driven_four_bar(foot="0.9", end=f"{REST!r} + t^2")).simulate(
        0.5, "dop853"
    )
    assert not result.success
    assert re.search(f"no nearby state closes it; {SHARED}", result.message)


def test_three_drives_on_two_freedoms() -> None:
    """Two four-bars, one of them driven twice: only its own drives are named."""
    one, other = driven_four_bar(foot="0.9 + t", end=f"{REST!r}"), driven_four_bar(foot="0.9 + t")
    for body in other["body"]:
        body["name"] += "2"
    for joint in other["hinge"]:
        joint["name"] += "2"
        for key in ("inboard", "outboard"):
            joint[key] = re.sub("^(crank|coupler|rocker)", r"\g<1>2", joint[key])
    scene = {**one, "body": one["body"] + other["body"], "hinge": one["hinge"] + other["hinge"]}
    with pytest.raises(mstmm.SceneError, match=SHARED):
        compile_scene(scene)


def test_one_drive_too_many_of_a_chain_of_windows() -> None:
    """Two rows of cranks side by side, all driven."""
    scene = four_bars(2, angle=1.1)
    for k, pace in enumerate((1.0, 2.0, 1.0)):
        foot = hinge(scene, f"foot{k}")
        foot.pop("initial")
        foot["drive"] = f"1.1 + {pace}*t"
    told = '"foot0", "foot1", "foot2" move the same degree of freedom .*; omit all but one of these'
    with pytest.raises(mstmm.SceneError, match=told):
        compile_scene(scene)


def test_what_agrees_is_taken() -> None:
    """As many drives and holds as one likes, where they say the same."""
    assert compile_scene(driven_four_bar(foot="0.9", end=f"{REST!r}")).simulate(0.1).success
    assert compile_scene(hold_hinges("foot", "knee", "tip", "end")).loops.mobility == 1


@pytest.mark.parametrize("misfit", [0.0, 1e-7, 1e-5, 1e-4, 3e-4])
def test_a_misfit_leaves_open_what_exact_axes_do(misfit: float) -> None:
    model = compile_scene(four_bar(end={"axis": [math.sin(misfit), 0, math.cos(misfit)]}))
    assert model.loops.indeterminate_reactions == dict.fromkeys(("foot", "knee", "tip", "end"),
                                                   ("fz", "mx", "my"))  # fmt: skip


@pytest.mark.parametrize("angle", [1e-7, 1e-6, 1e-5, 1e-4])
def test_one_speed_beside_a_singular_pose(angle: float) -> None:
    """Rows that repeat others but for what rounding makes of them contradict nothing."""
    scene = four_bars(2, angle=angle)
    for one in scene["hinge"]:
        one.get("initial", {}).pop("u", None)
    scene["hinge"][0].setdefault("initial", {})["u"] = 1.0
    model = compile_scene(scene)
    assert model.loops.singular
    result = model.simulate(0.3, rtol=1e-8)
    assert result.success, result.message
    assert np.ptp(result.energy()) < 1e-5 * np.abs(result.energy()).max()


def test_a_trajectory_that_does_not_close_fails_alone() -> None:
    """The third crank stands where the short coupler does not reach."""
    scene = driven_four_bar(foot="a + t")
    scene["input"] = [{"name": "a", "value": 0.9, "rates": [0, 0], "unit": "rad"}]
    next(body for body in scene["body"] if body["name"] == "coupler")["ends"]["tip"][0] = 0.95
    model = compile_scene(scene)
    states = tuple(np.tile(one, (3, 1)) for one in model.initial_state())
    batch = model.simulate_batch(
        (states[0], states[1]), {"a.value": np.array([0.9, 1.0, 3.14])}, t_end=0.1
    )
    assert batch.success.tolist() == [True, True, False]
    assert "no nearby state closes it" in batch.messages[2]


def test_a_crank_too_long_by_more_than_a_misfit_is_a_structure() -> None:
    for much, moves in ((1e-4, True), (1e-2, False)):
        scene = cranks()
        name = scene["hinge"][2]["outboard"].partition(".")[0]
        body = next(one for one in scene["body"] if one["name"] == name)
        body["ends"] = {end: [x * (1 + much), y, z] for end, (x, y, z) in body["ends"].items()}
        if moves:
            assert compile_scene(scene).loops.mobility == 1
        else:
            with pytest.raises(mstmm.SceneError, match="no degrees of freedom"):
                compile_scene(scene)


def test_an_open_state_is_told_as_such() -> None:
    """Where a mechanism is asked for what its loops leave free, they must be closed."""
    model = compile_scene(four_bar(speed=1.0))
    q, u = model.initial_state()
    with pytest.raises(mstmm.NumericalFailure, match=r'hinge "tip" has a position gap .*assemble'):
        model.mass_matrix(q + 0.1)
    with pytest.raises(mstmm.SceneError, match=r"expected \(..., 1\) of the independent speeds or"):
        model.inverse_dynamics(q, u, np.zeros(2))
    with pytest.raises(mstmm.SceneError, match="the mobility of the mechanism, 1, found 2"):
        model.inverse_dynamics(q, u, np.zeros(1), actuators=["knee", "foot"])
