"""Scenes that begin where loops close, as scenes of their own."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.pipeline.assembled_scene import assembled_scene
from tests.support.scenes.constraints import cycloid
from tests.support.scenes.linkages import angles, four_bar, legs
from tests.system.loops.test_flexible_against_tree import slider_crank

Scene = dict[str, Any]


def astray(scene: Scene) -> Scene:
    """Starts of the hinges with one coordinate, but for the first, a little off."""
    for hinge in scene["hinge"][1:]:
        if hinge["type"] in ("pin", "prismatic"):
            hinge.setdefault("initial", {"q": 0.0})["q"] += 0.03
    return scene


def held_four_bar() -> Scene:
    scene = astray(four_bar(0.9, speed=2.0))
    scene["hinge"][0]["hold"] = True
    return scene


MADE: dict[str, Callable[[], Scene]] = {
    "four-bar": held_four_bar, "driven": lambda: astray(four_bar(foot={"drive": "0.9 + 2*t"})),
    "platform": lambda: astray(legs()), "bead": lambda: cycloid(0.4),
    "flexible": lambda: astray(slider_crank()),
}  # fmt: skip


@pytest.mark.parametrize("what", MADE)
def test_it_begins_where_the_wishes_led(what: str) -> None:
    scene = MADE[what]()
    if what == "driven":
        del scene["hinge"][0]["initial"]
    model = mstmm.compile(mstmm.Scene(**scene))
    again = mstmm.compile(assembled_scene(model))
    for found, wanted in zip(again.initial_state(), model.initial_state(), strict=True):
        assert np.abs(found - wanted).max() < 1e-9
    hinges = {hinge.name: hinge for hinge in again.scene.hinge}
    if what in ("four-bar", "driven"):
        coupler, rocker = angles(0.9)
        for name, angle in (("knee", coupler - 0.9), ("end", rocker)):
            initial = hinges[name].initial
            assert initial is not None and initial.q is not None
            assert abs(initial.q[0] - angle) < 1e-9


def closed_chain(first: float) -> mstmm.Model:
    """Two rods of a chain, one behind the other, and a third that ends on the ground."""
    body = {"mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [0.01, 0.1, 0.1],
            "ends": {"tip": [1.0, 0, 0]}}  # fmt: skip
    third = {"name": "third", **body}
    chain = {"name": "rope", "count": 2, "inboard": "ground", "body": [body],
             "hinge": [{"type": "pin", "initial": {"q": first}}]}  # fmt: skip
    hinges = [
        {"name": "knee", "type": "pin", "inboard": "rope[1].tip", "outboard": "third",
         "initial": {"q": -2.0}},
        {"name": "end", "type": "pin", "inboard": "ground", "outboard": "third.tip",
         "position": [2.0, 0, 0]},
    ]  # fmt: skip
    return mstmm.compile(
        mstmm.Scene(gravity=[0, -9.81, 0], body=[third], chain=[chain], hinge=hinges)
    )


def test_members_of_a_chain_share_their_start() -> None:
    with pytest.raises(mstmm.SceneError, match=r'chain "rope".*share their start; write'):
        assembled_scene(closed_chain(0.5))


def test_a_tree_stays_what_it_is() -> None:
    scene = four_bar(speed=1.0)
    scene |= {"hinge": scene["hinge"][:1], "body": scene["body"][:1]}
    scene["hinge"][0].pop("cut")
    tree = mstmm.compile(mstmm.Scene(**scene))
    assert assembled_scene(tree) == tree.scene
