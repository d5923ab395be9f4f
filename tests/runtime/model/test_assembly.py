"""Starts far from closed, and what is left open where nothing closes."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import LoopClosureError
from mstmm.pipeline.assembled_scene import nearest_pose_result
from mstmm.runtime.result.result import Result
from tests.reference.jets import Array
from tests.support.scenes.linkages import (
    CRANK,
    FEET,
    OBLIQUE,
    ROCKER,
    bricard,
    cranks,
    four_bar,
    legs,
)
from tests.support.scenes.published_mechanisms import andrews, four_bars


def perturbed_start(
    model: mstmm.Model, kept: tuple[str, ...], size: float, draw: np.random.Generator
) -> Array:
    """The start with all coordinates off by up to `size` (rad, m), but for those of `kept`."""
    start, _ = model.initial_state()
    shift = draw.uniform(-size, size, len(start))
    for hinge in model.scene.hinge:
        place = model.coordinate_layout.hinges[hinge.name].q_slice
        if hinge.type == "ball":
            shift[place] /= 2  # of a quaternion half the angle
        if hinge.name in kept:
            shift[place] = 0.0
    return start + shift


@pytest.mark.parametrize("starts", [8, pytest.param(40, marks=pytest.mark.soak)])
@pytest.mark.parametrize(
    ("scene", "kept", "size"),
    [
        (four_bar(), ("foot",), 0.3),
        (four_bar(tilt=OBLIQUE), ("foot",), 1.0),
        (four_bars(40, 1.0), ("foot0",), 0.3),
        (andrews(), ("beta",), 0.3),
        (bricard(), (), 0.3),
        (legs(), tuple(f"slide{k}" for k in range(6)), 0.3),
    ],
    ids=["four-bar", "oblique", "forty-windows", "squeezer", "bricard", "legs"],
)
def test_every_start_nearby_closes(
    scene: dict[str, Any], kept: tuple[str, ...], size: float, starts: int
) -> None:
    """What is held stays to the bit, and no end is off its partner."""
    model, draw = mstmm.compile(mstmm.Scene(**scene)), np.random.default_rng(12)
    for _ in range(starts):
        wish = perturbed_start(model, kept, size, draw)
        q, u = model.assemble(wish, np.zeros(model.nu), hold=kept)
        for place in (model.coordinate_layout.hinges[name].q_slice for name in kept):
            assert (q[place] == wish[place]).all()
        assert gap(model, scene, q, u) < 1e-9


def gap(model: mstmm.Model, scene: dict[str, Any], q: Array, u: Array) -> float:
    """Largest distance between the two ends of a cut ball or pin, from positions of ends, m."""
    result = model.simulate(0.0, initial=(q, u))
    apart = []
    for hinge in scene["hinge"]:
        if hinge["name"] in model.loops.cut_hinges:
            ends = hinge["inboard"], hinge["outboard"]
            sides = [
                np.array(hinge.get("position", [0, 0, 0]), float) if end == "ground"
                else result.position(end)[0]
                for end in ends
            ]  # fmt: skip
            apart.append(float(np.linalg.norm(sides[0] - sides[1])))
    return max(apart)


def foot(scene: dict[str, Any], name: str) -> Array:
    """Where a hinge of the ground is, m."""
    return np.array(next(h for h in scene["hinge"] if h["name"] == name)["position"], float)


def start_distance(run: Result, one: str, other: str) -> float:
    """Distance between two ends at the start, m."""
    return float(np.linalg.norm(run.position(one)[0] - run.position(other)[0]))


@pytest.mark.parametrize("cut", ["knee", "tip", "end"])
@pytest.mark.parametrize("mass", [1e-3, 1.3, 1e3])
def test_the_least_gap_is_that_of_the_geometry(cut: str, mass: float) -> None:
    """A coupler of 0.35 m, a crank that is held: at best all in one line, whatever the masses."""
    scene = four_bar(cut=cut, tilt=OBLIQUE)
    for body in scene["body"]:
        if body["name"] == "coupler":
            body["ends"]["tip"], body["mass"] = [0.35, 0, 0], mass
    for hinge in scene["hinge"]:
        if hinge["name"] == "foot":
            hinge |= {"hold": True, "initial": {"q": 2.6}}
    least = abs(FEET - CRANK * np.exp(2.6j)) - ROCKER - 0.35
    assert abs(least - 0.498717) < 1e-6
    with pytest.raises(mstmm.SceneError, match=f'loop at hinge "{cut}" cannot be closed') as caught:
        mstmm.compile(mstmm.Scene(**scene))
    error = caught.value
    assert isinstance(error, LoopClosureError) and abs(error.gap - least) < 1e-6
    assert error.pose["foot"] == (2.6,)
    drawn = nearest_pose_result(mstmm.Scene(**scene), error)
    gaps = {
        "knee": start_distance(drawn, "crank.tip", "coupler"),
        "tip": start_distance(drawn, "coupler.tip", "rocker.tip"),
        "end": float(np.linalg.norm(drawn.position("rocker")[0] - foot(scene, "end"))),
    }
    assert abs(gaps.pop(cut) - least) < 1e-6 and max(gaps.values()) < 1e-12
    told = re.search(r"gap of ([0-9.e-]+) m", str(caught.value))
    assert told and abs(float(told[1]) - least) < 1e-6
    assert '"foot" fixed' in str(caught.value)


@pytest.mark.parametrize("cut", ["foot", "knee", "tip", "end"])
def test_a_hinge_that_is_held_keeps_its_place_cut_or_not(cut: str) -> None:
    """The crank's foot, whichever hinge is cut; its speed as well."""
    scene = four_bar(crank=0.7, cut=cut)
    foot = next(hinge for hinge in scene["hinge"] if hinge["name"] == "foot")
    foot |= {"hold": True, "initial": {"q": [0.8], "u": [2.0]}}
    model = mstmm.compile(mstmm.Scene(**scene))
    (q, u), slots = model.initial_state(), model.coordinate_layout.hinges["foot"]
    assert abs(q[slots.q]) == 0.8 and abs(u[slots.u]) == 2.0
    moved = np.array(q)
    moved[slots.q] += 0.3
    again = model.assemble(moved, hold=["foot"])
    assert again[0][slots.q] == moved[slots.q] and abs(again[1][slots.u]) == 2.0
    assert gap(model, scene, *again) < 1e-9


