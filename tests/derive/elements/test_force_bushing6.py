"""Bushings against closed forms, and against a potential that SciPy's rotations give."""

from __future__ import annotations

import copy
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation

import mstmm
from mstmm.array_validation import Array
from tests.support.scenes.linkages import four_bar

Data = dict[str, Any]

MASS, MOMENTS = 2.0, (0.1, 0.2, 0.3)
STILL = [0.0, 0, 0, 1, 0, 0, 0]
DIAGONAL = [1000.0, 2000, 3000, 10, 20, 30]
#: Fixed draws: two symmetric matrices without negative eigenvalues.
_DRAWN = np.random.default_rng(7).standard_normal((2, 6, 6))
STIFFNESS, DAMPING = (50 * m @ m.T for m in _DRAWN)


def free_body(name: str, **more: Any) -> Data:
    return {"name": name, "mass": MASS, "inertia": [*MOMENTS], **more}


def floating(name: str) -> Data:
    return {"name": f"{name}_hinge", "type": "free", "inboard": "ground", "outboard": name}


def grounded_model(**bushing: Any) -> mstmm.Model:
    """A body on a bushing to the ground."""
    return mstmm.compile(
        mstmm.Scene(
            gravity=[0, 0, 0], body=[free_body("block")], hinge=[floating("block")],
            bushing=[{"name": "mount", "from": "ground", "to": "block", **bushing}],
        )
    )  # fmt: skip


@pytest.mark.parametrize("stiffness", [DIAGONAL, STIFFNESS.tolist()])
def test_six_frequencies(stiffness: Any) -> None:
    """omega^2 of K - omega^2 M with both matrices at the mass centre."""
    model = grounded_model(stiffness=stiffness)
    found = np.sort(model.linearize(q=STILL, u=np.zeros(6)).modes().omega)
    matrix = np.diag(stiffness) if np.ndim(stiffness) == 1 else np.array(stiffness)
    known = np.sqrt(eigh(matrix, np.diag([MASS] * 3 + [*MOMENTS]), eigvals_only=True))
    np.testing.assert_allclose(found, known, rtol=1e-9)


def test_large_turn_about_one_axis() -> None:
    """Its moment is stiffness times angle: J a'' + c a' + k a = 0 up to 2.9 rad."""
    k, c, start = 30.0, 0.4, 2.9
    model = grounded_model(stiffness=DIAGONAL, damping=[0, 0, 0, 0, 0, c])
    q = [0.0, 0, 0, np.cos(start / 2), 0, 0, np.sin(start / 2)]
    times = np.linspace(0, 2, 21)
    result = model.simulate(2.0, rtol=1e-11, atol=1e-12, initial=(q, np.zeros(6)),
                            output_times=times)  # fmt: skip
    decay, omega = c / 2 / MOMENTS[2], np.sqrt(k / MOMENTS[2] - (c / 2 / MOMENTS[2]) ** 2)
    known = start * np.exp(-decay * times)
    known *= np.cos(omega * times) + decay / omega * np.sin(omega * times)
    np.testing.assert_allclose(result.quantity("mount.turn.z").values, known, atol=1e-8)
    rate = np.gradient(known, times)  # of the damper's share a rough measure is enough
    moment = result.quantity("mount.mz").values
    np.testing.assert_allclose(moment[2:-2], (-k * known - c * rate)[2:-2], atol=0.1 * k)


BETWEEN: Data = {
    "name": "mount", "from": "one.side", "to": "two.side", "orientation": [0.3, -0.2, 0.5],
    "rest": {"position": [0.1, -0.2, 0.05], "orientation": [-0.4, 0.1, 0.2]},
    "stiffness": STIFFNESS.tolist(), "damping": DAMPING.tolist(),
    "preload": [3.0, -2, 1, 0.5, 0.2, -0.7],
}  # fmt: skip
SIDES = {"one": ([0.2, 0.1, -0.3], [0.1, 0.7, -0.3]), "two": ([-0.4, 0.2, 0.1], [0.5, -0.1, 0.2])}


