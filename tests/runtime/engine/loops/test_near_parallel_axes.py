"""Axes of a loop that are parallel but for a small angle: one message, whatever the angle does."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.engine.loops.acceleration_refinement import mass_ratio_text
from tests.support.scenes.linkages import COUPLER, CRANK, OBLIQUE, four_bar, rod

NAMES = ("foot", "knee", "tip", "end")


def refusal_message(scene: dict[str, Any]) -> str:
    with pytest.raises(mstmm.SceneError) as caught:
        mstmm.compile(mstmm.Scene(**scene))
    return str(caught.value)


def hinge_changes(name: str, **keys: Any) -> dict[str, Any]:
    return {name: keys}


def tilt_text(tilt: float) -> str:
    """Angle of the tilt as messages print it."""
    return f"{tilt:.3g} rad ({math.degrees(tilt):.3g} deg)"


@pytest.mark.parametrize("tilt", [5e-3, 1e-2, 2e-2, 9e-2])
@pytest.mark.parametrize("name", NAMES)
def test_a_tilted_axis_is_named(name: str, tilt: float) -> None:
    axis = [math.sin(tilt), 0.0, math.cos(tilt)]
    before, behind = (NAMES[(NAMES.index(name) + k) % 4] for k in (-1, 1))
    told = refusal_message(four_bar(tilt=OBLIQUE, **hinge_changes(name, axis=axis)))
    assert f'; the axis of hinge "{name}" is {tilt_text(tilt)} from parallel to those of ' in told
    assert f'"{before}" and "{behind}"' in told or f'"{behind}" and "{before}"' in told
    assert told.endswith("; make it parallel by an exact axis and orientation, or replace it "
                         "by a ball hinge")  # fmt: skip


@pytest.mark.parametrize(
    ("tilt", "found"),
    [
        (1e-3, "would lock"),
        (2e-3, "cannot be closed"),
        (1e-2, "cannot be closed"),
        (5e-2, "cannot be closed"),
    ],
)
def test_what_the_tilt_does_comes_first(tilt: float, found: str) -> None:
    told = refusal_message(four_bar(end={"axis": [math.sin(tilt), 0, math.cos(tilt)]}))
    assert found in told and f'; the axis of hinge "end" is {tilt_text(tilt)} from parallel' in told


@pytest.mark.parametrize("tilt", [5e-4, 1e-3])
def test_a_run_that_locks_names_the_axis(tilt: float) -> None:
    """So little off that the loop closes at the start, and not much later."""
    scene = four_bar(speed=1.0, knee={"axis": [math.sin(tilt), 0, math.cos(tilt)]})
    run = mstmm.compile(mstmm.Scene(**scene), engine="looped").simulate(2.0, "dop853")
    assert not run.success and run.t[-1] < 1.0
    assert (
        f'no nearby state closes it; the axis of hinge "knee" is {tilt_text(tilt)}' in run.message
    )


def test_speeds_that_a_tilted_axis_does_not_allow() -> None:
    told = refusal_message(four_bar(speed=1.0, knee={"axis": [math.sin(2e-3), 0, math.cos(2e-3)]}))
    assert "are inconsistent by" in told
    assert f'; the axis of hinge "knee" is {tilt_text(2e-3)} from parallel' in told


@pytest.mark.parametrize("cut", NAMES)
def test_the_cut_makes_no_difference(cut: str) -> None:
    told = refusal_message(four_bar(cut=cut, knee={"axis": [math.sin(0.02), 0, math.cos(0.02)]}))
    assert f'; the axis of hinge "knee" is {tilt_text(0.02)} from parallel' in told


@pytest.mark.parametrize(
    ("name", "pair"),
    [("knee", ("foot", "knee", 'body "crank"')), ("end", ("end", "foot", "ground"))],
)
def test_an_orientation_tilts_one_end(name: str, pair: tuple[str, str, str]) -> None:
    """Of two axes on one body nothing says which is meant."""
    told = refusal_message(four_bar(**hinge_changes(name, orientation=[0.0, 0.01, 0.0])))
    angle = re.escape(tilt_text(0.01))
    assert re.search(f'; the axes of hinges "({pair[0]}|{pair[1]})" and "({pair[0]}|{pair[1]})" on '
                     f"{pair[2]} are {angle} from parallel; make", told)  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_the_way_out(name: str) -> None:
    """A ball in place of the hinge that is off leaves one freedom and no gap."""
    scene = four_bar(**hinge_changes(name, orientation=[0.0, 0.01, 0.0], type="ball"))
    for hinge in scene["hinge"]:
        if hinge["name"] == name:
            hinge.pop("initial")
    loops = mstmm.compile(mstmm.Scene(**scene)).loops
    assert loops.mobility == 1 and not loops.redundancy_gap[0]


def slider_crank(rail: dict[str, Any], top: str = "pin") -> dict[str, Any]:
    """A crank, a coupler and a slider on a rail along x, which all lie in one plane."""
    slider = {"name": "slider", "mass": 1.0, "inertia": [0.1, 0.1, 0.1]}
    rest = math.asin(CRANK * math.sin(0.7) / COUPLER)
    along = CRANK * math.cos(0.7) + COUPLER * math.cos(rest)
    hinges: list[dict[str, Any]] = [
        {"name": "foot", "type": "pin", "inboard": "ground", "outboard": "crank",
         "initial": {"q": 0.7}},
        {"name": "knee", "type": "pin", "inboard": "crank.tip", "outboard": "coupler",
         "initial": {"q": -rest - 0.7}},
        {"name": "rail", "type": "prismatic", "inboard": "ground", "outboard": "slider",
         "axis": [1, 0, 0], "initial": {"q": along}, **rail},
        {"name": "top", "type": top, "inboard": "coupler.tip", "outboard": "slider", "cut": True},
    ]  # fmt: skip
    bodies = [rod("crank", CRANK), rod("coupler", COUPLER), slider]
    return {"gravity": [0, -9.81, 0], "body": bodies, "hinge": hinges}


def test_a_rail_that_leaves_the_plane() -> None:
    axis = [math.cos(0.02), 0.0, math.sin(0.02)]
    told = refusal_message(slider_crank({"axis": axis}))
    assert (
        f'; the axis of hinge "rail" is {tilt_text(0.02)} out of the plane in which the pins'
        in told
    )
    loops = mstmm.compile(mstmm.Scene(**slider_crank({"axis": axis}, "cylindrical"))).loops
    assert loops.mobility == 1


def test_a_rail_that_turns_the_slider() -> None:
    """It joins two pins whose axes it keeps from being parallel."""
    told = refusal_message(slider_crank({"orientation": [0.02, 0.0, 0.0]}))
    assert re.search(r'; the axes of hinges "(top|foot)" and "(top|foot)" .* are 0\.02 rad', told)


def test_what_angles_do_not_explain() -> None:
    """Feet too far apart, an axis that is a little off, and one that is meant to be oblique."""
    scene = four_bar(end={"axis": [math.sin(1e-3), 0, math.cos(1e-3)]})
    scene["hinge"][3]["position"] = [4.0, 0, 0]
    assert refusal_message(scene).endswith("or axes, or start closer to a closed configuration")
    told = refusal_message(four_bar(end={"axis": [math.sin(0.3), 0, math.cos(0.3)]}))
    assert "from parallel" not in told


def test_a_loop_in_which_nothing_is_off_is_told_by_its_lengths() -> None:
    scene = four_bar(tilt=OBLIQUE)
    scene["hinge"][3]["position"] = [float(x) for x in 3 * np.array(scene["hinge"][3]["position"])]
    assert "from parallel" not in refusal_message(scene)


def test_a_bar_that_is_too_long_is_not_put_down_to_an_axis() -> None:
    """What the angle leaves open is far less than what the length does."""
    scene = four_bar(end={"axis": [math.sin(0.02), 0, math.cos(0.02)]})
    for body in scene["body"]:
        body["ends"]["tip"] = [4.0 if body["name"] == "coupler" else body["ends"]["tip"][0], 0, 0]
    told = refusal_message(scene)
    assert "correct lengths" in told and "parallel" not in told


def test_three_pins_are_a_structure_however_parallel() -> None:
    bars = [rod("crank", CRANK), rod("coupler", COUPLER)]
    axes = [[0, 0, 1], [0, 0.05, 1], [0, 0, 1]]
    ends = [("ground", "crank"), ("crank.tip", "coupler"), ("ground", "coupler.tip")]
    reach = math.hypot(CRANK, COUPLER)
    hinges = [
        {"name": f"pin{k}", "type": "pin", "inboard": inboard, "outboard": outboard, "axis": axis,
         "position": [reach * (k == 2), 0, 0]}
        for k, ((inboard, outboard), axis) in enumerate(zip(ends, axes, strict=True))
    ]  # fmt: skip
    for hinge in hinges[1:2]:
        del hinge["position"]
    assert "parallel" not in refusal_message(
        {"gravity": [0, -9.81, 0], "body": bars, "hinge": hinges}
    )


@pytest.mark.parametrize(
    ("mass", "found"),
    [(1.3, 'the axis of hinge "knee" is'), (1e6, '"coupler" (1e+06 kg) outboard of light')],
)
def test_lost_digits_are_put_down_to_masses_only_where_these_are_unlike(
    mass: float, found: str
) -> None:
    scene = four_bar(knee={"axis": [math.sin(1e-3), 0, math.cos(1e-3)]})
    engine = mstmm.compile(mstmm.Scene(**scene), engine="looped").looped
    scene["body"][1] = rod("coupler", COUPLER, mass)
    engine.packed.expanded.user_scene = mstmm.Scene(**scene)
    assert found in mass_ratio_text(engine)
