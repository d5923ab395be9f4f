"""Momentum that certificates ask to be kept in runs with blows: what the world gives it is not."""

from __future__ import annotations

from typing import Any

import pytest

import mstmm

Scene = dict[str, Any]
STOPS = {"limits": {"lower": -0.5, "upper": 0.5, "restitution": 0.7}}


def free_hinge(body: str, place: list[float], speeds: list[float]) -> Scene:
    start = {"q": [*place, 1, 0, 0, 0], "u": speeds}
    return {"name": f"f{body}", "type": "free", "inboard": "ground", "outboard": body,
            "initial": start}  # fmt: skip


def hinge(name: str, kind: str, inboard: str, body: str, speed: float, **more: Any) -> Scene:
    return {"name": name, "type": kind, "inboard": inboard, "outboard": body,
            "initial": {"u": speed}, **more}  # fmt: skip


def events(*conditions: str) -> list[Scene]:
    return [{"name": f"hit{k}", "when": when, "do": "bounce", "restitution": 0.9}
            for k, when in enumerate(conditions)]  # fmt: skip


def bodies(*names: str) -> list[Scene]:
    return [{"name": name, "mass": 1.0 + k, "inertia": [0.1, 0.1, 0.1],
             "ends": {"tip": [1.0, 0, 0]}} for k, name in enumerate(names)]  # fmt: skip


def conserved_momenta(scene: Scene, **settings: Any) -> set[str]:
    """Names of the momenta that a trusted run with an impact conserves."""
    scene = {"gravity": [0, 0, 0]} | scene
    model = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    run = model.simulate(2.0, certify=True, **settings)
    assert (run.event > 0).any()
    assert run.trusted, run.warnings
    return {drift.name.replace("momentum ", "").split(" about")[0]
            for drift in run.certificate.momentum}  # fmt: skip


BALL = [free_hinge("a", [0, 1, 0], [1, 0, 0.3, 0, 0, 0])]
PAIR = [
    free_hinge("a", [0, 0, 0], [1, 0.1, 0.05, 0, 0, 1]),
    free_hinge("b", [1, 0.02, 0], [0, 0, 0.08, 0.3, 0, 0.2]),
]


@pytest.mark.parametrize("method", ["dop853", "rk4", "rodas4p2", "scipy-DOP853"])
def test_a_ball_between_floor_and_wall(method: str) -> None:
    scene = {"gravity": [0, -9.81, 0], "body": bodies("a"), "hinge": BALL,
             "event": events("a.y <= 0", "a.x > 1")}  # fmt: skip
    step = 0.002 if method == "rk4" else None
    assert conserved_momenta(scene, method=method, step=step) == {"z"}


@pytest.mark.parametrize(
    ("when", "kept"),
    [
        ("a.y <= 1 - 0.2*t", {"x", "z", "angular y"}),
        ("a.x > 1 - 0.2*t", {"y", "z", "angular x"}),
        ("a.x + a.z > 1", {"y"}),
    ],
)
def test_a_wall_that_moves(when: str, kept: set[str]) -> None:
    """What is pushed against the wall's normal is its own affair, and what turns about that."""
    fast = [free_hinge("a", [0, 1.2, 0.1], [1, -1, 0.3, 0.1, 0.2, 0])]
    assert conserved_momenta({"body": bodies("a"), "hinge": fast, "event": events(when)}) == kept


@pytest.mark.parametrize(
    ("when", "kept"),
    [
        ("(a.x-b.x)^2 + (a.y-b.y)^2 + (a.z-b.z)^2 < 0.04",
         {"x", "y", "z", "angular x", "angular y", "angular z"}),
        ("a.x > b.x - 0.2", {"x", "y", "z", "angular x"}),
        ("a.x > 0.8", {"y", "z", "angular x"}),
    ],
)  # fmt: skip
def test_two_balls(when: str, kept: set[str]) -> None:
    """Along a line between them they strike each other alone; planes that no body carries turn with
    none."""
    found = conserved_momenta({"body": bodies("a", "b"), "hinge": PAIR, "event": events(when)})
    assert found == kept


