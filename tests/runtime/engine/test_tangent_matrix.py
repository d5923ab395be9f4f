"""The tangent of inverse dynamics: along a direction, and factored in O(bodies).

A direction is compared with differences of the residual and with the derivatives of the fused
accelerations; the factored tangent with a dense solve of directions.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.random import Generator

import mstmm
from mstmm.errors import NumericalFailure
from mstmm.runtime.engine.tangent_matrix import TangentMatrix
from tests.reference import random_scenes
from tests.reference.jets import Array
from tests.support.draws import draws
from tests.support.scenes import random_flexible as engine_scenes

TIME, SHARE = 0.3, 1.0
#: Efforts that drive themselves leave by themselves within the longer of these steps now and then.
INVERSE_STEPS = (200.0, 2000.0)
UNIT = 2.0**-53

Scene = dict[str, Any]


def random_rigid_scene(rng: Generator, **changes: Any) -> tuple[Scene, Array, Array]:
    seed = int(rng.integers(2**32))
    print(f"random_scenes seed = {seed}")
    scene = random_scenes.random_scene(seed, **changes)
    return scene, *random_scenes.random_state(scene, seed)


def random_flexible_scene(rng: Generator, planar: bool) -> tuple[Scene, Array, Array]:
    return engine_scenes.seeded_scene(int(rng.integers(2**32)), planar, 3)


def model_and_tangent(scene: Scene) -> tuple[mstmm.Model, TangentMatrix]:
    model = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    return model, TangentMatrix(model.looped)


def differences(
    tangent: TangentMatrix, q: Array, u: Array, a: Array, direction: tuple[Any, ...]
) -> Array:
    """Two central differences of the residual, extrapolated."""

    def slope(h: float) -> Array:
        ahead, behind = (
            tangent.residual(TIME + s * direction[0], *(
                x + s * d for x, d in zip((q, u, a), direction[1:], strict=True)
            ))
            for s in (h, -h)
        )  # fmt: skip
        return (ahead - behind) / (2 * h)

    return (4 * slope(5e-5) - slope(1e-4)) / 3


def worst(found: Array, expected: Array) -> float:
    size = max(float(np.abs(expected).max(initial=0.0)), 1e-300)
    return float(np.abs(found - expected).max(initial=0.0)) / size


def check_direction(scene: Scene, q: Array, u: Array, rng: Generator) -> None:
    check_tangent_direction(model_and_tangent(scene)[1], q, u, rng)


def check_tangent_direction(tangent: TangentMatrix, q: Array, u: Array, rng: Generator) -> None:
    a = rng.normal(size=tangent.nu)
    direction: tuple[Any, ...] = (
        1.0,
        *(rng.normal(size=n) for n in (tangent.nq, tangent.nu, tangent.nu)),
    )
    expected = differences(tangent, q, u, a, direction)
    tangent.residual(TIME, q, u, a)
    assert worst(tangent.slope(*direction), expected) < 1e-8


def factor_tangent(tangent: TangentMatrix) -> float:
    """Factor the tangent at the first inverse step that succeeds, and return that step."""
    for step in INVERSE_STEPS:
        try:
            tangent.factor(step, step, SHARE)
            return step
        except NumericalFailure as failure:
            assert "an unstable motion grows" in str(failure)
    raise AssertionError("no step is short enough")


def dense(tangent: TangentMatrix, step: float) -> tuple[Array, Any]:
    """The factored matrix from its directions, and which rows are equations."""
    columns = [
        tangent.slope(0.0, tangent.coordinates(unit), unit, step * unit)
        for unit in np.eye(tangent.nu)
    ]
    matrix = np.array(columns).reshape(tangent.nu, tangent.nu).T
    return matrix, np.flatnonzero(np.abs(matrix).max(axis=1, initial=0.0) > 0)


def check_solution(scene: Scene, q: Array, u: Array, rng: Generator) -> None:
    check_tangent_solution(model_and_tangent(scene)[1], q, u, rng)


def check_tangent_solution(tangent: TangentMatrix, q: Array, u: Array, rng: Generator) -> None:
    tangent.residual(TIME, q, u, rng.normal(size=tangent.nu))
    matrix, rows = dense(tangent, factor_tangent(tangent))
    right, expected = rng.normal(size=tangent.nu), np.zeros(tangent.nu)
    free = matrix[np.ix_(rows, rows)]
    expected[rows] = np.linalg.solve(free, right[rows])
    size = np.sqrt(np.abs(np.diag(free)))
    condition = float(np.linalg.cond(free / np.outer(size, size))) if len(rows) else 1.0
    assert worst(tangent.solve(right), expected) < max(1e-12, 100 * UNIT * condition)
    # The same x, if what other increments change is added to the right-hand side.
    d_q = tangent.coordinates(np.zeros(tangent.nu), rng.normal(size=tangent.nq))
    d_a = np.zeros(tangent.nu)
    d_a[rows] = rng.normal(size=len(rows))
    changed = tangent.slope(0.0, d_q, np.zeros(tangent.nu), d_a)
    lost = UNIT * max(1.0, worst(changed, right))
    found = tangent.solve(right + changed, d_q, d_a)
    assert worst(found, expected) < max(1e-12, 100 * lost * condition)


@pytest.mark.parametrize("draw", range(10))
def test_direction_of_rigid_trees(draw: int, rng: Generator) -> None:
    """Every hinge, laws with friction and stops, efforts, loads and springs anywhere."""
    check_direction(*random_rigid_scene(rng), rng)


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("draw", draws(4, 8))
def test_direction_of_flexible_trees(draw: int, rng: Generator) -> None:
    """Beams with drag, points of quadrature, drives, loads on sections."""
    check_direction(*random_flexible_scene(rng, draw % 2 == 0), rng)


@pytest.mark.parametrize("draw", range(20))
def test_solution_of_rigid_trees(draw: int, rng: Generator) -> None:
    check_solution(*random_rigid_scene(rng), rng)


@pytest.mark.parametrize("draw", range(6))
def test_solution_of_trees_of_many_tiles(draw: int, rng: Generator) -> None:
    """Bodies are begun tile by tile, ahead of what hangs on them in any other tile."""
    check_solution(*random_rigid_scene(rng, most=60, loads=draw % 2 == 0), rng)


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("draw", draws(4, 12))
def test_solution_of_flexible_trees(draw: int, rng: Generator) -> None:
    check_solution(*random_flexible_scene(rng, draw % 2 == 0), rng)


@pytest.mark.parametrize("draw", draws(2, 4))
def test_direction_by_derivatives_of_accelerations(draw: int, rng: Generator) -> None:
    """Where R = 0 its derivatives are those of the accelerations times -M, found by other code."""
    scene, q, u = random_rigid_scene(rng)
    model, tangent = model_and_tangent(scene)
    found, mass = model.derivatives(q, u, t=TIME), model.mass_matrix(q)
    tangent.residual(TIME, q, u, found.udot)
    none_q, none_u = np.zeros(tangent.nq), np.zeros(tangent.nu)
    way = rng.normal(size=tangent.nu)
    by_speed = tangent.slope(0.0, none_q, way, none_u)
    by_time = tangent.slope(1.0, none_q, none_u, none_u)
    assert worst(by_speed, -mass @ (found.u @ way)) < 1e-9
    assert worst(by_time, -mass @ found.t) < 1e-9


@pytest.mark.parametrize("stiffness", [1e6, 1e14, 1e22])
def test_stiff_springs_lose_nothing(stiffness: float, rng: Generator) -> None:
    """Springs between bodies as stiff as can be: the elimination is exact up to the rigid limit."""
    scene = random_scenes.aligned_chain(3, ("planar",) * 6)
    for hinge in scene["hinge"]:
        hinge["law"] = {"stiffness": [stiffness, stiffness, 1.0]}
    model, tangent = model_and_tangent(scene)
    q, u = 1e-3 * rng.normal(size=model.nq), rng.normal(size=model.nu)
    tangent.residual(TIME, q, u, rng.normal(size=model.nu))
    tangent.factor(1e3, 1e3, SHARE)
    right = rng.normal(size=model.nu)
    answer = tangent.solve(right)
    back = tangent.slope(0.0, tangent.coordinates(answer), answer, 1e3 * answer)
    assert worst(back, right) < 1e-10


def test_change_of_coordinates_follows_the_rates(rng: Generator) -> None:
    """sq dq = g_q dq + N du + rho: a ball's quaternion, whose rates depend on itself."""
    scene = random_scenes.random_scene(5, most=4, types=("ball", "free", "universal"))
    q, u = random_scenes.random_state(scene, 5)
    model, tangent = model_and_tangent(scene)
    tangent.residual(TIME, q, u, np.zeros(model.nu))
    tangent.factor(50.0, 60.0, 1.0)
    du, rho = rng.normal(size=model.nu), rng.normal(size=model.nq)
    dq = tangent.coordinates(du, rho)

    def rates(q: Array, u: Array) -> Array:
        return model.looped.rates(TIME, q, u, model.looped.start_memory())

    h = 1e-6
    by_q = (rates(q + h * dq, u) - rates(q - h * dq, u)) / (2 * h)
    assert worst(60.0 * dq, by_q + rates(q, du) + rho) < 1e-8


