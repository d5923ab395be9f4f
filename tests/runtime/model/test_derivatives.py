"""Derivatives of accelerations: against 50-digit differences and the complex step of the same
equations, and against differences of the independent dense equations."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest

import mstmm
from mstmm.derive.verification.kernel_evaluation import evaluate
from mstmm.ir import KernelIR
from mstmm.runtime.model.derivatives import Derivatives
from mstmm.runtime.packing.fused_structure import structure_of
from mstmm.runtime.packing.system_builder import system_of
from tests.reference import newton_euler as dense
from tests.reference.compare import fresh, seeded_scene, worst
from tests.reference.jets import Array
from tests.reference.tree import SIZES
from tests.support.kernels.complex_arithmetic import complex_step
from tests.support.models import compile_scene

TIME = 0.3
MOVING = tuple(name for name in SIZES if name != "fixed")
Arrays = dict[str, Any]


def equations(model: mstmm.Model, q: Array, u: Array) -> tuple[KernelIR, Arrays]:
    """The fused kernel of a model, with every number of the scene baked in, and its inputs."""
    structure, p = structure_of(system_of(model.scene, model.known)[0], model.known or {})
    kernel = model.fusion.structure_ir(structure).kernels["accelerations"]
    still = {"memory": [0.0] * structure.n_memory, "efforts": [0.0] * model.nu}
    return kernel, {"p": list(p), "t": [TIME], "q": list(q), "u": list(u), **still}


def tangent_of_q(model: mstmm.Model, q: Array, increment: Array) -> Array:
    """N(q) times the increment: qdot where the increment is the speed."""
    engine = model.looped
    memory = engine.start_memory()[None].copy()
    return engine.accelerations(TIME, q[None].copy(), increment[None].copy(), memory)[0][0]


def input_directions(model: mstmm.Model, q: Array, draw: Array) -> dict[str, Array]:
    return {"q": tangent_of_q(model, q, draw), "u": draw, "efforts": draw, "t": np.ones(1)}


def directional_derivatives(found: Derivatives, draw: Array) -> dict[str, Array]:
    columns = {name: getattr(found, name) @ draw for name in ("q", "u", "efforts")}
    return columns | {"t": found.t}


def fifty_digits(kernel: KernelIR, inputs: Arrays, port: str, direction: Array) -> Array:
    """Central difference with a step of 1e-20 at 50 digits."""
    step = Fraction(1, 10**20)
    sides = []
    for sign in (1, -1):
        moved = [
            Fraction(float(x)) + sign * step * Fraction(float(d))
            for x, d in zip(inputs[port], direction, strict=True)
        ]
        sides.append(evaluate(kernel, inputs | {port: moved})["udot"])
    with mpmath.workdps(50):
        pairs = zip(*sides, strict=True)
        return np.array([float((a - b) * 10**20 / 2) for a, b in pairs])


@pytest.mark.parametrize("seed", range(3))
def test_fifty_digits(seed: int) -> None:
    """All hinge types, laws, loads and springs, in trees: along a random direction."""
    scene, q, u = seeded_scene(100 + seed, most=3)
    model = compile_scene(scene)
    kernel, inputs = equations(model, q, u)
    draw = np.random.default_rng(seed).normal(size=model.nu)
    found = directional_derivatives(model.derivatives(q, u, TIME), draw)
    for port, direction in input_directions(model, q, draw).items():
        wanted = fifty_digits(kernel, inputs, port, direction)
        assert worst(found[port], wanted, floor=1e-3) < 1e-10, port


@pytest.mark.parametrize("draw", range(2))
def test_complex_step_on_trees_drawn_afresh(draw: int, rng: np.random.Generator) -> None:
    scene, q, u = fresh(rng, most=5)
    model = compile_scene(scene)
    kernel, inputs = equations(model, q, u)
    increment = rng.normal(size=model.nu)
    found = directional_derivatives(model.derivatives(q, u, TIME), increment)
    for port, direction in input_directions(model, q, increment).items():
        wanted = complex_step(kernel, inputs, {port: direction})["udot"]
        assert worst(found[port], wanted, floor=1.0) < 1e-10, port


@pytest.mark.parametrize("kind", MOVING)
def test_complex_step_by_hinge_type(kind: str) -> None:
    """Two hinges of one type with every law, columns one by one."""
    scene, q, u = seeded_scene(7, types=(kind,), most=2, chain=True)
    model = compile_scene(scene)
    kernel, inputs = equations(model, q, u)
    found = model.derivatives(q, u, TIME)
    for k, unit in enumerate(np.eye(model.nu)):
        for port, direction in input_directions(model, q, unit).items():
            wanted = complex_step(kernel, inputs, {port: direction})["udot"]
            column = found.t if port == "t" else getattr(found, port)[:, k]
            assert worst(column, wanted, floor=1.0) < 1e-11, (port, k)


@pytest.mark.parametrize("seed", range(3))
def test_the_independent_dense_equations(seed: int) -> None:
    """Differences of the dense Newton-Euler equations, which share nothing with mstmm."""
    scene, q, u = seeded_scene(200 + seed, most=5)
    model, step = compile_scene(scene), 1e-5
    found = model.derivatives(q, u, TIME)
    size = max(1.0, float(np.abs(found.q).max()))
    for k, unit in enumerate(np.eye(model.nu)):
        for name, dq, du in (
            ("q", step * tangent_of_q(model, q, unit), 0 * unit),
            ("u", 0 * q, step * unit),
        ):
            ahead = dense.solve(scene, q + dq, u + du, TIME).udot
            behind = dense.solve(scene, q - dq, u - du, TIME).udot
            wanted = (ahead - behind) / (2 * step)
            assert worst(getattr(found, name)[:, k], wanted, floor=size) < 1e-7, (name, k)


def test_batches_are_states_one_by_one() -> None:
    scene, q, u = seeded_scene(3, most=3)
    model = compile_scene(scene)
    names = ["gravity[0]", f"{scene['body'][0]['name']}.mass"]
    states = np.stack([q, 1.1 * q, q]), np.stack([u, u, 2 * u])
    times = np.array([0.1, 0.2, 0.3])
    together = model.derivatives(*states, times, parameters=names)
    nu = model.nu
    assert together.q.shape == (3, nu, nu) and together.state_matrix.shape == (3, 2 * nu, 2 * nu)
    assert together.t.shape == together.parameters["gravity[0]"].shape == (3, nu)
    for k in range(3):
        one = model.derivatives(states[0][k], states[1][k], times[k], parameters=names)
        for name in ("udot", "q", "u", "efforts", "t", "rate_q", "rate_u"):
            assert np.array_equal(getattr(one, name), getattr(together, name)[k])
        for name in names:
            assert np.array_equal(one.parameters[name], together.parameters[name][k])
    assert np.array_equal(together.udot, model.accelerations(*states, times))


def test_efforts_shift_the_point_of_a_nonlinear_law_not_the_slope() -> None:
    """Accelerations are affine in the efforts, whatever else acts."""
    scene, q, u = seeded_scene(11, most=3)
    model = compile_scene(scene)
    extra = np.random.default_rng(1).normal(size=model.nu)
    plain, pushed = model.derivatives(q, u, TIME), model.derivatives(q, u, TIME, efforts=extra)
    assert worst(pushed.efforts, plain.efforts) < 1e-12
    assert worst(pushed.udot - plain.udot, plain.efforts @ extra, floor=1.0) < 1e-10