@pytest.mark.parametrize(
    ("when", "kept"), [("a.x > b.x - 0.2", {"x"}), ("a.x > 0.6", set()), ("ra.q > 0.6", set())]
)
def test_carts_on_a_rail(when: str, kept: set[str]) -> None:
    rails = [hinge("ra", "prismatic", "ground", "a", 1.0, axis=[1, 0, 0]),
             hinge("rb", "prismatic", "ground", "b", 0.1, axis=[1, 0, 0])]  # fmt: skip
    rails[1]["initial"]["q"] = 1.0
    assert (
        conserved_momenta({"body": bodies("a", "b"), "hinge": rails, "event": events(when)}) == kept
    )


def test_hard_stops_inside_a_scene() -> None:
    """All of a free pair's momentum is kept; of what runs across a rail nothing is that the rail
    bears, though only blows bring it to bear."""
    pin = hinge("knee", "pin", "a", "b", 2.0, law=STOPS)
    flying = [free_hinge("a", [0, 0, 0], [1, 0.2, 0.1, 0, 0, 1]), pin]
    every = {"x", "y", "z", "angular x", "angular y", "angular z"}
    assert conserved_momenta({"body": bodies("a", "b"), "hinge": flying}) == every
    rail = hinge("rail", "prismatic", "ground", "a", 1.0, axis=[1, 0, 0])
    across = hinge("across", "prismatic", "a", "b", 1.0, axis=[0, 1, 0], law=STOPS)
    assert conserved_momenta({"body": bodies("a", "b"), "hinge": [rail, across]}) == {"x"}


def test_a_pendulum() -> None:
    """Its pin bears all but what turns about it: the knee's stop leaves that, a wall does not."""
    pins = [hinge("top", "pin", "ground", "a", 1.0), hinge("knee", "pin", "a.tip", "b", 2.0)]
    two = bodies("a", "b")
    stopped = [pins[0], pins[1] | {"law": STOPS}]
    assert conserved_momenta({"body": two, "hinge": stopped}) == {"angular z"}
    circle = events("b.tip.x^2 + b.tip.y^2 < 3")
    assert conserved_momenta({"body": two, "hinge": pins, "event": circle}) == {"angular z"}
    assert (
        conserved_momenta({"body": two, "hinge": pins, "event": events("b.tip.y > 0.9")}) == set()
    )


def test_a_hub_with_a_blade() -> None:
    blade = {"name": "blade", "length": 1.0, "mass_per_length": 1.2, "bending_stiffness": 2000.0,
             "basis": "static+fixed-interface"}  # fmt: skip
    weld = {"name": "weld", "type": "fixed", "inboard": "a", "outboard": "blade"}
    ring = hinge("ring", "pin", "blade.tip", "b", 3.0, law=STOPS)
    flying = [free_hinge("a", [0, 0, 0], [0.1, 0.2, 0, 0, 0, 1.0]), weld, ring]
    scene = {"gravity": [0, 0, 0], "body": bodies("a", "b"), "beam": [blade], "hinge": flying}
    run = mstmm.compile(mstmm.Scene(**scene), engine="looped").simulate(0.3, certify=True)
    assert (run.event > 0).any()
    kept = {drift.name: drift.relative for drift in run.certificate.momentum}
    assert {"momentum x", "momentum y", "angular momentum z"} <= set(kept)
    assert max(kept.values()) < 1e-7


def test_blows_between_output_times_are_not_forgotten() -> None:
    """No sample shows them, so that nothing is known of what they have left."""
    scene = {
        "gravity": [0, 0, 0], "body": bodies("ball"),
        "hinge": [free_hinge("ball", [0, 0, 0], [1, 0.2, 0, 0, 0, 0.5])],
        "event": events("ball.x > 1"),
    }  # fmt: skip
    assert "y" in conserved_momenta(scene)
    model = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    run = model.simulate(2.0, output_times=[0.0, 0.5, 2.0], certify=True)
    assert run.trusted and not run.certificate.momentum
