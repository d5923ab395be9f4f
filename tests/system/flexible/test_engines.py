"""Fused, compiled, interpreted and looped are one meaning for flexible scenes; so are their
derivatives, the mass matrix and the inverse dynamics."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.random import Generator

import mstmm
from mstmm.errors import SceneError
from mstmm.ir import KernelIR
from mstmm.ir.interpreter import evaluate_floats
from mstmm.pipeline.fused_code import Fusion, mode_counts
from mstmm.runtime.packing.fused_structure import structure_of
from tests.reference.compare import worst
from tests.reference.jets import Array
from tests.support.kernels.complex_arithmetic import complex_step
from tests.support.kernels.perturbed_arithmetic import STEP, perturbed_outputs
from tests.support.scenes import random_flexible as engine_scenes

AGREEMENT = 1e-13
TIME = 0.3
UNIT = 2.0**-53


class Interpreted:
    """The fused IR of a model with plain floats, and how rounding moves it.

    A body whose frame is far from the section that is held may pass rounding of its moments on a
    thousandfold, and the mass matrix passes rounding on by its condition; no engine can be nearer
    to another than that.
    """

    def __init__(self, model: mstmm.Model, q: Array, u: Array) -> None:
        structure, p = structure_of(model.packed_scene.system, model.known or {})
        self.kernel: KernelIR = model.fusion.structure_ir(structure).kernels["accelerations"]
        self.inputs: dict[str, Any] = {
            "p": list(p), "t": [TIME], "q": list(q), "u": list(u), "efforts": [0.0] * model.nu,
            "memory": [0.0] * structure.n_memory,
        }  # fmt: skip
        self.udot = np.array(evaluate_floats(self.kernel, self.inputs)["udot"])
        rng = np.random.default_rng(1)
        moved = [
            np.array(perturbed_outputs(self.kernel, self.inputs, rng)["udot"]) for _ in range(6)
        ]
        sensitive = max(worst(udot, self.udot) for udot in moved) * UNIT / STEP
        matrix = model.mass_matrix(q)
        size = np.sqrt(np.diag(matrix))
        condition = float(np.linalg.cond(matrix / np.outer(size, size))) if len(size) else 1.0
        solved = max(10, 2 * len(size)) * UNIT * condition  # n equations: n rounding errors each
        self.allowed = max(AGREEMENT, 10 * sensitive, solved)


def model_on_engine(scene: dict[str, Any], engine: str) -> mstmm.Model:
    model = mstmm.compile(mstmm.Scene(**scene), engine=engine)
    assert model.engine == engine
    return model


def small(seed: int, planar: bool = True, most: int = 2) -> tuple[dict[str, Any], Array, Array]:
    """A scene of `engine_scenes` that compiles in seconds: no points of quadrature."""
    scene, q, u = engine_scenes.seeded_scene(seed, planar, most)
    for beam in scene["beam"]:
        beam["quadrature"] = False
    return scene, q, u


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("draw", range(10))
def test_interpreted_equals_looped(draw: int, rng: Generator) -> None:
    """Trees with everything there is: hinges of all types, drives, laws, loads on sections and
    along beams, springs, drag, points of quadrature, ends that are turned."""
    scene, q, u = engine_scenes.seeded_scene(int(rng.integers(2**32)), draw % 2 == 0, 3)
    model = model_on_engine(scene, "looped")
    fused = Interpreted(model, q, u)
    assert worst(fused.udot, model.accelerations(q, u, TIME)) < fused.allowed


@pytest.mark.parametrize("seed", (2, 11))
def test_compiled_equals_looped(seed: int, rng: Generator) -> None:
    """One state, and several side by side in lanes."""
    scene, q, u = small(seed)
    model, looped = model_on_engine(scene, "fused"), model_on_engine(scene, "looped")
    efforts, allowed = rng.normal(size=model.nu), Interpreted(model, q, u).allowed
    expected = looped.accelerations(q, u, TIME, efforts)
    assert worst(model.accelerations(q, u, TIME, efforts), expected) < allowed
    states = [np.tile(x, (11, 1)) for x in (q, u, efforts)]
    many = model.accelerations(states[0], states[1], TIME, states[2])
    assert worst(many, np.tile(expected, (11, 1))) < allowed


@pytest.mark.parametrize("seed", (2,))
def test_runs_agree(seed: int) -> None:
    scene, q, u = small(seed)
    results = [
        model_on_engine(scene, engine).simulate(0.3, rtol=1e-10, atol=1e-12, initial=(q, u))
        for engine in ("looped", "fused")
    ]
    assert all(result.success for result in results)
    assert worst(results[1].q[-1], results[0].q[-1], floor=1.0) < 1e-9
    assert worst(results[1].energy()[-1:], results[0].energy()[-1:], floor=1.0) < 1e-8


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("draw", range(4))
def test_mass_matrix_and_inverse(draw: int, rng: Generator) -> None:
    """Symmetric, definite, the inverse of d(udot)/d(efforts); the inverse dynamics give back the
    efforts that were put in."""
    scene, q, u = engine_scenes.seeded_scene(int(rng.integers(2**32)), draw % 2 == 0, 3)
    for hinge in scene["hinge"]:
        hinge.pop("drive", None)
    model = model_on_engine(scene, "looped")
    matrix = model.mass_matrix(q)
    size = np.sqrt(np.diag(matrix))
    scaled = matrix / np.outer(size, size)
    assert worst(scaled, scaled.T) < 1e-12
    assert np.linalg.eigvalsh(scaled)[0] > 0
    bound = AGREEMENT * max(100.0, np.linalg.cond(scaled)) * 10
    slopes = model.derivatives(q, u, TIME).efforts
    assert worst((slopes @ matrix), np.eye(model.nu)) < bound * 100
    efforts = rng.normal(size=model.nu)
    udot = model.accelerations(q, u, TIME, efforts)
    found = model.inverse_dynamics(q, u, udot, TIME)
    floor = float(np.abs(matrix @ udot).max())
    assert worst(found, efforts, floor=floor) < bound


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("draw", range(3))
def test_derivatives_are_those_of_the_complex_step(draw: int, rng: Generator) -> None:
    scene, q, u = small(int(rng.integers(2**32)), draw > 0, 2)
    model = model_on_engine(scene, "looped")
    fused, draws = Interpreted(model, q, u), rng.normal(size=model.nu)
    found = model.derivatives(q, u, TIME)
    memory = model.looped.start_memory()[None].copy()
    increment = model.looped.accelerations(TIME, q[None].copy(), draws[None].copy(), memory)[0][0]
    for name, along, direction in (
        ("q", found.q @ draws, increment),
        ("u", found.u @ draws, draws),
        ("efforts", found.efforts @ draws, draws),
        ("t", found.t, np.ones(1)),
    ):
        wanted = complex_step(fused.kernel, fused.inputs, {name: direction})["udot"]
        assert worst(along, wanted, floor=1.0) < 1000 * fused.allowed, name
    for slots in model.coordinate_layout.modal.values():
        own = slots.u_slice
        assert np.array_equal(found.rate_u[own, own], np.eye(slots.nu))
        assert not found.rate_q[own].any()


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_derivatives_by_numbers(rng: Generator) -> None:
    """Numbers of rigid bodies, hinges, laws and loads, also where frames of beams turn with them;
    those of the beams themselves are refused."""
    scene, q, u = small(5, planar=False, most=2)
    for body in scene["body"]:
        body["allow_unphysical_inertia"] = True
    model = model_on_engine(scene, "looped")
    beams = {beam["name"] for beam in scene["beam"]}
    numbers = model.parameters
    loads = tuple(f"load{k}.force_per_length" for k in range(1, 9))
    names = [
        name
        for name in numbers
        if name.partition(".")[0] not in beams
        and "initial" not in name
        and not name.startswith(loads)
        and ".span" not in name
    ]
    chosen = [str(name) for name in rng.permutation(names)[:8]]
    print(chosen)
    found = model.derivatives(q, u, TIME, parameters=chosen).parameters
    size = float(np.abs(model.accelerations(q, u, TIME)).max())
    for name in chosen:
        step = 1e-5 * max(1.0, abs(numbers[name]))
        try:
            ahead, behind = (
                model.with_parameters({name: numbers[name] + h}).accelerations(q, u, TIME)
                for h in (step, -step)
            )
        except SceneError:  # a limit of what the scene takes
            continue
        wanted = (ahead - behind) / (2 * step)
        assert worst(found[name], wanted, floor=size) < 1e-6, name
    stiffness = f"{min(beams)}.bending_stiffness[0]"
    with pytest.raises(SceneError, match="numbers of flexible bodies and of loads along them"):
        model.derivatives(q, u, TIME, parameters=[stiffness])


def test_numbers_of_beams_are_parameters() -> None:
    scene, q, u = small(2)
    model = model_on_engine(scene, "looped")
    name = scene["beam"][0]["name"]
    assert f"{name}.modes.y" not in model.parameters
    heavier = model.with_parameters({f"{name}.mass_per_length": 7.0})
    assert heavier.flexible_bodies[name].mass == pytest.approx(7.0 * scene["beam"][0]["length"])
    changed = {**scene, "beam": [{**scene["beam"][0], "mass_per_length": 7.0}, *scene["beam"][1:]]}
    expected = model_on_engine(changed, "looped").accelerations(q, u, TIME)
    assert np.array_equal(heavier.accelerations(q, u, TIME), expected)
    with pytest.raises(SceneError, match="there is no such number"):
        model.with_parameters({f"{name}.modes.y": 3})


def test_compiling_is_weighed_by_modes() -> None:
    """Frame and sections carry the modes, ends that nothing hangs on do not; more shapes, more
    evaluations until a compiler run pays."""
    counts, least = [], []
    for shapes in (1, 8):
        beam = {"name": "b", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 1.0,
                "modes": {"y": shapes}, "frame": "chord", "quadrature": False}  # fmt: skip
        rod = {"name": "rod", "mass": 1.0, "inertia": [0.1, 0.1, 0.1]}
        pins = [{"name": name, "type": "pin", "inboard": a, "outboard": b, "axis": [0, 0, 1]}
                for name, a, b in (("one", "ground", "b"), ("two", "b.tip", "rod"))]  # fmt: skip
        model = model_on_engine(
            {"gravity": [0, 0, 0], "beam": [beam], "body": [rod], "hinge": pins}, "looped"
        )
        fusion = Fusion(model.packed_scene, {}, {})
        counts.append(sorted(mode_counts(fusion.structure)))
        least.append(fusion._break_even() * sum(1 + 2 * n for n in counts[-1]))
    assert counts == [[0, 0, 1, 1], [0, 0, 8, 8]]  # held section, rod, frame, tip
    assert least[1] > 1.5 * least[0]