@cache
def pair() -> mstmm.Scene:
    """Two free bodies with a bushing between ends that have axes of their own."""
    bodies = [
        free_body(name, ends={"side": {"position": place, "orientation": turn}})
        for name, (place, turn) in SIDES.items()
    ]
    return mstmm.Scene(
        gravity=[0, 0, 0], body=bodies, hinge=[floating(name) for name in SIDES],
        bushing=[BETWEEN],
    )  # fmt: skip


def _rpy(angles: list[float]) -> Rotation:
    return Rotation.from_euler("xyz", angles)


Pose = tuple[Array, Rotation]


def deflection(one: Pose, two: Pose) -> Array:
    """[x; rotation vector] of the end `to` from rest, in the bushing's axes."""
    (x_f, a_f), (x_t, a_t) = (
        (place + turn.apply(SIDES[name][0]), turn * _rpy(SIDES[name][1]))
        for name, (place, turn) in (("one", one), ("two", two))
    )
    axes = a_f * _rpy(BETWEEN["orientation"])
    rest = BETWEEN["rest"]
    x = axes.inv().apply(x_t - x_f) - np.array(rest["position"])
    turned = axes.inv() * a_t * _rpy(rest["orientation"]).inv()
    return np.concatenate([x, turned.as_rotvec()])


def potential(one: Pose, two: Pose) -> float:
    bent = deflection(one, two)
    return float(bent @ STIFFNESS @ bent / 2 - bent @ np.array(BETWEEN["preload"]))


def displaced_pose(pose: Pose, k: int, by: float) -> Pose:
    """The pose moved by `by` along or about its own axis k."""
    unit = by * np.eye(3)[k % 3]
    place, turn = pose
    if k < 3:
        return place + turn.apply(unit), turn
    return place, turn * Rotation.from_rotvec(unit)


def difference(f: Callable[[float], Any], h: float = 1e-3) -> Any:
    """Derivative at 0 of order 6."""
    return sum(
        w * (f(k * h) - f(-k * h)) for k, w in ((1, 45 / 60), (2, -9 / 60), (3, 1 / 60))
    ) / h  # fmt: skip


def accelerations(q: Array, u: Array) -> Array:
    """Of both bodies: Newton and Euler in their own axes, under slopes of the potential and of
    Rayleigh's function."""
    poses = [
        (q[7 * i : 7 * i + 3], Rotation.from_quat(np.roll(q[7 * i + 3 : 7 * i + 7], -1)))
        for i in range(2)
    ]

    def displaced_poses(i: int, k: int, by: float) -> list[Pose]:
        return [displaced_pose(pose, k, by) if i == j else pose for j, pose in enumerate(poses)]

    def unit_speed_rates(i: int, k: int) -> Array:
        """Rate of x and relative angular velocity in the bushing's axes for a unit speed."""
        rate: Array = difference(lambda h: deflection(*displaced_poses(i, k, h)))[:3]
        axes = poses[0][1] * _rpy(SIDES["one"][1]) * _rpy(BETWEEN["orientation"])
        spin = poses[i][1].apply(np.eye(3)[k - 3]) if k >= 3 else np.zeros(3)
        return np.concatenate([rate, axes.inv().apply(spin if i else -spin)])

    ways = np.array([unit_speed_rates(i, k) for i in range(2) for k in range(6)])

    def pull(i: int, k: int) -> float:
        return -float(difference(lambda h: potential(*displaced_poses(i, k, h))))

    pulls = [pull(i, k) for i in range(2) for k in range(6)]
    load = (np.array(pulls) - ways @ DAMPING @ (ways.T @ u)).reshape(2, 2, 3)
    found = []
    for (v, w), (force, moment) in zip(u.reshape(2, 2, 3), load, strict=True):
        spin = np.array(MOMENTS) * w
        found += [force / MASS - np.cross(w, v), (moment - np.cross(w, spin)) / MOMENTS]
    return np.concatenate(found)


