"""Constraints against equations of points in space, Kane's equations, and closed forms."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest
import scipy.linalg
import sympy as sp
import sympy.physics.mechanics as me
from reference import newton_euler as dense
from reference.algebra import attitude, orientation, to_quaternion
from reference.compare import worst
from reference.constrained import Rows, accelerations, columns, curve, distance, plane, rolling
from reference.jets import Array
from reference.laws import Motion
from reference.random_scenes import random_scene, random_state
from reference.tree import Tree, read

import mstmm

Scene = dict[str, Any]
GRAVITY = 9.81
SEEDS = range(12)
KINDS = ("distance", "point-on-plane", "point-on-curve", "rolling", "ball")


def compiled(scene: Scene) -> mstmm.Model:
    return mstmm.compile(mstmm.Scene(**scene))


# --- random trees ---------------------------------------------------------------------------------


def _asked(
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


def _drawn(
    kind: str, rng: np.random.Generator, tree: Tree, at: Motion
) -> tuple[Scene, tuple[int, int, Rows]]:
    """A constraint between two bodies, or the ground and one."""
    a, b = sorted(int(k) for k in rng.permutation(len(tree.bodies) + 1)[:2] - 1)
    centers = [np.zeros(3) if k < 0 else at.point(k, tree.bodies[k].center) for k in (a, b)]
    between = at.A[a].T @ (centers[1] - centers[0])
    row, told = _asked(kind, rng, between, at.A[a].T @ at.A[b])
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
        row, more = _drawn(kind, rng, tree, at)
        shares = scipy.linalg.svdvals(columns(tree, q, [*asked, more]))
        if shares[-1] > 1e-2 * shares[0] and len(shares) < tree.nu:
            rows.append(row)
            asked.append(more)
    assert rows
    model = compiled(scene | {"constraint": rows})
    along = 0.7 * np.ones(model.nu - tree.nu)
    found = model.accelerations(
        np.concatenate([q, 0 * along]), np.concatenate([u, along])
    )[: tree.nu]  # fmt: skip
    wanted = accelerations(scene, q, u, asked)
    assert worst(found, wanted) < 1e-11


# --- a disc that rolls ----------------------------------------------------------------------------

RADIUS, MASS = 0.3, 2.0


@cache
def disc() -> mstmm.Model:
    """A thin disc with its axis along y on the ground, 0.3 rad off upright, rolling fast."""
    lean = orientation([0.3, 0.0, 0.0])
    free = {"name": "at", "type": "free", "inboard": "ground", "outboard": "disc",
            "initial": {"q": [0, 0, RADIUS * math.cos(0.3), *map(float, to_quaternion(lean))],
                        "u": [2.4, 0, 0, 0, 8, 0]}}  # fmt: skip
    moment = MASS * RADIUS**2 / 4
    return compiled({
        "gravity": [0, 0, -GRAVITY], "hinge": [free],
        "body": [{"name": "disc", "mass": MASS, "inertia": [moment, 2 * moment, moment]}],
        "constraint": [{"name": "road", "type": "rolling", "from": "ground", "to": "disc",
                        "normal": [0, 0, 1], "radius": RADIUS, "axis": [0, 1, 0]}],
    })  # fmt: skip


@cache
def kane() -> Any:
    """(lean, u) -> rates of the components of the angular velocity in axes that lean with the disc
    but do not spin, by SymPy's KanesMethod: x forward, y along the axis of the disc."""
    q, u = me.dynamicsymbols("q:3"), me.dynamicsymbols("u:3")
    inertial = me.ReferenceFrame("N")
    yaw = inertial.orientnew("Y", "Axis", [q[0], inertial.z])
    lean = yaw.orientnew("L", "Axis", [q[1], yaw.x])
    body = lean.orientnew("R", "Axis", [q[2], lean.y])
    turning = body.ang_vel_in(inertial)
    spin = u[0] * lean.x + u[1] * lean.y + u[2] * lean.z
    body.set_ang_vel(inertial, spin)
    contact = me.Point("C")
    contact.set_vel(inertial, 0)
    center = contact.locatenew("D", RADIUS * lean.z)
    center.v2pt_theory(contact, inertial, body)
    moment = MASS * RADIUS**2 / 4
    inertia = me.inertia(lean, moment, 2 * moment, moment)
    method = me.KanesMethod(inertial, q, u, kd_eqs=[me.dot(turning - spin, axis) for axis in lean])
    rigid = me.RigidBody("disc", center, body, MASS, (inertia, center))
    method.kanes_equations([rigid], [(center, -MASS * GRAVITY * inertial.z)])
    plain = sp.symbols("x:4")
    known = dict(zip([q[1], *u], plain, strict=True))
    matrices = [m.xreplace(known) for m in (method.mass_matrix, method.forcing)]
    return sp.lambdify(plain, matrices, "numpy")


