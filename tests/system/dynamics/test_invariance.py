"""One system described in several ways moves in one way; what mechanics keeps is kept."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest

from tests.reference import newton_euler as dense
from tests.reference.algebra import attitude, orientation
from tests.reference.compare import fresh, worst
from tests.reference.jets import Array
from tests.reference.random_scenes import floating_tree, random_state
from tests.support.models import compile_scene
from tests.support.scenes.scene_changes import (
    change_body_axes,
    heavier,
    permute_bodies,
    reorder_hinges,
    rotate_scene,
    split,
)

TIME = 0.3
ACCURACY = 1e-11
DRAWS = range(6)


def deviation(scene: dict[str, Any], other: dict[str, Any], q: Array, u: Array) -> float:
    expected = compile_scene(scene).accelerations(q, u, TIME)
    return worst(compile_scene(other).accelerations(q, u, TIME), expected)


@pytest.mark.parametrize("draw", DRAWS)
def test_rotated_and_moved_scenes(draw: int, rng: np.random.Generator) -> None:
    scene, q, u = fresh(rng)
    turn, shift = orientation(rng.uniform(-3, 3, 3)), rng.uniform(-5, 5, 3)
    assert deviation(scene, rotate_scene(scene, turn, shift), q, u) < ACCURACY


@pytest.mark.parametrize("draw", DRAWS)
def test_other_body_axes(draw: int, rng: np.random.Generator) -> None:
    scene, q, u = fresh(rng)
    for load in scene["load"]:
        load["axes"] = "inertial"
    assert deviation(scene, change_body_axes(scene, rng), q, u) < ACCURACY


@pytest.mark.parametrize("draw", DRAWS)
def test_two_welded_halves_are_one_body(draw: int, rng: np.random.Generator) -> None:
    scene, q, u = fresh(rng)
    name = str(rng.choice([body["name"] for body in scene["body"]]))
    assert deviation(scene, split(scene, name, rng.uniform(0.1, 0.9), rng), q, u) < ACCURACY


@pytest.mark.parametrize("draw", DRAWS)
def test_the_order_of_bodies_changes_nothing(draw: int, rng: np.random.Generator) -> None:
    scene, q, u = fresh(rng)
    assert deviation(scene, permute_bodies(scene, rng), q, u) < ACCURACY


@pytest.mark.parametrize("draw", DRAWS)
def test_the_order_of_hinges_is_the_order_of_coordinates(
    draw: int, rng: np.random.Generator
) -> None:
    scene, q, u = fresh(rng)
    other, q_places, u_places = reorder_hinges(scene, rng)
    expected = compile_scene(scene).accelerations(q, u, TIME)[u_places]
    found = compile_scene(other).accelerations(q[q_places], u[u_places], TIME)
    assert worst(found, expected) < ACCURACY


@pytest.mark.parametrize("draw", DRAWS)
@pytest.mark.parametrize("factor", [2.0**40, 2.0**-40, 3e4])
def test_the_unit_of_mass_changes_nothing(
    factor: float, draw: int, rng: np.random.Generator
) -> None:
    """A power of two not even in the last bit."""
    scene, q, u = fresh(rng)
    expected = compile_scene(scene).accelerations(q, u, TIME)
    found = compile_scene(heavier(scene, factor)).accelerations(q, u, TIME)
    if factor == 3e4:
        assert worst(found, expected) < ACCURACY
    else:
        assert np.array_equal(found, expected)


def test_a_conservative_motion_runs_backwards() -> None:
    """Speeds reversed at the end, the run leads back to its start."""
    scene = floating_chain(False, {}, [(0.4, 0.7), (-0.6, -1.1)])
    for hinge in scene["hinge"]:
        hinge.get("law", {}).pop("damping", None)
    model = compile_scene(scene)
    q, u = model.initial_state()
    u[:6] = [0.3, -0.2, 0.1, 0.5, 0.9, -0.4]
    there = model.simulate(1.5, rtol=1e-12, atol=1e-13, initial=(q, u))
    back = model.simulate(1.5, rtol=1e-12, atol=1e-13, initial=(there.q[-1], -there.u[-1]))
    assert np.abs(back.q[-1] - q).max() < 1e-9
    assert np.abs(back.u[-1] + u).max() < 1e-9


def test_a_motion_in_a_moving_frame_is_the_same_motion() -> None:
    """A constant velocity added to everything that floats without gravity."""
    scene = floating_chain(False, {}, [(0.4, 0.7), (-0.6, -1.1)])
    scene["gravity"] = [0.0, 0.0, 0.0]
    model, drift = compile_scene(scene), np.array([3.0, -5.0, 2.0])
    q, u = model.initial_state()
    u[3:6] = [0.5, 0.9, -0.4]
    moved = u.copy()
    moved[:3] += drift  # the root's axes are the inertial ones at the start
    options: dict[str, Any] = {
        "rtol": 1e-12, "atol": 1e-13, "output_times": np.linspace(0, 1, 4),
    }  # fmt: skip
    here = model.simulate(1.0, initial=(q, u), **options)
    there = model.simulate(1.0, initial=(q, moved), **options)
    for i in range(3):
        travelled = here.t[:, None] * drift
        name = f"body{i}"
        assert np.abs(there.position(name) - here.position(name) - travelled).max() < 1e-9
    assert np.abs(there.u[:, 6:] - here.u[:, 6:]).max() < 1e-9


def test_a_motion_in_a_rotated_scene_is_the_rotated_motion(rng: np.random.Generator) -> None:
    scene, q, u = fresh(rng, types=("pin", "ball", "universal", "free"), most=4)
    turn, shift = orientation(rng.uniform(-3, 3, 3)), rng.uniform(-2, 2, 3)
    times = np.linspace(0, 0.3, 4)
    options: dict[str, Any] = {
        "rtol": 1e-11, "atol": 1e-13, "output_times": times, "initial": (q, u),
    }  # fmt: skip
    here = compile_scene(scene).simulate(0.3, **options)
    there = compile_scene(rotate_scene(scene, turn, shift)).simulate(0.3, **options)
    assert here.success, here.message
    assert worst(there.q, here.q) < 1e-9
    assert worst(there.u, here.u) < 1e-8
    for body in scene["body"]:
        name = body["name"]
        moved = here.position(name) @ turn.T + shift
        assert worst(there.position(name), moved, floor=1.0) < 1e-9
        for one, other in zip(here.orientation(name), there.orientation(name), strict=True):
            assert np.abs(turn @ attitude(one) - attitude(other)).max() < 1e-9
    for hinge in scene["hinge"]:
        force = here.force(hinge["name"]) @ turn.T
        assert worst(there.force(hinge["name"]), force, floor=1.0) < 1e-7


# --- read from either end ---------------------------------------------------------------------

SHAPES = (
    {"mass": 1.3, "center_of_mass": [0.4, 0.1, -0.05], "inertia": [0.1, 0.2, 0.25]},
    {"mass": 0.4, "center_of_mass": [0.5, -0.1, 0.1], "inertia": [0.05, 0.1, 0.08]},
    {"mass": 2.1, "center_of_mass": [0.3, 0.2, 0.1], "inertia": [0.3, 0.2, 0.4]},
)
NEAR = {"position": [-0.2, 0.1, 0.0], "orientation": [0.3, -0.2, 0.5]}
FAR = {"position": [0.9, 0.2, -0.1], "orientation": [-0.4, 0.6, 0.2]}
AXIS = [0.2, -0.3, 0.9]


def floating_chain(backwards: bool, free: dict[str, Any], pins: list[Any]) -> dict[str, Any]:
    """Three bodies in free flight on two pins, read from the first or from the last body.

    A pin between ends of equal axes at angle 0 is the same pin read backwards, its axis in the
    same numbers and its angle with the other sign.
    """
    bodies = [
        {"name": f"body{i}", **shape, "ends": {"near": NEAR, "far": FAR}}
        for i, shape in enumerate(SHAPES)
    ]
    root = 2 if backwards else 0
    hinges = [
        {"name": "root", "type": "free", "inboard": "ground", "outboard": f"body{root}"} | free
    ]
    for i, (angle, speed) in enumerate(pins):
        ends = (f"body{i}.far", f"body{i + 1}.near")
        inboard, outboard = reversed(ends) if backwards else ends
        sign = -1.0 if backwards else 1.0
        hinges.append(
            {
                "name": f"pin{i}", "type": "pin", "inboard": inboard, "outboard": outboard,
                "axis": AXIS, "initial": {"q": [sign * angle], "u": [sign * speed]},
                "law": {"stiffness": 3.0, "damping": 0.1},
            }
        )  # fmt: skip
    return {"schema_version": 1, "gravity": [0.0, 0, -9.81], "body": bodies, "hinge": hinges}


def test_a_floating_chain_read_from_either_end() -> None:
    pins, times = [(0.4, 0.7), (-0.6, -1.1)], np.linspace(0, 1, 5)
    start = {"q": [0.1, 0.2, 0.3, 0.8, 0.0, 0.6, 0.0], "u": [0.3, -0.2, 0.1, 0.5, 0.9, -0.4]}
    options: dict[str, Any] = {"rtol": 1e-11, "atol": 1e-13, "output_times": times}
    here = compile_scene(floating_chain(False, {"initial": start}, pins)).simulate(1.0, **options)
    # The start of the last body as the forward reading has it; speeds in its own axes.
    place, turned = here.position("body2")[0], here.orientation("body2")[0]
    speeds = [here.velocity("body2")[0], here.angular_velocity("body2")[0]]
    own = np.concatenate([attitude(turned).T @ speed for speed in speeds])
    last = {"q": [*place.tolist(), *turned.tolist()], "u": own.tolist()}
    there = compile_scene(floating_chain(True, {"initial": last}, pins)).simulate(1.0, **options)
    assert here.success
    assert there.success
    for i in range(3):
        for quantity in ("position", "velocity", "acceleration", "angular_acceleration"):
            expected = getattr(here, quantity)(f"body{i}")
            assert worst(getattr(there, quantity)(f"body{i}"), expected) < 1e-9, quantity
    for i in range(2):
        assert worst(-there.coordinates(f"pin{i}"), here.coordinates(f"pin{i}")) < 1e-9
        assert worst(-there.force(f"pin{i}"), here.force(f"pin{i}")) < 1e-8
        assert worst(-there.moment(f"pin{i}"), here.moment(f"pin{i}")) < 1e-8
    assert worst(there.energy(), here.energy()) < 1e-10


# --- planes -----------------------------------------------------------------------------------


def test_a_planar_scene_stays_in_its_plane(rng: np.random.Generator) -> None:
    """All axes z, mass centres in the plane: nothing out of it, not even rounding."""
    scene, q, u = fresh(rng, types=("pin",), most=6, laws=False, loads=False)
    scene["gravity"][2] = 0.0
    for body in scene["body"]:
        body["center_of_mass"][2] = 0.0
        body["inertia"] = [*body["inertia"][:3], body["inertia"][3], 0.0, 0.0]
        body["inertia"][2] = body["inertia"][0] + body["inertia"][1]
        body["ends"] = {"plain": [*body["ends"]["plain"][:2], 0.0]}
    for hinge in scene["hinge"]:
        hinge |= {"orientation": [0, 0, 0.4], "axis": [0, 0, 1]}
        hinge["outboard"] = hinge["outboard"].partition(".")[0]
        if hinge["inboard"] == "ground":
            hinge["position"][2] = 0.0
        else:
            hinge["inboard"] = hinge["inboard"].partition(".")[0] + ".plain"
    result = compile_scene(scene).simulate(0.5, initial=(q, u))
    assert result.success
    for body in scene["body"]:
        name = body["name"]
        assert not result.position(name)[:, 2].any()
        assert not result.velocity(name)[:, 2].any()
        assert not result.orientation(name)[:, 1:3].any()
    for hinge in scene["hinge"]:
        assert not result.force(hinge["name"])[:, 2].any()
        assert not result.moment(hinge["name"])[:, :2].any()


# --- what mechanics keeps ---------------------------------------------------------------------


@pytest.mark.parametrize("draw", range(4))
def test_momentum_of_a_floating_tree(draw: int, rng: np.random.Generator) -> None:
    seed = int(rng.integers(2**32))
    print(f"floating_tree seed = {seed}")
    scene = floating_tree(seed, most=4)
    for hinge in scene["hinge"]:
        hinge.get("law", {}).pop("limits", None)
        hinge.get("law", {}).pop("friction", None)
        hinge.get("law", {}).pop("inertia", None)
    q, u = random_state(scene, seed)
    result = compile_scene(scene).simulate(0.3, rtol=1e-11, atol=1e-13, initial=(q, u))
    assert result.success, result.message
    for momentum in (result.momentum(), result.angular_momentum()):
        scale = np.abs(momentum).max() + np.sqrt(result.energy_components()["kinetic"].max())
        assert np.abs(momentum - momentum[0]).max() < 1e-8 * scale
    drifts = [drift.relative for drift in result.certificate.momentum]
    assert len(drifts) == 6
    assert max(drifts) < 1e-8


@pytest.mark.parametrize("draw", range(6))
def test_energy_rate_is_the_power(draw: int, rng: np.random.Generator) -> None:
    """Energy from the states against the integral of the power, over a short run."""
    scene, q, u = fresh(rng, most=5)
    for hinge in scene["hinge"]:
        hinge.get("law", {}).pop("limits", None)
    result = compile_scene(scene).simulate(
        0.02, rtol=1e-11, atol=1e-13, initial=(q, u), output_times=np.linspace(0, 0.02, 9)
    )
    assert result.success, result.message
    energy = result.energy()
    scale = (
        np.abs(result.power()).max() * 0.02 + np.ptp(result.energy_components()["kinetic"]) + 1e-12
    )
    assert np.abs(energy - energy[0] - result.work).max() < 1e-7 * scale
    assert result.certificate.energy.relative < 1e-7


@pytest.mark.parametrize("draw", range(6))
def test_mass_matrix_is_the_hessian_of_the_kinetic_energy(
    draw: int, rng: np.random.Generator
) -> None:
    scene, q, u = fresh(rng)
    model = compile_scene(scene)
    rotors = np.zeros(model.nu)
    for hinge in scene["hinge"]:
        inertia = hinge.get("law", {}).pop("inertia", None)
        if inertia is not None:
            rotors[model.coordinate_layout.hinges[hinge["name"]].u_slice] = inertia
    with_rotors, bare = model.mass_matrix(q), compile_scene(scene)
    matrix = bare.mass_matrix(q)
    size = np.abs(matrix).max(initial=1.0)
    assert np.array_equal(matrix, matrix.T)
    assert np.linalg.eigvalsh(matrix).min(initial=1.0) > 0

    def kinetic(speeds: Array) -> float:
        state = bare.simulate(TIME, t_start=TIME, initial=(q, speeds))
        return float(state.energy_components()["kinetic"][0])

    # Kinetic energy is a quadratic form: T(a + b) - T(a) - T(b) = a^T M b without truncation.
    other = rng.uniform(-1, 1, model.nu)
    mixed = kinetic(u + other) - kinetic(u) - kinetic(other)
    assert abs(mixed - u @ matrix @ other) < 1e-11 * size * max(1, model.nu)
    assert np.abs(with_rotors - matrix - np.diag(rotors)).max(initial=0.0) < 1e-12 * size


@pytest.mark.parametrize("draw", range(8))
def test_forward_after_inverse_dynamics(draw: int, rng: np.random.Generator) -> None:
    """With laws, loads, springs and drives; judged by what rounding of the efforts can do."""
    scene, q, u = fresh(rng, types=("pin", "prismatic", "cylindrical", "ball", "universal"))
    for number, hinge in enumerate(scene["hinge"]):
        if number % 3 == 0 and hinge["type"] != "ball":
            count = {"cylindrical": 2, "universal": 2}.get(hinge["type"], 1)
            hinge["drive"] = ["0.3*sin(2*t)"] + ["free"] * (count - 1)
    dense.fill_driven(scene, q, u, TIME)
    model = compile_scene(scene)
    driven = model.accelerations(q, u, TIME) - model.accelerations(
        q, u, TIME, rng.uniform(-9, 9, model.nu)
    )
    free = driven != 0
    asked = model.accelerations(q, u, TIME)
    asked[free] = rng.uniform(-2, 2, model.nu)[free]
    efforts = model.inverse_dynamics(q, u, asked, TIME)
    again = model.accelerations(q, u, TIME, np.where(free, efforts, 0.0))
    matrix = model.mass_matrix(q)[np.ix_(free, free)]
    condition = np.linalg.cond(matrix) if free.any() else 1.0
    assert np.abs(again - asked).max(initial=0.0) < 1e-12 * max(1.0, condition / 1e2)


# --- drives -----------------------------------------------------------------------------------

PARTLY = {
    "cylindrical": [["0.2*sin(3*t)", "free"], ["free", "t + 0.1*cos(t)"], ["0.1*t^2", "sin(t)"]],
    "universal": [["0.2*sin(3*t)", "free"], ["free", "0.4*t"], ["0.1*t^2", "sin(t)"]],
    "planar": [
        ["0.2*sin(3*t)", "free", "free"], ["free", "0.4*t^2", "free"], ["free", "free", "sin(t)"],
        ["0.1*t", "free", "cos(t)"], ["t^2", "exp(-t)", "free"], ["t^2", "t^3", "sin(5*t)"],
    ],
    "gimbal": [["free", "0.3*sin(t)", "free"], ["0.3*t", "free", "0.1*t^3"]],
    "pin": [["0.3*sin(t)^2"]],
    "prismatic": [["0.3*sin(t)^2"]],
    "screw": [["sqrt(1 + t)"]],
}  # fmt: skip


@pytest.mark.parametrize("kind", PARTLY)
def test_partly_driven_hinges(kind: str, rng: np.random.Generator) -> None:
    """Accelerations and the drives' own efforts against the dense equations."""
    for drive in PARTLY[kind]:
        scene, q, u = fresh(rng, types=(kind, "ball", "pin"), most=4)
        found = [hinge for hinge in scene["hinge"] if hinge["type"] == kind]
        while not found:
            scene, q, u = fresh(rng, types=(kind, "ball", "pin"), most=4)
            found = [hinge for hinge in scene["hinge"] if hinge["type"] == kind]
        for hinge in found:
            hinge["drive"] = list(drive)
        dense.fill_driven(scene, q, u, TIME)
        expected, model = dense.solve(scene, q, u, TIME), compile_scene(scene)
        assert worst(model.accelerations(q, u, TIME), expected.udot) < ACCURACY
        result = model.simulate(TIME, t_start=TIME, initial=(q, u))
        for hinge in found:
            place = model.coordinate_layout.hinges[hinge["name"]].u_slice
            free = np.array([text == "free" for text in drive])
            effort = result.effort(hinge["name"])[0] - expected.effort[place]
            rotor = np.array(hinge.get("law", {}).get("inertia", np.zeros(len(free))))
            effort = effort - rotor * expected.udot[place]
            assert np.abs(np.where(free, 0.0, effort)).max() < ACCURACY * max(
                1.0, np.abs(expected.force).max(), np.abs(expected.moment).max()
            )


def test_a_drive_takes_the_state_it_prescribes(rng: np.random.Generator) -> None:
    """Whatever q and u say of a driven coordinate, accelerations are those of the drive."""
    scene, q, u = fresh(rng, types=("pin",), chain=True, most=4)
    scene["hinge"][0]["drive"] = ["0.3*sin(2*t)"]
    right = copy.deepcopy((q, u))
    dense.fill_driven(scene, *right, TIME)
    model = compile_scene(scene)
    assert np.array_equal(model.accelerations(q, u, TIME), model.accelerations(*right, TIME))