@pytest.mark.parametrize("engine", ["looped", "fused"])
def test_loads_on_both_bodies_are_those_of_the_potential(engine: str) -> None:
    model, numbers = mstmm.compile(pair(), engine=engine), np.random.default_rng(11)
    for _ in range(8):
        q, u = numbers.uniform(-1, 1, 14), numbers.uniform(-1, 1, 12)
        for i in (3, 10):
            q[i : i + 4] /= np.linalg.norm(q[i : i + 4])
        poses = [(q[i : i + 3], Rotation.from_quat(np.roll(q[i + 3 : i + 7], -1))) for i in (0, 7)]
        if np.linalg.norm(deflection(*poses)[3:]) > 2.9:
            continue
        known = accelerations(q, u)
        size = np.abs(known).max()
        np.testing.assert_allclose(model.accelerations(q, u), known, atol=2e-9 * size)


def test_energy_work_and_momenta_of_a_large_motion() -> None:
    """Loads are internal, and what dampers take is what is missing."""
    model = mstmm.compile(pair())
    u = np.array([0.5, -1, 0, 0.3, 2, -1, 0, 1, 0.5, -3, 0.5, 1])
    start, times = (np.array(STILL * 2), u), np.linspace(0, 1, 21)
    result = model.simulate(1.0, rtol=1e-10, atol=1e-11, initial=start, output_times=times)
    balance = result.energy() - result.work
    assert np.ptp(result.energy()) > 10
    np.testing.assert_allclose(balance, balance[0], atol=2e-7)
    for kept in (result.momentum(), result.angular_momentum()):
        np.testing.assert_allclose(kept, np.tile(kept[0], (21, 1)), atol=1e-8)
    undamped = model.with_parameters({f"mount.damping[{k}]": 0.0 for k in range(21)})
    result = undamped.simulate(1.0, rtol=1e-11, atol=1e-12, initial=start)
    np.testing.assert_allclose(result.energy(), result.energy()[0], atol=1e-7)
    assert np.linalg.norm(result.quantity("mount.turn").values, axis=1).max() > 0.5


def test_slopes_of_a_turned_bushing() -> None:
    """Stiffness and damping matrices of a linear model against differences of accelerations."""
    model = mstmm.compile(pair())
    q, u = np.array([0.1, 0.2, 0, 0.8, 0.6, 0, 0, 0, 0.3, 0, 0.96, 0, 0.28, 0]), np.zeros(12)
    linear = model.linearize(q=q, u=u)

    def displaced_state(k: int, h: float) -> Array:
        """The state with a step along speed k, in axes of its own body."""
        i, own = divmod(k, 6)
        pose = (q[7 * i : 7 * i + 3], Rotation.from_quat(np.roll(q[7 * i + 3 : 7 * i + 7], -1)))
        place, turn = displaced_pose(pose, own, h)
        return np.concatenate([q[: 7 * i], place, np.roll(turn.as_quat(), 1), q[7 * i + 7 :]])

    mass = np.array(([MASS] * 3 + [*MOMENTS]) * 2)

    def columns(k: int) -> tuple[Array, Array]:
        pulls = difference(lambda h: accelerations(displaced_state(k, h), u))
        damps = difference(lambda h: accelerations(q, u + h * np.eye(12)[k]))
        return -mass * pulls, -mass * damps

    for k in (3, 8, 11):
        for found, known in zip((linear.K[:, k], linear.C[:, k]), columns(k), strict=True):
            np.testing.assert_allclose(found, known, atol=1e-6 * np.abs(known).max())