def test_a_rolling_disc_against_kane() -> None:
    """Twenty states: the angular acceleration, seen from the disc."""
    model, rng = disc(), np.random.default_rng(2)
    assert (model.loops.rank, model.loops.mobility) == (3, 3)
    assert model.loops.rows == (("road", "x"), ("road", "y"), ("road", "normal"))
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
    assert 'constraint "road"' in result.message and "lies flat" in result.message


# --- a bead on a wire, a governor -----------------------------------------------------------------


@pytest.mark.parametrize("start", [0.4, 2.2])
def test_a_bead_on_a_cycloid_swings_in_a_time_that_is_always_the_same(start: float) -> None:
    """Along the arc sigma = 4 a sin(s / 2) it obeys sigma'' = -(g / 4 a) sigma (Huygens)."""
    a = 0.5
    place = [a * (start + math.sin(start)), 0, -a * math.cos(start)]
    free = {"name": "at", "type": "free", "inboard": "ground", "outboard": "bead",
            "initial": {"q": [*place, 1, 0, 0, 0]}}  # fmt: skip
    model = compiled({
        "gravity": [0, 0, -GRAVITY], "hinge": [free],
        "body": [{"name": "bead", "mass": 0.3, "inertia": [0.1, 0.1, 0.1]}],
        "constraint": [{"name": "wire", "type": "point-on-curve", "from": "ground", "to": "bead",
                        "curve": [f"{a}*(s + sin(s))", 0, f"-{a}*cos(s)"], "start": start}],
    })  # fmt: skip
    times = np.linspace(0.0, 4.0, 9)
    result = model.simulate(4.0, "dop853", rtol=1e-11, atol=1e-12, output_times=times)
    assert result.success, result.message
    wanted = 4 * a * math.sin(start / 2) * np.cos(math.sqrt(GRAVITY / (4 * a)) * times)
    assert np.abs(4 * a * np.sin(result.q[:, 7] / 2) - wanted).max() < 1e-9


def governor(rods: str) -> Scene:
    """Two balls on arms at a shaft that is driven, and a sleeve that two rods hang on them."""
    arm = {"mass": 1.0, "inertia": [0.002, 0.02, 0.02], "center_of_mass": [0.3, 0, 0],
           "ends": {"ball": [0.3, 0, 0]}}  # fmt: skip
    arms = [arm | {"name": f"arm{k}"} for k in range(2)]
    hinges = [
        {"name": "turn", "type": "pin", "inboard": "ground", "outboard": "shaft", "drive": "10*t"},
        {"name": "slide", "type": "prismatic", "inboard": "shaft", "outboard": "sleeve",
         "initial": {"q": -0.3 * math.sqrt(2)}},
        *({"name": f"hip{k}", "type": "pin", "inboard": "shaft", "outboard": f"arm{k}",
           "orientation": [0, 0, math.pi * k], "axis": [0, 1, 0],
           "initial": {"q": math.pi / 4}} for k in range(2)),
    ]  # fmt: skip
    scene: Scene = {
        "gravity": [0, 0, -GRAVITY], "hinge": hinges,
        "body": [{"name": "shaft", "mass": 1.0, "inertia": [0.1, 0.1, 0.1]},
                 {"name": "sleeve", "mass": 2.0, "inertia": [0.1, 0.1, 0.1]}, *arms],
    }  # fmt: skip
    for k in range(2):
        rod = {"from": f"arm{k}.ball", "to": "sleeve"}
        if rods == "constraint":
            scene.setdefault("constraint", []).append(rod | {"type": "distance", "length": 0.3})
        else:
            law = {"stiffness": 8e5, "rest": 0.3}
            scene.setdefault("spring", []).append(rod | {"law": law})
    return scene


def test_a_governor_is_stiff_by_springs_alone() -> None:
    """Both balls rise alike, as with stiff springs, in a fraction of their evaluations."""
    found, evaluations = {}, {}
    for rods in ("constraint", "spring"):
        result = compiled(governor(rods)).simulate(0.5, "dop853", rtol=1e-7)
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
        compiled(scene)
    assert 'constraint "rope"' in str(caught.value) and "leaves 0.5 m" in str(caught.value)


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
