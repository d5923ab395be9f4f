"""Code for one scene with closed loops: what the looped engine does, in straight lines."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.ir.interpreter import evaluate_floats
from mstmm.pipeline.fused_code import Fusion
from mstmm.runtime.packing.fused_structure import structure_of
from mstmm.runtime.packing.scene_packing import pack
from mstmm.runtime.run.scene_system import SceneCode, SceneSystem
from tests.reference.compare import worst
from tests.reference.random_loops import random_mechanism
from tests.support.models import compile_scene, looped_model
from tests.support.scenes.constraints import cycloid, governor, on_a_plane, on_a_road
from tests.support.scenes.linkages import bricard, cranks, four_bar
from tests.support.scenes.published_mechanisms import Scene, andrews, four_bars
from tests.system.loops.test_four_bar import linkage, rocker_driven

AGREEMENT = 1e-13
TIME = 0.3

#: Cuts, laws, rotors on both sides of a cut, drives, rows that repeat others, spatial loops.
SCENES: dict[str, Callable[[], Scene]] = {
    "four-bar": lambda: linkage("closing_pin"),
    "cut at a foot": lambda: linkage("rocker_pin"),
    "driven where it is cut": lambda: driven_linkage("rocker_pin"),
    "driven in the tree": lambda: driven_linkage("closing_pin"),
    "oblique": lambda: four_bar(tilt=(0.4, -0.7, 1.1)),
    "three cranks": cranks,
    "windows": lambda: four_bars(2),
    "Bricard": lambda: bricard(2),
    "Andrews": andrews,
    "distances": lambda: governor("constraint"),
    "a point on a plane": on_a_plane,
    "a disc that rolls": on_a_road,
    "a bead on a wire": lambda: cycloid(0.4),
}


def driven_linkage(cut: str) -> Scene:
    """The foot of the rocker is driven."""
    scene = linkage(cut)
    hinge = scene["hinge"][2]
    angle = hinge.pop("initial")["q"]
    scene["hinge"][0]["initial"].pop("u")
    return scene | {"hinge": [*scene["hinge"][:2], hinge | {"drive": f"{angle!r} + 0.2*sin(t)"},
                              scene["hinge"][3]]}  # fmt: skip


def interpreted_outputs(model: mstmm.Model, q: Any, u: Any) -> dict[str, Any]:
    """All outputs of the fused IR for a state, evaluated in floats."""
    packed = model.packed_scene
    structure, p = structure_of(packed.system, model.known or {}, floors=packed.floors)
    inputs = {
        "p": list(p), "t": [TIME], "q": list(q), "u": list(u), "efforts": [0.0] * model.nu,
        "memory": list(model.looped.start_memory()[: structure.n_memory]),
    }  # fmt: skip
    kernels = model.fusion.structure_ir(structure).kernels.values()
    return {name: x for kernel in kernels for name, x in evaluate_floats(kernel, inputs).items()}


@pytest.mark.parametrize("name", SCENES)
def test_interpreted_equals_looped(name: str, rng: np.random.Generator) -> None:
    model = looped_model(SCENES[name]())
    q, u = model.initial_state()
    u = u + rng.normal(scale=0.3, size=model.nu)
    found, wanted = interpreted_outputs(model, q, u), model.accelerations(q, u, TIME)
    inertial = float(np.abs(model.accelerations(q, 0.0 * u, TIME)).max())
    allowed = AGREEMENT * max(1.0, float(np.abs(wanted).max()), inertial)
    assert np.abs(np.array(found["udot"]) - wanted).max() < 10 * allowed


@pytest.mark.parametrize("seed", [6, 11, 14, 18])
def test_random_mechanisms(seed: int) -> None:
    """All kinds of hinges in the tree and cut, with laws, rotors, springs and loads."""
    scene, q, u = random_mechanism(seed)
    model = looped_model(scene)
    found, wanted = interpreted_outputs(model, q, u), model.accelerations(q, u, TIME)
    assert worst(np.array(found["udot"]), wanted) < 1e-12


@pytest.fixture(scope="module", params=["four-bar", "Bricard", "disc", "wire"])
def looped_and_fused(request: pytest.FixtureRequest) -> tuple[mstmm.Model, mstmm.Model]:
    """Models of a scene with loops: by the looped engine, and by code compiled for it."""
    made: dict[str, Callable[[], Scene]] = {
        "four-bar": lambda: linkage("closing_pin", laws=False), "Bricard": bricard,
        "disc": on_a_road, "wire": lambda: cycloid(0.4),
    }  # fmt: skip
    scene = made[request.param]()
    return looped_model(scene), compile_scene(scene, "fused")


def test_compiled_equals_looped(
    looped_and_fused: tuple[mstmm.Model, mstmm.Model], rng: np.random.Generator
) -> None:
    """One state, and several in the lanes of vectors."""
    looped, fused = looped_and_fused
    q, u = looped.initial_state()
    many = u + rng.normal(scale=0.1, size=(11, looped.nu))
    states = np.tile(q, (11, 1)), many
    wanted = looped.accelerations(*states)
    allowed = AGREEMENT * max(1.0, float(np.abs(wanted).max()))
    assert np.abs(fused.accelerations(*states) - wanted).max() < allowed
    assert np.abs(fused.accelerations(q, many[3]) - wanted[3]).max() < allowed


def start_state(model: mstmm.Model, q: Any, u: Any) -> Any:
    """State with which a run from q and u begins."""
    f = model.fusion
    code = None
    if f.library is not None:
        code = SceneCode(f.library, None, f.numbers, f.inputs, lambda: None)
    return SceneSystem(model.looped, code, with_power=False).start(0.0, q, u)


@pytest.mark.parametrize("away", [1e-9, 1e-6, 1e-4])
def test_loops_are_closed_alike(
    away: float, looped_and_fused: tuple[mstmm.Model, mstmm.Model], rng: np.random.Generator
) -> None:
    looped, fused = looped_and_fused
    q, u = looped.initial_state()
    near = q + away * rng.normal(size=looped.nq), u + away * rng.normal(size=looped.nu)
    wanted = start_state(looped, *near)
    assert np.abs(wanted - np.concatenate(near)).max() > 0.1 * away
    assert np.abs(start_state(fused, *near) - wanted).max() < AGREEMENT


def test_runs_sessions_and_batches(looped_and_fused: tuple[mstmm.Model, mstmm.Model]) -> None:
    looped, fused = looped_and_fused
    wanted = looped.simulate(0.2, "rk4", step=2e-3, output_times=[0.1, 0.2])
    found = fused.simulate(0.2, "rk4", step=2e-3, output_times=[0.1, 0.2])
    assert found.success and np.abs(found.q - wanted.q).max() < 1e-12
    session = fused.session(method="rk4", step=2e-3)
    session.advance(0.2)
    assert np.abs(session.q - wanted.q[-1]).max() < 1e-12
    q, u = looped.initial_state()
    batch = fused.simulate_batch(
        (np.tile(q, (3, 1)), np.tile(u, (3, 1))), t_end=0.2, method="rk4", step=2e-3
    )
    alone = looped.packed_scene.system.inactive_row_indices  # rows that go by what a run remembers
    assert ("one after the other" if alone else "side by side") in batch.engine
    assert batch.success.all()
    assert np.abs(batch.q[:, -1] - wanted.q[-1]).max() < 1e-12


def test_an_open_loop_is_named_alike() -> None:
    """At 2 s the rocker would be beyond its dead centre."""
    scene, said = rocker_driven().scene, []
    for engine in ("looped", "fused"):
        model = mstmm.compile(scene, engine=engine)
        with pytest.raises(mstmm.SceneError, match='"closing_pin" at t = 2 s: its loop') as caught:
            model.simulate(2.1, t_start=2.0)
        said.append(str(caught.value).partition("the nearest")[0])
    assert said[0] == said[1]


def test_other_numbers_take_the_same_code() -> None:
    model = compile_scene(linkage("closing_pin", laws=False), "fused")
    changes = {"coupler.mass": 2.5, "crank.center_of_mass[0]": 0.2}
    changed = model.with_parameters(changes)
    assert changed.fusion.library is model.fusion.library
    looped = looped_model(linkage("closing_pin", laws=False)).with_parameters(changes)
    q, u = looped.initial_state()
    wanted = looped.accelerations(q, u)
    assert np.abs(changed.accelerations(q, u) - wanted).max() < AGREEMENT * np.abs(wanted).max()


@pytest.mark.parametrize("cut", ["rocker_pin", "closing_pin"])
def test_power_of_drives(cut: str) -> None:
    """What a drive needs contains what the rows of a cut hinge carry."""
    model = looped_model(driven_linkage(cut))
    begun = model.simulate(TIME, t_start=TIME, initial=model.initial_state())
    found = interpreted_outputs(model, begun.q[0], begun.u[0])
    wanted = begun.power()[0]
    assert abs(wanted) > 0.1
    assert abs(found["power"][0] - wanted) < 1e-12 * abs(wanted)


@pytest.mark.parametrize("scene", ["four-bar", "windows"])
def test_rows_that_nothing_moves_cost_nothing(scene: str) -> None:
    """Closed by all rows of its pins a planar linkage has the operations that it has without those
    which say nothing."""
    one = linkage("closing_pin", laws=False) if scene == "four-bar" else four_bars(2)
    model = looped_model(one)
    every = structure_of(pack(model.scene, None).system, {}, floors=[1e-9] * 20)[0]
    left = structure_of(model.packed_scene.system, {}, floors=model.packed_scene.floors)[0]
    assert (len(every.rows), len(left.rows)) == ((5, 2) if scene == "four-bar" else (10, 4))
    counts = [
        {name: kernel.flops() for name, kernel in model.fusion.structure_ir(one).kernels.items()}
        for one in (every, left)
    ]
    assert counts[0] == counts[1]


def test_wide_loops_stay_looped() -> None:
    """Five rows pass every link of Bricard's ring."""
    model = looped_model(bricard())
    for most, wanted in ((9, ""), (8, "like 9 bodies")):
        assert wanted in Fusion(model.packed_scene, {}, {}, most=most).obstacle
        assert bool(wanted) == bool(Fusion(model.packed_scene, {}, {}, most=most).obstacle)
