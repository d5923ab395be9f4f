"""What a model says of points, sums and efforts at states, against dense Newton-Euler equations."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm import SceneError
from tests.reference import newton_euler
from tests.reference.compare import Drawn, fresh, worst
from tests.reference.tree import read
from tests.support.draws import draws

BEAM = {
    "name": "blade",
    "length": 2.0,
    "mass_per_length": 1.0,
    "bending_stiffness": 20.0,
    "modes": 2,
}
ROD: dict[str, Any] = {
    "mass": 1.2, "center_of_mass": [0.5, 0.1, 0], "inertia": [0.02, 0.08, 0.09],
    "ends": {"tip": [1, 0, 0]},
}  # fmt: skip


def random_kinematic_scene(rng: np.random.Generator) -> Drawn:
    return fresh(rng, laws=False, loads=False)


def points_of(scene: dict[str, Any]) -> list[str]:
    """All bodies and ends."""
    bodies = scene["body"]
    return [
        f"{one['name']}{end}" for one in bodies for end in ("", *(f".{x}" for x in one["ends"]))
    ]


def velocities(scene: dict[str, Any], q: Any, u: Any) -> Any:
    """Of all of them, by the reference."""
    tree, at = read(scene), newton_euler.motion(scene, q, u)
    rows = []
    for name in points_of(scene):
        number, place, _ = tree.end(name)
        rows.append([*at.velocity(number, place), *at.w[number]])
    return np.array(rows)


def jacobian(scene: dict[str, Any], q: Any, nu: int) -> Any:
    return np.stack([velocities(scene, q, unit) for unit in np.eye(nu)], axis=-1)


@pytest.mark.parametrize("_", draws(4, 12))
def test_places_velocities_and_jacobians(_: int, rng: np.random.Generator) -> None:
    scene, q, u = random_kinematic_scene(rng)
    model, names, tree = mstmm.compile(mstmm.Scene(**scene)), points_of(scene), read(scene)
    at = newton_euler.motion(scene, q, u)
    poses = model.poses(q, names)
    for name, pose in zip(names, poses, strict=True):
        number, place, turn = tree.end(name)
        assert pose[:3, 3] == pytest.approx(at.point(number, place), abs=1e-12)
        assert pose[:3, :3] == pytest.approx(at.A[number] @ turn, abs=1e-12)
    assert np.array_equal(model.positions(q, names), poses[:, :3, 3])
    assert worst(model.velocities(q, u, names), velocities(scene, q, u), 1.0) < 1e-12
    assert worst(model.jacobian(q, names), jacobian(scene, q, model.nu), 1.0) < 1e-12


@pytest.mark.parametrize("_", draws(4, 12))
def test_the_rate_of_jacobians(_: int, rng: np.random.Generator) -> None:
    """Its product with the speeds as the reference has it, each column by its differences."""
    scene, q, u = random_kinematic_scene(rng)
    model, names, tree = mstmm.compile(mstmm.Scene(**scene)), points_of(scene), read(scene)
    rate, udot = model.jacobian_rate(q, u, names), rng.uniform(-1, 1, model.nu)
    solved, at = newton_euler.solve(scene, q, u, udot=udot), newton_euler.motion(scene, q, u)
    found = model.jacobian(q, names) @ udot + rate @ u
    for name, (ax, ay, az, *turn) in zip(names, found, strict=True):
        number, place, *_axes = tree.end(name)
        arm = at.A[number] @ (place - tree.bodies[number].center)
        spin, angular = at.w[number], solved.angular[number]
        about = np.cross(angular, arm) + np.cross(spin, np.cross(spin, arm))
        assert [ax, ay, az] == pytest.approx(solved.center[number] + about, rel=1e-10, abs=1e-10)
        assert turn == pytest.approx(angular, rel=1e-10, abs=1e-10)
    h, along = 1e-5, newton_euler.coordinate_rates(scene, q, u)
    ahead, behind = (jacobian(scene, q + way * along, model.nu) for way in (h, -h))
    assert worst(rate, (ahead - behind) / (2 * h), 1.0) < 1e-7


@pytest.mark.parametrize("_", draws(4, 12))
def test_energy_momentum_and_what_holds_against_gravity(_: int, rng: np.random.Generator) -> None:
    scene, q, u = fresh(rng)
    model, tree = mstmm.compile(mstmm.Scene(**scene)), read(scene)
    energy = newton_euler.energy(scene, q, u)
    parts = model.energy_components(q, u)
    assert model.energy(q, u) == pytest.approx(energy, rel=1e-11, abs=1e-11)
    assert np.sum([*parts.values()]) == pytest.approx(energy, rel=1e-11, abs=1e-11)
    momenta = np.concatenate(newton_euler.momentum(scene, q, u))
    assert worst(model.momentum(q, u), momenta, 1.0) < 1e-11
    solved = newton_euler.solve(scene, q, u)
    left = model.mass_matrix(q) @ solved.udot + model.bias_efforts(q, u)
    assert np.abs(left).max(initial=0.0) < 1e-9 * max(1.0, np.abs(solved.udot).max(initial=0.0))
    units = [newton_euler.motion(scene, q, unit) for unit in np.eye(model.nu)]
    wanted = [-sum(body.mass * tree.gravity @ at.velocity(i, body.center)
                   for i, body in enumerate(tree.bodies)) for at in units]  # fmt: skip
    assert worst(model.gravity_efforts(q), wanted, 1.0) < 1e-11


def test_coordinates_go_on_at_steady_speeds() -> None:
    """A pin by its angle, a ball by the turn about its axis (E. Rodrigues)."""
    hinges = [{"name": "ball", "type": "ball", "inboard": "ground", "outboard": "a"},
              {"name": "pin", "type": "pin", "inboard": "a.tip", "outboard": "b"}]  # fmt: skip
    bodies = [ROD | {"name": name} for name in "ab"]
    model = mstmm.compile(mstmm.Scene(gravity=[0, 0, 0], body=bodies, hinge=hinges))
    spin, dt = np.array([0.3, -0.4, 1.2]), 0.7
    half = np.linalg.norm(spin) * dt / 2
    found = model.integrate([2.0, 0, 0, 0, 0.5], [*spin, 2.0], dt)
    turn = np.sin(half) * spin / np.linalg.norm(spin)
    assert found == pytest.approx([np.cos(half), *turn, 1.9], rel=1e-15)
    assert model.integrate([1.0, 0, 0, 0, 0.5], np.zeros(4), dt) == pytest.approx([1, 0, 0, 0, 0.5])
    many = model.integrate(np.tile([1.0, 0, 0, 0, 0.5], (3, 1)), [*spin, 2.0], [0, dt, 2 * dt])
    assert many[1] == pytest.approx(found, rel=1e-15) and many.shape == (3, 5)


def test_points_of_bent_bodies_move_as_in_a_run(rng: np.random.Generator) -> None:
    pin = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "blade"}
    end = {"name": "end", "type": "ball", "inboard": "blade.tip", "outboard": "rod"}
    model = mstmm.compile(mstmm.Scene(
        gravity=[0, -9.81, 0], beam=[BEAM], body=[ROD | {"name": "rod"}], hinge=[pin, end]
    ))  # fmt: skip
    q, u = 0.05 * rng.uniform(-1, 1, model.nq), rng.uniform(-1, 1, model.nu)
    q[1:5] = [0.5, 0.5, -0.5, 0.5]
    run, names = model.simulate(0.0, initial=(q, u)), ["rod.tip", "blade.tip"]
    jacobian, rate = model.jacobian(q, names), model.jacobian_rate(q, u, names)
    moved = jacobian @ run.udot[0] + rate @ u
    for name, place, speed, change in zip(
        names, model.positions(q, names), jacobian @ u, moved, strict=True
    ):
        assert place == pytest.approx(run.position(name)[0], abs=1e-13)
        wanted = [*run.velocity(name)[0], *run.angular_velocity(name)[0]]
        assert speed == pytest.approx(wanted, rel=1e-11, abs=1e-11)
        wanted = [*run.acceleration(name)[0], *run.angular_acceleration(name)[0]]
        assert change == pytest.approx(wanted, rel=1e-9, abs=1e-9)
    rise = [model.energy_components(model.integrate(q, unit, way), np.zeros(model.nu))["gravity"]
            for unit in np.eye(model.nu) for way in (1e-5, -1e-5)]  # fmt: skip
    slopes = np.subtract(rise[::2], rise[1::2]) / 2e-5
    assert model.gravity_efforts(q) == pytest.approx(slopes, rel=1e-6, abs=1e-6)


def test_efforts_of_mechanisms_are_those_of_their_motions() -> None:
    """A rod held at both ends by arms of equal length: the weight's arm by hand."""
    arm = ROD | {"mass": 1.0, "center_of_mass": [0.5, 0, 0]}
    pins = [("a", "ground", "left", 0.5), ("b", "left.tip", "rod", -0.5),
            ("c", "ground", "right", 0.5), ("d", "right.tip", "rod.tip", None)]  # fmt: skip
    hinges = [
        {"name": name, "type": "pin", "inboard": inboard, "outboard": outboard}
        | ({} if angle is None else {"initial": {"q": [angle]}})
        | ({"position": [1, 0, 0]} if name == "c" else {})
        for name, inboard, outboard, angle in pins
    ]
    bodies = [arm | {"name": name} for name in ("left", "rod", "right")]
    model = mstmm.compile(mstmm.Scene(gravity=[0, -10, 0], body=bodies, hinge=hinges))
    q, u = model.initial_state()
    (independent,) = model.loops.independent_speeds
    sign = 1.0 if independent.startswith(("a", "c")) else -1.0
    assert model.gravity_efforts(q) == pytest.approx([sign * 20 * np.cos(0.5)], rel=1e-10)
    assert model.bias_efforts(q, u) == pytest.approx(model.gravity_efforts(q), rel=1e-9)