def test_a_stiff_method_takes_long_steps() -> None:
    """The slopes serve implicit methods: a mount that is far faster than the motion."""
    model = grounded_model(stiffness=[1e8] * 3 + [10.0, 10, 10], damping=[1e6] * 3 + [1.0] * 3)
    start = (STILL, [0.0, 0, 0, 1, 0, 0])
    runs = [model.simulate(0.3, method=m, rtol=1e-8, atol=1e-10, initial=start)
            for m in ("rodas5p", "dop853")]  # fmt: skip
    for run in runs:
        assert run.success
    stiff, plain = runs
    assert stiff.q[-1] == pytest.approx(plain.q[-1], abs=1e-6)


def test_turned_too_far() -> None:
    model = grounded_model(stiffness=[1.0] * 6)
    start = (STILL, [0.0, 0, 0, 0, 0, 30.0])
    result = model.simulate(1.0, initial=start)
    assert not result.success
    assert 'bushing "mount"' in result.message
    assert "rotated by more than 170 degrees from rest" in result.message


def test_loss_factor() -> None:
    """x = 1 / (k (1 + i eta) - omega^2 m), about a place where the mount is bent."""
    k, eta, omega = DIAGONAL[0], 0.07, np.array([3.0, np.sqrt(DIAGONAL[0] / MASS), 90.0])
    model = grounded_model(stiffness=DIAGONAL, preload=[50.0, 0, 0, 0, 0, 0])
    found = model.frequency_response(
        omega, ["block.fx"], ["block.position.x"], structural={"mount": eta}
    )
    known = 1 / (k * (1 + 1j * eta) - omega**2 * MASS)
    np.testing.assert_allclose(found.response[:, 0, 0], known, rtol=1e-9)


def test_as_the_hinge_that_closes_a_loop() -> None:
    """A four-bar with a stiff bushing in place of a pin moves as the one with the pin, but for what
    the bushing gives by; in the plane it leaves the turn about z free."""
    closed = four_bar()
    tree = copy.deepcopy(closed)
    (hinge,) = (one for one in tree["hinge"] if one["name"] == "tip")
    tree["hinge"].remove(hinge)
    k, c = 1e7, 2e3
    tree["bushing"] = [
        {
            "name": "rubber",
            "from": hinge["inboard"],
            "to": hinge["outboard"],
            "stiffness": [k, k, 0, 0, 0, 0],
            "damping": [c, c, 0, 0, 0, 0],
        }
    ]
    rigid, soft = (
        mstmm.compile(mstmm.Scene(**one)).simulate(0.5, rtol=1e-9, atol=1e-11)
        for one in (closed, tree)
    )
    assert soft.coordinates("foot")[-1] == pytest.approx(rigid.coordinates("foot")[-1], abs=2e-5)
    known = rigid.force("tip")[-1]
    assert np.linalg.norm(known) > 1
    assert soft.quantity("rubber.force").values[-1] == pytest.approx(known, abs=2e-2)
    give = soft.certificate.spring_deflection
    assert give is not None
    assert (give.spring, give.stiffness) == ('bushing "rubber"', k)


def test_at_the_end_of_a_beam() -> None:
    """A cantilever on a spring and a torsional spring at its tip, by the stiffness of its end."""
    length, ei, k, turning = 2.0, 30.0, 8.0, 5.0
    model = mstmm.compile(
        mstmm.Scene(
            gravity=[0, 0, 0],
            beam=[{"name": "blade", "length": length, "mass_per_length": 1.0,
                   "bending_stiffness": ei, "basis": "static+fixed-interface"}],
            hinge=[{"name": "root", "type": "fixed", "inboard": "ground", "outboard": "blade"}],
            bushing=[{"name": "mount", "from": "blade.tip", "to": "ground",
                      "position": [length, 0, 0], "stiffness": [0, k, 0, 0, 0, turning]}],
        )
    )  # fmt: skip
    found = model.frequency_response([1e-7], ["blade.tip.fy"], ["blade.tip.y"]).response[0, 0, 0]
    own = ei * np.array([[12 / length**3, -6 / length**2], [-6 / length**2, 4 / length]])
    known = np.linalg.inv(own + np.diag([k, turning]))[0, 0]
    assert found.real == pytest.approx(known, rel=1e-8)
