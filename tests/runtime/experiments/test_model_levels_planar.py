"""Motions that stay in a plane, and the smaller scenes that make them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.experiments.chart.chart import Chart
from mstmm.runtime.experiments.model_levels import Variant, planar_level

BODY = {"name": "one", "mass": 1.0, "center_of_mass": [0.5, 0.1, 0], "inertia": [0.1, 0.2, 0.3],
        "ends": {"tip": [1, 0, 0]}}  # fmt: skip

#: Turned by 0.5 rad about z.
TURNED = [float(np.cos(0.25)), 0.0, 0.0, float(np.sin(0.25))]


def planar_flight_scene(axis: str = "z", **ball: Any) -> mstmm.Scene:
    """A body that flies and turns in a plane, with another on a ball hinge at its tip.

    `axis` is the inertial direction across the plane: the first hinge turns everything there.
    """
    turn = {"z": [0.0, 0.0, 0.4], "x": [0.0, np.pi / 2, 0.0]}[axis]
    start = {"q": [0.2, 0.1, 0.0, *TURNED], "u": [1.0, 2.0, 0.0, 0.0, 0.0, 1.5]}
    gravity = {"z": [0, -9.81, 0], "x": [0, -9.81, 0]}[axis]
    return mstmm.Scene(
        gravity=gravity, body=[BODY, BODY | {"name": "two"}],
        hinge=[
            {"name": "root", "type": "free", "inboard": "ground", "outboard": "one",
             "orientation": turn, "initial": start},
            {"name": "wrist", "type": "ball", "inboard": "one.tip", "outboard": "two",
             "initial": {"u": [0, 0, -2.0]}} | ball,
        ],
    )  # fmt: skip


def run(scene: mstmm.Scene) -> mstmm.Result:
    model = mstmm.compile(scene, engine="looped")
    return model.simulate(1.0, rtol=1e-12, atol=1e-14, output_times=np.linspace(0, 1, 21))


def level(scene: mstmm.Scene) -> Variant | None:
    result = run(scene)
    return planar_level(Variant("rigid", scene), result.model, result.q)


@pytest.mark.parametrize("axis", ["z", "x"])
def test_hinges_become_those_of_a_plane(axis: str) -> None:
    """The motion is the same, of every body, with three coordinates and one in place of six and
    three."""
    scene, times = planar_flight_scene(axis), np.linspace(0, 1, 21)
    found = level(scene)
    assert found is not None
    assert [hinge.type for hinge in found.scene.hinge] == ["planar", "pin"]
    whole, flat = (
        mstmm.compile(one, engine="looped").simulate(
            1.0, rtol=1e-12, atol=1e-14, output_times=times
        )
        for one in (scene, found.scene)
    )
    assert (whole.model.nu, flat.model.nu) == (9, 4)
    for name in ("one", "one.tip", "two", "two.tip"):
        assert flat.position(name) == pytest.approx(whole.position(name), abs=1e-10)
        assert flat.velocity(name) == pytest.approx(whole.velocity(name), abs=1e-9)
    assert np.ptp(whole.position("two.tip"), axis=0).max() > 1


def test_what_leaves_the_plane_stays() -> None:
    tilted = planar_flight_scene(initial={"u": [0.1, 0, -2.0]})
    found = level(tilted)
    assert found is None


def test_hinges_with_laws_stay() -> None:
    sprung = planar_flight_scene(law={"damping": [0.1, 0.1, 0.1]})
    found = level(sprung)
    assert found is not None
    assert [hinge.type for hinge in found.scene.hinge] == ["planar", "ball"]


def test_a_chart_of_rigid_bodies_has_the_planar_level() -> None:
    made: Chart = mstmm.chart(
        planar_flight_scene(),
        1.0,
        methods=["dop853"],
        models=True,
        samples=11,
        rounds=0,
        budget=300,
    )
    assert [one.name for one in made.model_levels] == ["planar, rigid", "rigid"]
    error = made.model_levels[0].error
    assert error is not None and error < 1e-10
    finest = min(p.error for p in made.points if p.model == "planar, rigid" and p.error is not None)
    assert finest < 1e-9
