"""Constraints against equations of points in space, Kane's equations, and closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.linalg

import mstmm
from tests.reference import newton_euler as dense
from tests.reference.algebra import attitude, orientation, to_quaternion
from tests.reference.compare import worst
from tests.reference.constrained import (
    Rows,
    accelerations,
    columns,
    curve,
    distance,
    plane,
    rolling,
)
from tests.reference.jets import Array
from tests.reference.laws import Motion
from tests.reference.random_scenes import random_scene, random_state
from tests.reference.tree import Tree, read
from tests.support.models import compile_scene
from tests.support.scenes.constraints import (
    GRAVITY,
    MASS,
    RADIUS,
    Scene,
    cycloid,
    disc,
    governor,
    kane,
)

SEEDS = range(12)
KINDS = ("distance", "point-on-plane", "point-on-curve", "rolling", "ball")


# --- random trees ---------------------------------------------------------------------------------


def _satisfied_constraint(
    kind: str, rng: np.random.Generator, between: Array, turned: Array
) -> tuple[Scene, Rows]:
    """A constraint that is met now, and its rows; `between` are the centres in axes of A, `turned`
    the axes of B in those of A."""
    normal, axis = (v / np.linalg.norm(v) for v in rng.uniform(-1, 1, (2, 3)))
    if kind == "distance":
        return {"type": kind, "length": float(np.linalg.norm(between))}, distance
    if kind == "point-on-plane":
        offset = float(normal @ between)
        return {"type": kind, "normal": list(normal), "offset": offset}, plane(normal)
    if kind == "point-on-curve":
        b, c = rng.uniform(-1, 1, (2, 3))
        numbers = zip(between.tolist(), b.tolist(), c.tolist(), strict=True)
        text = [f"{x!r} + ({y!r})*sin(s) + ({z!r})*s^2" for x, y, z in numbers]
        return {"type": kind, "curve": text, "start": 0}, curve(between, b, 2 * c, 0.7)
    e = axis if kind == "rolling" else np.zeros(3)
    along = turned @ e
    height = math.sqrt(1 - (normal @ along) ** 2) if kind == "rolling" else 1.0
    row = {"type": "rolling", "normal": list(normal), "radius": 0.4,
           "offset": float(normal @ between - 0.4 * height)}  # fmt: skip
    return row | ({"axis": list(e)} if kind == "rolling" else {}), rolling(normal, 0.4, e)


def _random_constraint(
    kind: str, rng: np.random.Generator, tree: Tree, at: Motion
) -> tuple[Scene, tuple[int, int, Rows]]:
    """A constraint between two bodies, or the ground and one."""
    a, b = sorted(int(k) for k in rng.permutation(len(tree.bodies) + 1)[:2] - 1)
    centers = [np.zeros(3) if k < 0 else at.point(k, tree.bodies[k].center) for k in (a, b)]
    between = at.A[a].T @ (centers[1] - centers[0])
    row, told = _satisfied_constraint(kind, rng, between, at.A[a].T @ at.A[b])
    first = "ground" if a < 0 else f"{tree.bodies[a].name}.center"
    return row | {"from": first, "to": f"{tree.bodies[b].name}.center"}, (a, b, told)


@pytest.mark.parametrize("seed", SEEDS)
def test_random_trees(seed: int) -> None:
    """One constraint or two, each kind on the ground and between bodies."""
    rng = np.random.default_rng(seed)
    scene = random_scene(300 + seed, 5, types=("free", "ball", "free", "universal", "planar"))
    q, u = random_state(scene, seed)
    tree = read(scene)
    for data, hinge in zip(scene["hinge"], tree.hinges, strict=True):
        data["initial"] = {"q": [float(x) for x in q[hinge.q]]}
        data["hold"] = len(tree.hinges) > 1  # met already: nothing has to give way
    at, rows = dense.motion(tree, q, 0 * u), list[Scene]()
    asked: list[tuple[int, int, Rows]] = []
    for body in scene["body"]:
        body["ends"]["center"] = list(body["center_of_mass"])
    for kind in (KINDS[seed % 5], KINDS[(seed // 5 + seed) % 3]):
        row, more = _random_constraint(kind, rng, tree, at)
        shares = scipy.linalg.svdvals(columns(tree, q, [*asked, more]))
        if shares[-1] > 1e-2 * shares[0] and len(shares) < tree.nu:
            rows.append(row)
            asked.append(more)
    assert rows
    model = compile_scene(scene | {"constraint": rows})
    along = 0.7 * np.ones(model.nu - tree.nu)
    found = model.accelerations(
        np.concatenate([q, 0 * along]), np.concatenate([u, along])
    )[: tree.nu]  # fmt: skip
    wanted = accelerations(scene, q, u, asked)
    assert worst(found, wanted) < 1e-11


# --- a disc that rolls ----------------------------------------------------------------------------


def test_a_rolling_disc_against_kane() -> None:
    """Twenty states: the angular acceleration, seen from the disc."""
    model, rng = disc(), np.random.default_rng(2)
    assert (model.loops.rank, model.loops.mobility) == (3, 3)
    assert model.loops.constraint_rows == (("road", "x"), ("road", "y"), ("road", "normal"))
    for _ in range(20):
        yaw, lean, turn = rng.uniform([-3, -1.2, -3], [3, 1.2, 3])
        u = rng.uniform(-5, 5, 3)
        leaning = orientation([0, 0, yaw]) @ orientation([lean, 0, 0])
        spun = orientation([0, turn, 0])
        velocity = leaning @ np.cross(u, [0, 0, RADIUS])
        attitude = leaning @ spun
        q = [0.1, 0.2, RADIUS * math.cos(lean), *to_quaternion(attitude)]
        found = model.accelerations(
            np.array(q), np.concatenate([attitude.T @ velocity, spun.T @ u])
        )[3:]
        matrix, forcing = kane()(lean, *u)
        rates = np.linalg.solve(matrix, forcing)[:, 0]
        frame = np.array([u[0], u[2] * math.tan(lean), u[2]])
        assert worst(found, spun.T @ (rates + np.cross(frame, u))) < 1e-13


def test_a_rolling_disc_over_time() -> None:
    """Neither slip nor height grows, and energy is kept: what holds it does no work."""
    result = disc().simulate(5.0, "dop853", rtol=1e-9, output_times=np.linspace(0, 5, 41))
    assert result.success, result.message
    energies = []
    for q, u in zip(result.q, result.u, strict=True):
        turn = attitude(q[3:])
        axis, up = turn[:, 1], np.array([0, 0, 1.0])
        down = up - axis[2] * axis
        rho = -RADIUS * down / np.linalg.norm(down)
        slip = turn @ u[:3] + np.cross(turn @ u[3:], rho)
        assert abs(q[2] + rho[2]) < 1e-9 and np.abs(slip).max() < 1e-8
        moment = MASS * RADIUS**2 / 4 * np.array([1, 2, 1])
        energies.append(MASS * (u[:3] @ u[:3] / 2 + GRAVITY * q[2]) + u[3:] @ (moment * u[3:]) / 2)
    # At the end of a step all is projected.
    assert abs(q[2] + rho[2]) < 1e-13 and np.abs(slip).max() < 1e-12
    assert np.ptp(energies) < 1e-7 * energies[0]


def test_a_disc_that_falls_flat() -> None:
    """Where it would touch along a line no point of contact is left, and the run says so."""
    model = disc()
    q, u = model.initial_state()
    result = model.simulate(2.0, "dop853", rtol=1e-6, initial=(q, 0 * u))
    assert not result.success
    assert 'constraint "road"' in result.message and "is flat on its plane" in result.message
    batch = mstmm.compile(model.scene, engine="fused").simulate_batch((q[None], 0 * u), t_end=2.0)
    assert not batch.success[0] and batch.messages[0].startswith(
        "the state cannot be accepted at t"
    )
    assert "simulate this trajectory alone to find the cause" in batch.messages[0]


# --- a bead on a wire, a governor -----------------------------------------------------------------


@pytest.mark.parametrize("start", [0.4, 2.2])
def test_a_bead_on_a_cycloid_swings_in_a_time_that_is_always_the_same(start: float) -> None:
    """Along the arc sigma = 4 a sin(s / 2) it obeys sigma'' = -(g / 4 a) sigma (Huygens)."""
    a = 0.5
    model = compile_scene(cycloid(start, a))
    times = np.linspace(0.0, 4.0, 9)
    result = model.simulate(4.0, "dop853", rtol=1e-11, atol=1e-12, output_times=times)
    assert result.success, result.message
    wanted = 4 * a * math.sin(start / 2) * np.cos(math.sqrt(GRAVITY / (4 * a)) * times)
    assert np.abs(4 * a * np.sin(result.q[:, 7] / 2) - wanted).max() < 1e-9


def test_a_governor_is_stiff_by_springs_alone() -> None:
    """Both balls rise alike, as with stiff springs, in a fraction of their evaluations."""
    found, evaluations = {}, {}
    for rods in ("constraint", "spring"):
        result = compile_scene(governor(rods)).simulate(0.5, "dop853", rtol=1e-7)
        assert result.success, result.message
        assert result.statistics is not None
        found[rods], evaluations[rods] = result, result.statistics.evaluations
    rigid = found["constraint"]
    assert np.ptp(rigid.q[-1][-2:]) < 1e-10
    assert np.abs(rigid.q[-1] - found["spring"].q[-1]).max() < 1e-3
    assert evaluations["constraint"] < 0.1 * evaluations["spring"]


# --- what cannot be -------------------------------------------------------------------------------


def test_a_length_that_cannot_be_reached() -> None:
    """The row is named as the user's, and the least gap told."""
    pin = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod", "axis": [0, 1, 0]}
    scene = {
        "gravity": [0, 0, -GRAVITY], "hinge": [pin],
        "body": [{"name": "rod", "mass": 1, "inertia": [1, 1, 1], "ends": {"tip": [1, 0, 0]}}],
        "constraint": [{"name": "rope", "type": "distance", "from": "ground", "to": "rod.tip",
                        "position": [3, 0, 0], "length": 1.5}],
    }  # fmt: skip
    with pytest.raises(mstmm.SceneError) as caught:
        compile_scene(scene)
    assert 'constraint "rope"' in str(caught.value) and "has a gap of 0.5 m" in str(caught.value)


def test_a_distance_between_points_in_one_place_opens() -> None:
    """A free body that starts at the end of its own rod is carried off, and hangs on it then."""
    body = {"name": "bob", "mass": 1.0, "inertia": [0.1, 0.1, 0.1]}
    free = {"name": "free", "type": "free", "inboard": "ground", "outboard": "bob"}
    rod = {"name": "rod", "type": "distance", "from": "ground", "to": "bob", "length": 1.0}
    scene = mstmm.Scene(gravity=[0, -9.81, 0], body=[body], hinge=[free], constraint=[rod])
    result = mstmm.compile(scene, engine="looped").simulate(1.0, certify=True)
    lengths = np.linalg.norm(result.position("bob"), axis=1)
    assert np.abs(lengths - 1.0).max() < 1e-9
    # The ground passes the rod's load on, so that momentum is nothing that is kept.
    assert "momentum" not in str(result.certificate)