@pytest.mark.parametrize("hold", ["foot", 3, None, [3]])
def test_hold_is_a_list_of_names(hold: Any) -> None:
    model = mstmm.compile(mstmm.Scene(**four_bar()))
    with pytest.raises(mstmm.SceneError, match=r"expected (a list of )?names of hinges"):
        model.assemble(hold=hold)


def test_speeds_that_a_cut_hinge_cannot_have_are_refused() -> None:
    """It would slide along its axis, out of the plane."""
    scene = four_bar(cut="tip", tip={"type": "cylindrical", "initial": {"u": [1.0, 0.0]}})
    with pytest.raises(mstmm.SceneError, match='given for "tip" are inconsistent by 1 m/s'):
        mstmm.compile(mstmm.Scene(**scene))


@pytest.mark.parametrize("misfit", [1e-6, 1e-5, 1e-4])
def test_rows_that_repeat_others_may_be_off_by_a_little(misfit: float) -> None:
    """A foot beside the plane of the others by less than a thousandth of the lengths; at rounding
    of data nobody is troubled, and the motion is that of the plane."""
    ends = []
    for beside in (0.0, misfit):
        scene = four_bar(crank=0.7, speed=2.0)
        end = next(hinge for hinge in scene["hinge"] if hinge["name"] == "end")
        end["position"] = [*np.add(end["position"], [0, 0, beside])]
        run = mstmm.compile(mstmm.Scene(**scene)).simulate(1.0, rtol=1e-10, output_times=[1.0])
        assert run.success, run.message
        ends.append(run.q[-1])
    assert np.abs(ends[1] - ends[0]).max() < 1e-6


def test_drives_that_part_open_the_loop_and_are_told() -> None:
    """Two cranks of a parallelogram turn alike at first; one of them repeats the other."""
    scene = cranks()
    scene["body"] = [body for body in scene["body"] if body["name"] != "crank1"]
    scene["hinge"] = [hinge for hinge in scene["hinge"] if not hinge["name"].endswith("1")]
    for hinge, more in zip(scene["hinge"][:2], ("", " + 0.05*t^3"), strict=True):
        del hinge["initial"]
        hinge["drive"] = f"0.8 + t{more}"
    run = mstmm.compile(mstmm.Scene(**scene)).simulate(1.0)
    assert not run.success
    assert re.search('hinge "top2" at t = 0.[1-4].*its loop is open', run.message)
    tip, end = run.position("crank2.tip")[-1], run.position("coupler.e2")[-1]
    assert np.linalg.norm(tip - end) < 2e-3