CALLS: dict[str, Callable[..., Any]] = {
    "accelerations": lambda m, q, u, **o: m.accelerations(q, u, **o),
    "inverse_dynamics": lambda m, q, u, **o: m.inverse_dynamics(q, u, u, **o),
    "mass_matrix": lambda m, q, u, **o: m.mass_matrix(q, **o),
    "solve": lambda m, q, u, **o: m.solve(q, np.eye(m.nu), **o),
    "bias": lambda m, q, u, **o: m.bias_efforts(q, u, **o),
    "gravity_efforts": lambda m, q, u, **o: m.gravity_efforts(q, **o),
    "positions": lambda m, q, u, **o: m.positions(q, "b.tip", **o),
    "poses": lambda m, q, u, **o: m.poses(q, ("a", "b.tip"), **o),
    "velocities": lambda m, q, u, **o: m.velocities(q, u, "b.tip", **o),
    "jacobian": lambda m, q, u, **o: m.jacobian(q, ["a", "ground", "b.tip"], **o),
    "jacobian_rate": lambda m, q, u, **o: m.jacobian_rate(q, u, "b.tip", **o),
    "energy": lambda m, q, u, **o: m.energy(q, u, **o),
    "momentum": lambda m, q, u, **o: m.momentum(q, u, **o),
    "integrate": lambda m, q, u, **o: m.integrate(q, u, 0.1, **o),
}


