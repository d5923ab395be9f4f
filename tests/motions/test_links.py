"""Frames by common normals and runs of links: they mean what bodies one by one mean."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from reference.compare import fresh, worst
from support.rod_scenes import chain

import mstmm
from mstmm.runtime.engine.calls import Observation
from mstmm.runtime.engine.engine import Engine
from mstmm.runtime.pack.pack import pack
from mstmm.runtime.pack.packed import Packed

AXIAL = ("pin", "prismatic", "cylindrical", "screw")
ACCURACY = 1e-11

Array = NDArray[np.float64]


def packed(scene: dict[str, Any], align: bool = True) -> Packed:
    return pack(mstmm.Scene(**scene), align=align)


def linked(found: Packed) -> int:
    """Number of bodies that are swept as links."""
    runs = [found.model.runs[k] for k in range(found.model.n_runs)]
    assert sum(run.count for run in runs) == found.system.count
    return sum(run.count for run in runs if run.numbers != found.ffi.NULL)


def swept(found: Packed, q: Array, u: Array) -> Array:
    engine = Engine(found)
    memory = engine.start_memory()
    return engine.accelerations(0.3, q[None], u[None], memory[None])[1][0]


def observed(found: Packed, q: Array, u: Array) -> Observation:
    engine = Engine(found)
    memory = engine.start_memory()
    return engine.observe(np.array([0.3]), q[None], u[None], memory[None])


def test_links_mean_what_blocks_mean(rng: np.random.Generator) -> None:
    count = 0
    for draw in range(24):
        types = AXIAL if draw % 2 else (*AXIAL, "ball", "universal")
        scene, q, u = fresh(rng, types=types, most=12, loads=False)
        found = packed(scene)
        count += linked(found)
        udot = swept(found, q, u)
        assert worst(udot, observed(found, q, u).udot[0]) < ACCURACY
        assert worst(udot, swept(packed(scene, align=False), q, u)) < ACCURACY
    assert count > 5


def test_loads_are_at_the_hinge_wherever_the_frame_is(rng: np.random.Generator) -> None:
    moved = 0
    for _ in range(12):
        scene, q, u = fresh(rng, types=AXIAL)
        found, plain = packed(scene), packed(scene, align=False)
        moved += sum(abs(body.height) > 1e-3 for body in found.system.distinct)
        one, two = observed(found, q, u), observed(plain, q, u)
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
    found = packed(scene)
    assert linked(found) >= 4
    assert (
        worst(swept(found, q + 2 * math.pi * turns, u), swept(found, q, u)) < 1e-14 * turns + 1e-12
    )


@pytest.mark.parametrize("angle", [0.0, math.pi / 2])
def test_right_angles_leave_zeros_and_ones(angle: float) -> None:
    found = packed(chain(["pin"] * 4, angle, gravity=(0, -9.81, 0)))
    for i in range(1, 4):
        body = found.system.body(i)
        assert {abs(x) for x in body.connection[:9]} <= {0.0, 1.0}
        assert abs(body.link[0]) == round(abs(math.cos(angle)))


def test_nearly_parallel_axes_keep_the_hinges_own_frames() -> None:
    """Their common normal is far away, and a lever that long would cost digits."""
    scene = chain(["pin"] * 3, 1e-3, gravity=(0, -9.81, 0))
    found = packed(scene)
    assert all(abs(body.height) < 4.0 for body in found.system.distinct)
    q, u = np.full(3, 0.3), np.full(3, -0.2)
    assert worst(swept(found, q, u), swept(packed(scene, align=False), q, u)) < 1e-13