def test_hinges_without_kernels_that_do_several_steps_in_one(rng: Generator) -> None:
    """Those compiled before there were such kernels, or interpreted: one direction at a time."""
    types = ("ball", "free", "universal", "pin", "planar", "screw", "cylindrical", "gimbal")
    scene = random_scenes.random_scene(5, most=12, types=types)
    q, u = random_scenes.random_state(scene, 5)
    model, tangent = model_and_tangent(scene)
    right = rng.normal(size=model.nu)

    def answers() -> tuple[Array, Array]:
        tangent.residual(TIME, q, u, np.zeros(model.nu))
        tangent.factor(50.0, 60.0, 1.0)
        return tangent.solve(right), tangent.coordinates(right)

    own, record = answers(), model.looped.packed.model
    for i in range(record.n_bodies):
        for name in ("rates_by_coordinates", "rates_by_speeds", "body_motion", "directions"):
            setattr(record.bodies[i].kernels, name, model.looped.ffi.NULL)
    for found, expected in zip(answers(), own, strict=True):
        assert worst(found, expected) < 1e-12


def test_undetermined_motion_is_named() -> None:
    """Three angles whose first and last axes are one line turn the body about it twice."""
    scene = {
        "schema_version": 1,
        "gravity": [0, 0, 0],
        "body": [{"name": "rod", "mass": 1.0, "inertia": [1.0, 1.0, 1.0]}],
        "hinge": [{"name": "eye", "type": "gimbal", "inboard": "ground", "outboard": "rod"}],
    }
    _, tangent = model_and_tangent(scene)
    still = np.zeros(3)
    tangent.residual(0.0, np.array([0.2, np.pi / 2, 0.1]), still, still)
    with pytest.raises(NumericalFailure, match=r'hinge "eye".*undetermined'):
        tangent.factor(10.0, 10.0, 1.0)


