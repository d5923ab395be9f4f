"""What must hold whatever the numbers are: balances, invariances and limits of flexible bodies."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.reference import hinges
from tests.reference.compare import worst
from tests.reference.flexible import dense, random_beams
from tests.support.models import compile_scene, looped_model
from tests.support.scenes.flexible import Array, Scene, beam, hinge, scene

DOWN = (0.0, -9.81, 0.0)


def power(data: Scene, q: Array, u: Array, udot: Array) -> tuple[float, float]:
    """Rate of the reference's energy along the engine's motion, and of its kinetic part alone."""
    this, qdot = dense.system(data), np.zeros_like(q)
    tree = this.tree
    for one in tree.hinges:
        own = u[one.u]
        qdot[one.q] = hinges.coordinate_jet(one, q[one.q], own, 0 * own).dx
    qdot[tree.nq :] = u[tree.nu :]

    def rate(with_rates: float) -> float:
        def energy(h: float) -> float:
            return dense.energy(this, q + h * with_rates * qdot, u + h * udot)

        h = 1e-4
        return (8 * (energy(h) - energy(-h)) - energy(2 * h) + energy(-2 * h)) / (12 * h)

    return rate(1.0), rate(0.0)


@pytest.mark.parametrize("slope", (0.05, 0.2))
def test_spatial_power_balance(slope: float) -> None:
    """A ball-hinged beam with a beam and a body on sections that turn by `slope` and more: what the
    motion takes from one form of energy it gives to another, to 1e-8."""
    rng = np.random.default_rng(8)
    worst_share = 0.0
    for frame in ("tangent", "chord", "mean"):
        texts = {"y": ["(0.5)*x^2"], "z": ["(0.4)*x^2"], "twist": ["(1.0)*x^1"]}
        own: dict[str, Any] = {
            "shapes": texts, "modes": {"y": 1, "z": 1, "twist": 1}, "torsional_stiffness": 20.0,
            "polar_inertia_per_length": 0.02, "frame": frame, "basis": "auto",
        }  # fmt: skip
        data = scene(
            beam("first", 1.0, [30.0, 50.0], **own),
            beam("second", 0.8, [30.0, 50.0], **own),
            {"name": "load", "mass": 0.7, "inertia": [0.02, 0.03, 0.04]},
            hinge("hand", "ball", "ground", "first"),
            hinge("elbow", "universal", "first.tip", "second", axis=[0, 1, 0], axis2=[0, 0, 1]),
            hinge("grip", "ball", "second.tip", "load"),
            gravity=DOWN,
        )
        q, u = random_beams.random_state(data, 4, size=0.0)
        q[-6:] = slope * np.array([1.0, -1.1, 0.8, -0.9, 1.2, 1.0])
        u = rng.uniform(-1, 1, len(u))
        udot = looped_model(data).accelerations(q, u)
        whole, kinetic = power(data, q, u, udot)
        worst_share = max(worst_share, abs(whole / kinetic))
    assert worst_share < 1e-8


@pytest.mark.parametrize("frame", ("chord", "mean"))
def test_energy_of_a_flexible_pendulum_in_space(frame: str) -> None:
    """Two seconds of a whirling beam on a ball that carries a body: no drift."""
    data = scene(
        beam(
            "rod", 1.0, [0.8, 1.0], modes={"y": 2, "z": 2, "twist": 1}, frame=frame,
            basis="auto", torsional_stiffness=5.0, polar_inertia_per_length=0.01,
        ),
        {"name": "bob", "mass": 0.3, "inertia": [0.01, 0.02, 0.02]},
        hinge("hand", "ball", "ground", "rod", initial={"u": [0.5, 3.0, 2.0]}),
        hinge("knot", "ball", "rod.tip", "bob"),
        gravity=DOWN,
    )  # fmt: skip
    result = looped_model(data).simulate(2.0, rtol=1e-10, atol=1e-13)
    assert result.success, result.message
    energy = np.asarray(result.energy())
    slope = np.abs(result.slope("rod", "tip")).max()
    assert slope > 0.1
    assert np.ptp(energy) < 1e-10 * abs(energy[0])


def test_stiff_beams_tend_to_rigid_ones_as_one_over_their_stiffness() -> None:
    """The distance to the rigid trajectory falls tenfold with each tenfold stiffness."""
    rigid = scene(
        {"name": "rod", "mass": 1.0, "center_of_mass": [0.5, 0, 0], "ends": {"tip": [1, 0, 0]},
         "inertia": [1e-6, 1 / 12, 1 / 12]},
        hinge("pin", "pin", "ground", "rod"),
        gravity=DOWN,
    )  # fmt: skip
    times = np.linspace(0.0, 1.0, 51)
    settings: dict[str, Any] = {"output_times": times, "rtol": 1e-11, "atol": 1e-13}
    exact = looped_model(rigid).simulate(1.0, **settings).position("rod.tip")
    apart = []
    for stiffness in (1e2, 1e3, 1e4):
        data = scene(
            beam("rod", 1.0, stiffness, modes={"y": 1}, frame="chord", basis="simply-supported"),
            hinge("pin", "pin", "ground", "rod"),
            gravity=DOWN,
        )
        found = looped_model(data).simulate(1.0, **settings)
        apart.append(np.abs(found.position("rod.tip") - exact).max())
    assert apart[0] < 2e-3
    assert abs(apart[0] / apart[1] - 10) < 2
    assert abs(apart[1] / apart[2] - 10) < 2


def two_link_arm(modes: dict[str, int], turned: bool) -> Scene:
    """Two beams on pins about z, or about -y, everything turned with them, gravity too."""
    axis, down = ([0, -1, 0], [0, 0, -9.81]) if turned else ([0, 0, 1], list(DOWN))
    own: dict[str, Any] = {"modes": modes, "frame": "chord", "basis": "simply-supported"}
    return scene(
        beam("upper", 0.6, [8.0, 8.0], polar_inertia_per_length=1e-3, **own),
        beam("lower", 0.5, [8.0, 8.0], polar_inertia_per_length=1e-3, **own),
        hinge("shoulder", "pin", "ground", "upper", axis=axis),
        hinge("elbow", "pin", "upper.tip", "lower", axis=axis, initial={"u": [1.0]}),
        gravity=down,
    )


def test_a_plane_motion_is_the_same_in_space_and_in_any_plane() -> None:
    times = np.linspace(0.0, 1.0, 11)
    settings: dict[str, Any] = {"output_times": times, "rtol": 1e-11, "atol": 1e-13}
    flat = (
        looped_model(two_link_arm({"y": 2}, False)).simulate(1.0, **settings).position("lower.tip")
    )
    spatial = looped_model(two_link_arm({"y": 2, "z": 2}, False)).simulate(1.0, **settings)
    assert np.abs(spatial.position("lower.tip") - flat).max() < 1e-9
    assert np.abs(spatial.position("lower.tip")[:, 2]).max() == 0.0
    turned = looped_model(two_link_arm({"z": 2}, True)).simulate(1.0, **settings)
    x, y, z = turned.position("lower.tip").T
    assert np.abs(np.array([x, z, y]).T - flat).max() < 1e-9


def apart_in_frames(kind: str, stiffness: float, count: int) -> float:
    """Distance between the tips of a falling beam in three floating frames with one space of
    shapes: powers of x, of which a frame takes off nothing but a rigid motion."""
    tips = []
    for frame in ("chord", "mean", "tangent"):
        texts = {"y": [f"x^{k}" for k in range(2, 2 + count)]}
        own: dict[str, Any] = {"shapes": texts, "modes": {"y": count}, "basis": "auto"}
        body = beam("rod", 1.0, stiffness, frame=frame, **own)
        data = scene(body, hinge("root", kind, "ground", "rod"), gravity=DOWN)
        times = np.linspace(0.0, 0.5, 26)
        result = looped_model(data).simulate(0.5, output_times=times, rtol=1e-10, atol=1e-12)
        assert result.success, result.message
        tips.append(result.position("rod.tip"))
    return max(float(np.abs(tip - tips[0]).max()) for tip in tips)


@pytest.mark.parametrize(("kind", "bound"), [("pin", 2e-5), ("fixed", 1.4e-3)])
def test_frames_give_one_converged_motion(kind: str, bound: float) -> None:
    """What is left between frames is of third order in the deflection, and no matter of shapes."""
    soft = [apart_in_frames(kind, 20.0, count) for count in (2, 4)]
    assert max(soft) < bound
    stiff = [apart_in_frames(kind, 200.0, count) for count in (2, 3)]
    assert 150 * max(stiff) < max(soft)


def test_fused_is_looped() -> None:
    data = two_link_arm({"y": 2, "z": 1}, False)
    q, u = some_state(data)
    looped, fused = (
        compile_scene(data, engine).accelerations(q, u) for engine in ("looped", "fused")
    )
    assert worst(fused, looped) < 1e-13


def some_state(data: Scene) -> tuple[Array, Array]:
    model, rng = looped_model(data), np.random.default_rng(3)
    q, u = model.initial_state()
    return q + rng.uniform(-0.05, 0.05, len(q)), rng.uniform(-1, 1, len(u))


def test_quadrature_differs_in_third_order_alone() -> None:
    """Halving the deflection divides the difference of the accelerations by four to eight, and the
    quadrature is that of the particles with the whole field."""
    texts = {"y": ["(1.0)*x^2", "(0.5)*x^2 + (-0.3)*x^3"]}
    own: dict[str, Any] = {"shapes": texts, "modes": {"y": 2}, "basis": "auto"}
    forms = []
    for quadrature in (False, True):
        body = beam("rod", 1.0, 20.0, **own) | {"quadrature": quadrature}
        data = scene(body, hinge("pin", "pin", "ground", "rod"), gravity=DOWN)
        forms.append((data, looped_model(data)))
    apart = []
    for size in (0.02, 0.01, 0.005):
        q, u = np.array([0.4, size, -0.7 * size]), np.array([1.5, 8 * size, 3 * size])
        cut, whole = (model.accelerations(q, u) for _, model in forms)
        particles = dense.solve(forms[1][0], q, u, lagrangian=False).udot
        assert worst(whole, particles) < 1e-9
        apart.append(np.abs(cut - whole).max())
    for ratio in (apart[0] / apart[1], apart[1] / apart[2]):
        assert 3.9 < ratio < 8.1


def test_static_start_under_weight_and_under_the_same_load_per_length() -> None:
    """w L^4 / (8 EI) at the tip, and nothing moves."""
    weight, stiffness = 9.81, 2000.0
    clamp = hinge("clamp", "fixed", "ground", "shelf")
    body = beam("shelf", 1.0, stiffness, modes={"y": 4}, initial="static")
    for data in (
        scene(body, clamp, gravity=DOWN),
        scene(body, clamp, load=[{"on": "shelf", "force_per_length": [0.0, -weight, 0.0]}]),
    ):
        result = looped_model(data).simulate(0.2, rtol=1e-10)
        sag = result.position("shelf.tip")[:, 1]
        assert abs(sag[0] * 8 * stiffness / weight + 1) < 2e-4
        assert np.ptp(sag) < 1e-9


def test_drag_slows_a_sliding_beam() -> None:
    """Across its axis at u = u0 exp(-c t / rho A)."""
    data = scene(
        beam("plank", 1.0, 50.0, modes={"y": 2}, frame="mean", basis="free-free", viscous_drag=0.7),
        hinge("slide", "prismatic", "ground", "plank", axis=[0, 1, 0], initial={"u": [2.0]}),
    )
    result = looped_model(data).simulate(1.5, rtol=1e-10)
    assert abs(result.velocity("plank")[-1, 1] - 2 * np.exp(-1.05)) < 1e-8


def test_work_of_everything_that_is_not_stored() -> None:
    """Damping, drag, a follower force, a load per length and a drive: energy less their work is
    constant."""
    data = scene(
        beam(
            "arm", 1.0, [6.0, 8.0], modes={"y": 2, "z": 1, "twist": 1}, basis="auto",
            torsional_stiffness=5.0, polar_inertia_per_length=0.01, viscous_drag=0.3,
            damping={"stiffness": 0.002},
        ),
        beam(
            "hand", 0.6, 5.0, modes={"y": 2, "z": 1}, frame="chord", basis="auto", damping=0.01,
            polar_inertia_per_length=0.01,
        ),
        hinge("shoulder", "pin", "ground", "arm", axis=[0, 1, 1], drive="0.8*sin(3*t)"),
        hinge("wrist", "universal", "arm.tip", "hand", axis=[0, 0, 1], axis2=[0, 1, 0],
              law={"stiffness": [1.0, 1.0], "damping": [0.05, 0.05]}),
        gravity=DOWN,
        load=[
            {"on": "hand.tip", "force": [0.5, "sin(4*t)", 0.3], "axes": "body"},
            {"on": "arm", "force_per_length": [0.0, 0.4, 0.2], "span": [0.3, 0.9]},
        ],
    )  # fmt: skip
    result = looped_model(data).simulate(1.0, rtol=1e-10, atol=1e-13)
    assert result.success, result.message
    balance = np.asarray(result.energy()) - result.work
    assert np.ptp(result.work) > 0.1
    assert np.ptp(balance) < 1e-8 * np.ptp(result.work)