@pytest.mark.parametrize("call", CALLS)
def test_every_call_takes_states_and_writes_where_it_is_told(
    call: str, rng: np.random.Generator
) -> None:
    bodies = [ROD | {"name": name} for name in "ab"]
    hinges = [{"name": "one", "type": "ball", "inboard": "ground", "outboard": "a"},
              {"name": "two", "type": "pin", "inboard": "a.tip", "outboard": "b"}]  # fmt: skip
    model = mstmm.compile(mstmm.Scene(gravity=[0, -9.81, 0], body=bodies, hinge=hinges))
    ask = CALLS[call]
    q, u = rng.uniform(-1, 1, (2, 3, model.nq)), rng.uniform(-1, 1, (2, 3, model.nu))
    many = ask(model, q, u)
    for at in np.ndindex(2, 3):
        alone = ask(model, q[at], u[at])
        assert many[at] == pytest.approx(alone, rel=1e-12, abs=1e-12)
        room = np.empty_like(alone)
        assert ask(model, q[at], u[at], out=room) is room and np.array_equal(room, alone)
    room = np.empty_like(many)
    assert ask(model, q, u, out=room) is room and np.array_equal(room, many)
    for wrong in (np.empty(many.shape[1:]), room.astype(np.float32), room.tolist()):
        with pytest.raises(SceneError, match="out: expected a writeable float64 array"):
            ask(model, q, u, out=wrong)
    room.flags.writeable = False
    with pytest.raises(SceneError, match="out: expected a writeable"):
        ask(model, q, u, out=room)
    for wrong in (q[..., :-1], q[..., None], "q"):
        with pytest.raises(SceneError, match=r"^q"):
            ask(model, wrong, u)


def test_what_there_is_not_is_named() -> None:
    pin = {"name": "one", "type": "pin", "inboard": "ground", "outboard": "a"}
    model = mstmm.compile(mstmm.Scene(gravity=[0, 0, 0], body=[ROD | {"name": "a"}], hinge=[pin]))
    with pytest.raises(SceneError, match=r'"a.tap": there is no such body or end .*a.tip'):
        model.positions([0.0], "a.tap")
    with pytest.raises(SceneError, match=r"of = \[3\]: expected a list of names"):
        model.jacobian([0.0], [3])  # type: ignore[list-item]
    with pytest.raises(SceneError, match=r"q\[0\] = nan"):
        model.poses(np.array([np.nan]), "a")