def pushed_everywhere(count: int) -> tuple[Scene, Array, Array]:
    """Rods on pins and balls, every tip on a spring to the ground and under a force in space."""
    kinds = [
        {"type": "ball"} if k % 3 else {"type": "pin", "axis": [0, 1, 0]} for k in range(count)
    ]
    rod = {"mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [0.01, 0.09, 0.09]}
    rods = [rod | {"name": f"rod{k}", "ends": {"tip": [1, 0.1, 0]}} for k in range(count)]
    inboard = ["ground", *(f"rod{k}.tip" for k in range(count - 1))]
    scene = {
        "schema_version": 1,
        "gravity": [0, 0, -9.81],
        "body": rods,
        "hinge": [
            kind | {"name": f"hinge{k}", "inboard": inboard[k], "outboard": f"rod{k}"}
            for k, kind in enumerate(kinds)
        ],
        "load": [
            {"on": f"rod{k}.tip", "force": [0, "2*sin(t)", 1.0], "moment": [0.3, 0, 0.1]}
            for k in range(count)
        ],
        "spring": [
            {"from": "ground", "to": f"rod{k}.tip", "position": [k + 1.0, 0, 1.0],
             "law": {"stiffness": 200.0, "damping": 3.0, "rest": 0.8, "effort": "0.2*u"}}
            for k in range(count)
        ],
    }  # fmt: skip
    return scene, *random_scenes.random_state(scene, count)


def test_loads_that_feel_their_body_alone_are_eliminated(rng: Generator) -> None:
    """A load on each of many bodies leaves nothing to close behind the sweep."""
    scene, q, u = pushed_everywhere(30)
    assert model_and_tangent(scene)[1].off_tree_count == 0
    check_solution(scene, q, u, rng)


def test_tangent_is_the_same_whatever_was_asked_before(rng: Generator) -> None:
    """Directions leave their marks in the workspaces, of which the elimination must not know."""
    scene, q, u = pushed_everywhere(4)
    scene["spring"].append({"from": "rod0.tip", "to": "rod3.tip", "law": {"stiffness": 50.0}})
    _, tangent = model_and_tangent(scene)
    a, right = rng.normal(size=tangent.nu), rng.normal(size=tangent.nu)

    def answer() -> Array:
        tangent.residual(TIME, q, u, a)
        tangent.factor(200.0, 200.0, SHARE)
        return tangent.solve(right)

    first = answer()
    tangent.slope(1.0, *(rng.normal(size=n) for n in (tangent.nq, tangent.nu, tangent.nu)))
    assert np.array_equal(answer(), first)


def test_the_ground_rests_whatever_stood_in_its_place(rng: Generator) -> None:
    """A sweep begins the ground's own numbers anew."""
    scene, q, u = pushed_everywhere(4)
    _, tangent = model_and_tangent(scene)
    a = rng.normal(size=tangent.nu)
    expected = tangent.residual(TIME, q, u, a).copy()
    tangent.workspace[: tangent.engine.lib.MSTMM_BLOCK_FIXED] = np.nan
    assert np.array_equal(tangent.residual(TIME, q, u, a), expected)
