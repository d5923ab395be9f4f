"""Advice for mechanisms: what is advised is run with loops closed, beside the richest model."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest

import mstmm
from tests.support.scenes.constraints import governor
from tests.support.scenes.linkages import four_bar, rod
from tests.system.loops.test_flexible_against_tree import slider_crank

Data = dict[str, Any]
BALL = {"type": "ball", "initial": {"q": [1, 0, 0, 0]}}
T_END = 0.3


def mechanism_advice(data: Data, error: float = 1e-3, t_end: float = T_END) -> mstmm.Advice:
    return mstmm.advise(mstmm.Scene(**data), t_end, error=error, rounds=0, samples=21, budget=600)


def relative_error(
    made: mstmm.Advice, data: Data, end: str, length: float, t_end: float = T_END
) -> float:
    """Largest error of a place in the advised run beside an exact one, in parts of `length`."""
    places, times = [], np.linspace(0.0, t_end, 21)
    for scene, name, options in (
        (mstmm.Scene(**data), end, {"rtol": 1e-10, "atol": 1e-12}),
        (made.scene, made.reduced_name(end), made.options),
    ):
        model = mstmm.compile(scene, engine="looped")
        places.append(model.simulate(t_end, output_times=times, **options).position(name))
    return float(np.linalg.norm(places[0] - places[1], axis=1).max()) / length


def with_plate(**ends: Any) -> Data:
    """A four-bar whose coupler carries a plate."""
    data = four_bar(speed=2.0)
    data["body"].append({"name": "plate", "mass": 0.3, "inertia": [0.01, 0.01, 0.01], "ends": ends})
    data["hinge"].append(
        {"name": "weld", "type": "fixed", "inboard": "coupler.tip", "outboard": "plate"}
    )
    return data


@pytest.mark.parametrize(("error", "level"), [(1e-2, "rigid"), (1e-5, "linear")])
def test_a_rod_that_bends(error: float, level: str) -> None:
    data, t_end = slider_crank(), 0.05
    made = mechanism_advice(data, error, t_end)
    assert made.bodies[0].model.level == level
    assert relative_error(made, data, "bar.tip", 0.9, t_end) < error


def test_a_ball_in_a_plane_is_a_pin() -> None:
    made = mechanism_advice(four_bar(speed=2.0, tip=BALL))
    assert any("pin instead of ball" in one for one in made.other_changes)


def test_a_stiff_hinge_of_a_loop_becomes_rigid() -> None:
    data = four_bar()
    data["body"][1:2] = [rod("coupler", 0.55, 0.65), rod("other", 0.55, 0.65)]
    data["hinge"][2]["inboard"] = "other.tip"
    data["hinge"].insert(
        2,
        {"name": "mid", "type": "pin", "inboard": "coupler.tip", "outboard": "other",
         "law": {"stiffness": 1e7, "damping": 1e3}},
    )  # fmt: skip
    made = mechanism_advice(data)
    assert any('"mid": rigid' in one for one in made.other_changes)
    assert relative_error(made, data, "other.tip", 1.2) < 1e-3


def test_welded_bodies_of_a_loop_are_one() -> None:
    data = with_plate()
    made = mechanism_advice(data)
    assert len(made.scene.body) == 3
    assert relative_error(made, data, "plate", 1.2) < 1e-3


def test_constraints_move_with_what_they_hold() -> None:
    """A rod of a governor ends on a tag of its sleeve."""
    data = copy.deepcopy(governor("constraint"))
    row = data["constraint"][0]
    data["body"].append(
        {"name": "tag", "mass": 0.2, "inertia": [0.01] * 3, "ends": {"eye": [0, 0, 0]}}
    )
    data["hinge"].append({"name": "weld", "type": "fixed", "inboard": row["to"], "outboard": "tag"})
    row["to"] = "tag.eye"
    made = mechanism_advice(data)
    assert "tag" not in {body.name for body in made.scene.body}
    assert made.scene.constraint[0].to == "sleeve.tag_eye"


def test_two_welds_between_two_bodies_stay() -> None:
    """As one they would be welded to themselves."""
    data = with_plate(far=[-1.1, 0, 0])
    data["hinge"].append(
        {"name": "again", "type": "fixed", "inboard": "coupler", "outboard": "plate.far"}
    )
    assert len(mechanism_advice(data).scene.body) == 4


def test_what_a_loop_ends_on_stays_on_the_ground() -> None:
    """The rocker ends on a post, whose pin nothing could hold then."""
    data = four_bar(speed=2.0, cut="end")
    data["body"].append(
        {"name": "post", "mass": 1.0, "inertia": [0.1] * 3, "ends": {"top": [0, 0, 0]}}
    )
    end = data["hinge"][3]
    end |= {"inboard": "rocker", "outboard": "post.top", "initial": {"q": -end["initial"]["q"]}}
    data["hinge"].append({"name": "bolt", "type": "fixed", "inboard": "ground", "outboard": "post",
                          "position": end.pop("position")})  # fmt: skip
    made = mechanism_advice(data)
    assert "post" in {body.name for body in made.scene.body}
