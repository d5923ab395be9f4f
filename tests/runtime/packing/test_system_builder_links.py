"""Frames by common normals and runs of links: they mean what bodies one by one mean."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import mstmm
from mstmm.runtime.engine.looped_engine import LoopedEngine, Observation
from mstmm.runtime.packing.packed_scene import PackedScene
from mstmm.runtime.packing.records.body_records import link_kernel
from mstmm.runtime.packing.scene_packing import pack
from tests.reference import newton_euler
from tests.reference.compare import fresh, worst
from tests.reference.random_scenes import random_state
from tests.support.scenes.rods import chain

AXIAL = ("pin", "prismatic", "cylindrical", "screw")
ACCURACY = 1e-11

Array = NDArray[np.float64]


def pack_scene(scene: dict[str, Any], align: bool = True) -> PackedScene:
    return pack(mstmm.Scene(**scene), align=align)


def link_count(found: PackedScene) -> int:
    """Number of bodies that are swept as links."""
    runs = [found.model.runs[k] for k in range(found.model.n_runs)]
    assert sum(run.count for run in runs) == found.system.count
    return sum(run.count for run in runs if run.numbers != found.ffi.NULL)


def swept(found: PackedScene, q: Array, u: Array) -> Array:
    engine = LoopedEngine(found)
    memory = engine.start_memory()
    return engine.accelerations(0.3, q[None], u[None], memory[None])[1][0]


def observe_state(found: PackedScene, q: Array, u: Array) -> Observation:
    engine = LoopedEngine(found)
    memory = engine.start_memory()
    return engine.observe(np.array([0.3]), q[None], u[None], memory[None])


def test_links_mean_what_blocks_mean(rng: np.random.Generator) -> None:
    count = 0
    for draw in range(24):
        types = AXIAL if draw % 2 else (*AXIAL, "ball", "universal")
        scene, q, u = fresh(rng, types=types, most=12, loads=False)
        found = pack_scene(scene)
        count += link_count(found)
        udot = swept(found, q, u)
        assert worst(udot, observe_state(found, q, u).udot[0]) < ACCURACY
        assert worst(udot, swept(pack_scene(scene, align=False), q, u)) < ACCURACY
    assert count > 5


def balls(
    kinds: Sequence[str], rng: np.random.Generator, law: dict[str, Any] | None = None
) -> dict[str, Any]:
    """Bodies of their own and skew in a row; the law of every ball."""
    scene = chain(kinds, 0.7, rng.uniform(1, 2, len(kinds)).tolist(), (0.05, 0.08, 0.09))
    for body, hinge in zip(scene["body"], scene["hinge"], strict=True):
        body["center_of_mass"] = rng.uniform(0.1, 0.6, 3).tolist()
        body["inertia"] += rng.uniform(-0.01, 0.01, 3).tolist()
        body["ends"]["tip"]["orientation"] = rng.uniform(-2, 2, 3).tolist()
        hinge |= {"axis2": [0, 1, 0]} if hinge["type"] == "universal" else {}
        hinge |= {"law": law} if law and hinge["type"] == "ball" else {}
    return scene


@pytest.mark.parametrize(
    "kinds", ["b", "bbbb", "bppp", "ppbp", "pppb", "bpbpb", "bbb" + 9 * "p", "sbub"]
)
@pytest.mark.parametrize("law", [{}, {"stiffness": 3.0, "damping": 0.2, "effort": "0.4"}])
def test_balls_are_links(kinds: str, law: dict[str, Any], rng: np.random.Generator) -> None:
    names = {"b": "ball", "p": "pin", "s": "prismatic", "u": "universal"}
    scene = balls([names[kind] for kind in kinds], rng, law=law)
    q, u = random_state(scene, 5)
    found = pack_scene(scene)
    assert link_count(found) >= kinds.count("b")
    udot = swept(found, q, u)
    assert worst(udot, observe_state(found, q, u).udot[0]) < 1e-13
    assert worst(udot, newton_euler.solve(scene, q, u, 0.3).udot) < 1e-12


def test_balls_on_branches_are_links(rng: np.random.Generator) -> None:
    scene = balls(["ball", "pin", "ball", "ball", "pin", "ball"], rng)
    for i, parent in ((2, "rod0.tip"), (3, "rod1"), (4, "rod0.tip"), (5, "ground")):
        scene["hinge"][i]["inboard"] = parent
    found = pack_scene(scene)
    assert link_count(found) >= 4
    q, u = random_state(scene, 6)
    assert worst(swept(found, q, u), newton_euler.solve(scene, q, u, 0.3).udot) < 1e-12


def test_balls_with_rotors_are_no_links(rng: np.random.Generator) -> None:
    scene = balls(["ball"] * 3, rng)
    scene["hinge"][1]["law"] = {"inertia": 0.2}
    found = pack_scene(scene)
    assert link_count(found) == 2
    q, u = random_state(scene, 7)
    assert worst(swept(found, q, u), observe_state(found, q, u).udot[0]) < 1e-13


def test_balls_of_the_users_are_no_links() -> None:
    body = pack_scene(chain(["ball"])).system.body(0)
    assert link_kernel(body) == "link_ball"
    assert link_kernel(replace(body, hinge=("hinge", "socket"))) == ""


def test_a_ball_on_a_thin_rod_is_named_where_links_sweep_it() -> None:
    thin = pack_scene(chain(["ball"] * 2, inertia=(0.0, 1 / 12, 1 / 12)))
    assert link_count(thin) == 2
    q, u = np.tile([1.0, 0, 0, 0], 2), np.zeros(6)
    with pytest.raises(mstmm.NumericalFailure, match="hinge1"):
        swept(thin, q, u)


def test_loads_are_at_the_hinge_wherever_the_frame_is(rng: np.random.Generator) -> None:
    moved = 0
    for _ in range(12):
        scene, q, u = fresh(rng, types=AXIAL)
        found, plain = pack_scene(scene), pack_scene(scene, align=False)
        moved += sum(abs(body.height) > 1e-3 for body in found.system.distinct)
        one, two = observe_state(found, q, u), observe_state(plain, q, u)
        assert worst(one.loads, two.loads) < ACCURACY
        assert worst(one.efforts, two.efforts, floor=np.abs(two.loads).max()) < ACCURACY
        assert worst(one.sums, two.sums) < ACCURACY
    assert moved > 2


def test_efforts_reach_links(rng: np.random.Generator) -> None:
    scene, q, u = fresh(rng, types=AXIAL, most=12, loads=False, laws=False)
    efforts = rng.uniform(-1, 1, len(u))
    model = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    udot = model.accelerations(q, u, 0.3, efforts)
    assert worst(model.inverse_dynamics(q, u, udot, 0.3), efforts) < 1e-9


@pytest.mark.parametrize("turns", [1, 100, 10**6])
def test_angles_of_many_turns(turns: int, rng: np.random.Generator) -> None:
    scene = chain(["pin"] * 5, math.pi / 3, gravity=(0, -9.81, 0))
    q, u = rng.uniform(-1, 1, 5), rng.uniform(-1, 1, 5)
    found = pack_scene(scene)
    assert link_count(found) >= 4
    assert (
        worst(swept(found, q + 2 * math.pi * turns, u), swept(found, q, u)) < 1e-14 * turns + 1e-12
    )


@pytest.mark.parametrize("angle", [0.0, math.pi / 2])
def test_right_angles_leave_zeros_and_ones(angle: float) -> None:
    found = pack_scene(chain(["pin"] * 4, angle, gravity=(0, -9.81, 0)))
    for i in range(1, 4):
        body = found.system.body(i)
        assert {abs(x) for x in body.connection[:9]} <= {0.0, 1.0}
        assert abs(body.link[0]) == round(abs(math.cos(angle)))


def test_nearly_parallel_axes_keep_the_hinges_own_frames() -> None:
    """Their common normal is far away, and a lever that long would cost digits."""
    scene = chain(["pin"] * 3, 1e-3, gravity=(0, -9.81, 0))
    found = pack_scene(scene)
    assert all(abs(body.height) < 4.0 for body in found.system.distinct)
    q, u = np.full(3, 0.3), np.full(3, -0.2)
    assert worst(swept(found, q, u), swept(pack_scene(scene, align=False), q, u)) < 1e-13


# --- told and switched off ------------------------------------------------------------------------


def test_links_are_told_with_their_rotors_and_can_be_switched_off(rng: np.random.Generator) -> None:
    scene = chain(["pin", "pin", "ball", "prismatic"], 0.4, gravity=(0, -9.81, 0))
    scene["hinge"][1]["law"] = {"inertia": 0.2}
    model = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    told = {one.elements: str(one) for one in model.simplifications}
    assert {one.kind for one in model.simplifications} == {"links"}
    assert set(told) == {("hinge0",), ("hinge1",), ("hinge2",), ("hinge3",)}
    assert 'type "pin" with rotor inertia' in told["hinge1",]
    assert 'type "ball":' in told["hinge2",]
    assert link_count(model.packed_scene) == 4
    q, u = model.initial_state()
    u = rng.uniform(-1, 1, len(u))
    for without in (False, ["welds"], {"links": False}):
        plain = mstmm.compile(mstmm.Scene(**scene), engine="looped", simplify=without)
        assert not plain.simplifications and link_count(plain.packed_scene) == 0
        assert worst(plain.accelerations(q, u), model.accelerations(q, u)) < ACCURACY


def test_hinges_of_a_chain_are_counted_together() -> None:
    rod = {"mass": 1.0, "inertia": [0.1, 0.1, 0.1], "ends": {"tip": [1, 0, 0]}}
    row = {"name": "row", "count": 50, "inboard": "ground", "body": rod, "hinge": {"type": "pin"}}
    (one,) = mstmm.compile(mstmm.Scene(gravity=[0, 0, 0], chain=[row])).simplifications
    assert one.elements == ("row[0].hinge",) and str(one).startswith('50 hinges of type "pin"')
