"""Equilibria, linear models, mass matrices and efforts of what constraints close: closed forms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import mstmm
from tests.reference.compare import worst
from tests.reference.jets import Array
from tests.support.models import compile_scene
from tests.support.scenes.constraints import GRAVITY, MASS, RADIUS, Scene, bead, disc, governor

WIDTH = 0.7


def model_with_law(law: dict[str, Any], scene: Scene) -> mstmm.Model:
    """Model of the scene with a law on its only hinge."""
    scene["hinge"][0]["law"] = law
    return compile_scene(scene)


def on_a_parabola() -> mstmm.Model:
    """A bead of 0.3 kg on z = x^2 / 2a that a spring of 3 N m/rad keeps from turning."""
    scene = bead(("s", f"s^2/(2*{WIDTH})"), 0.3, (0.3, 0.3**2 / 2 / WIDTH))
    scene["hinge"][0] |= {"type": "planar", "orientation": [math.pi / 2, 0, 0],
                          "initial": {"q": [0.3, 0.3**2 / 2 / WIDTH, 0]}}  # fmt: skip
    return model_with_law({"stiffness": [0, 0, 3.0]}, scene)


def test_a_bead_on_a_parabola() -> None:
    """It rests at the bottom and swings there with sqrt(g / a)."""
    model = on_a_parabola()
    rest = model.equilibrium()
    assert np.abs(rest).max() < 1e-12
    assert model.modes().omega == pytest.approx([math.sqrt(GRAVITY / WIDTH), math.sqrt(30.0)])
    q, u = model.initial_state()
    slope = q[0] / WIDTH
    assert worst(model.mass_matrix(q), np.diag([0.3 * (1 + slope**2), 0.1])) < 1e-13
    needed = model.inverse_dynamics(q, u, np.zeros(2))
    assert needed[0] == pytest.approx(0.3 * GRAVITY * slope, rel=1e-12)


def test_a_bead_on_a_helix() -> None:
    """On a spring upwards it hangs m g / k deep; along the wire k c^2 / (r^2 + c^2) holds it."""
    scene = bead(("0.5*cos(s)", "0.2*s"), 0.0, (0.5, 0.0))
    scene["constraint"][0]["curve"][1] = "0.5*sin(s)"
    model = model_with_law({"stiffness": [0, 0, 50.0, 3.0, 3.0, 3.0]}, scene)
    rest = model.equilibrium()
    depth = 0.3 * GRAVITY / 50.0
    assert abs(rest[2] + depth) < 1e-12 and abs(rest[7] + depth / 0.2) < 1e-11
    lowest = math.sqrt(50.0 / 0.3 * 0.2**2 / (0.5**2 + 0.2**2))
    assert model.modes().omega == pytest.approx([lowest, *3 * [math.sqrt(30.0)]])


def test_a_bead_that_nothing_holds_on_a_helix() -> None:
    """It slides down for ever, and the message says along what."""
    scene = bead(("0.5*cos(s)", "0.2*s"), 0.0, (0.5, 0.0))
    scene["constraint"][0]["curve"][1] = "0.5*sin(s)"
    with pytest.raises(mstmm.NumericalFailure, match=r"equilibrium.* along at.vy"):
        compile_scene(scene).equilibrium()


def test_a_bob_on_a_distance() -> None:
    """A spherical pendulum: sqrt(g / l) both ways, while the bob turns freely."""
    free = {"name": "at", "type": "free", "inboard": "ground", "outboard": "bob",
            "initial": {"q": [0, 0, -0.8, 1, 0, 0, 0]}}  # fmt: skip
    model = compile_scene({
        "gravity": [0, 0, -GRAVITY], "hinge": [free],
        "body": [{"name": "bob", "mass": 0.5, "inertia": [0.1, 0.1, 0.1]}],
        "constraint": [{"name": "wire", "type": "distance", "from": "ground", "to": "bob",
                        "length": 0.8}],
    })  # fmt: skip
    q, _ = model.initial_state()
    found = model.linearize(q=q).modes().omega
    assert found == pytest.approx([0, 0, 0, *2 * [math.sqrt(GRAVITY / 0.8)]], abs=1e-6)


def test_a_ball_that_rolls_on_a_spring() -> None:
    """omega^2 = k / (m + I / r^2); pushed by a force, it follows as the closed form says."""
    free = {"name": "at", "type": "free", "inboard": "ground", "outboard": "ball",
            "initial": {"q": [0, 0, 0.2, 1, 0, 0, 0]}}  # fmt: skip
    spring = {"stiffness": [40.0, 10.0, 0.0, 0.0, 0.0, 0.0], "damping": [0.3, 0, 0, 0, 0, 0]}
    model = model_with_law(spring, {
        "gravity": [0, 0, -GRAVITY], "hinge": [free],
        "body": [{"name": "ball", "mass": 0.5, "inertia": [0.004, 0.004, 0.004]}],
        "constraint": [{"name": "table", "type": "rolling", "from": "ground", "to": "ball",
                        "normal": [0, 0, 1], "radius": 0.2}],
    })  # fmt: skip
    q, _ = model.initial_state()
    inertia = 0.5 + 0.004 / 0.2**2
    linear = model.linearize(q=q, inputs=["ball.fx"])
    wanted = [math.sqrt(10 / inertia), math.sqrt(40 / inertia)]
    assert linear.modes().omega[-2:] == pytest.approx(wanted, rel=1e-12)
    omega = np.array([2.0, 9.0])
    found = model.frequency_response(omega, inputs=["ball.fx"], outputs=["ball.position.x"])
    form = 1 / (40 - inertia * omega**2 + 0.3j * omega)
    assert np.abs(found.response[:, 0, 0] / form - 1).max() < 1e-12


def test_a_disc_that_stands() -> None:
    """It falls over with 4 g / 5 r, and nothing pushes back where it rolls or turns."""
    upright = np.array([0, 0, RADIUS, 1, 0, 0, 0.0])
    found = disc().linearize(q=upright).modes().eigenvalues
    fall = math.sqrt(4 * GRAVITY / (5 * RADIUS))
    assert max(found.real) == pytest.approx(fall, rel=1e-12)
    assert sorted(np.abs(found))[:-1] == pytest.approx([0, 0], abs=1e-6)


def test_a_disc_that_leans() -> None:
    """No rest is near: its weight pulls it over with m g r sin(lean), 0.2 rad off, or 0.8 N m."""
    free = {"name": "at", "type": "free", "inboard": "ground", "outboard": "disc",
            "initial": {"q": [0, 0, 0.2, 1, 0.1, 0, 0]}}  # fmt: skip
    leaning = compile_scene({
        "gravity": [0, 0, -GRAVITY], "hinge": [free],
        "body": [{"name": "disc", "mass": 2.0, "inertia": [0.02, 0.04, 0.02]}],
        "constraint": [{"name": "road", "type": "rolling", "from": "ground", "to": "disc",
                        "normal": [0, 0, 1], "radius": 0.2, "axis": [0, 1, 0]}],
    })  # fmt: skip
    with pytest.raises(mstmm.NumericalFailure, match="no equilibrium found near the start"):
        leaning.equilibrium()


def test_slopes_of_accelerations() -> None:
    """K and C of rods that are distances, by central differences between closed states."""
    scene = governor("constraint")
    scene["hinge"][0]["drive"] = "0"
    scene["hinge"][1]["law"] = {"stiffness": 300.0, "rest": -0.1, "damping": 2.0}
    scene["hinge"][2]["law"] = {"stiffness": 5.0, "damping": 0.7}
    model = compile_scene(scene)
    linear, size = model.linearize(), 1e-4
    assert linear.constrained_motion is not None
    ways, places, q = (
        linear.constrained_motion.motion_basis,
        list(linear.free_speed_indices),
        linear.state.q,
    )
    memory = model.looped.start_memory()

    def assembled_coordinates(x: Array) -> Array:
        return model.assemble(q + model.looped.rates(0.0, q, ways @ x, memory))[0]

    for k, unit in enumerate(np.eye(len(linear)) * size):
        moved = [
            model.accelerations(assembled_coordinates(s * unit), 0 * ways[:, 0]) for s in (1, -1)
        ]
        going = [model.accelerations(q, s * ways @ unit) for s in (1, -1)]
        for (ahead, behind), matrix in ((moved, linear.K), (going, linear.C)):
            found = (ahead - behind)[places] / (2 * size)
            assert worst(found, -np.linalg.solve(linear.M, matrix[:, k])) < 1e-6


def test_efforts_of_a_disc() -> None:
    """Efforts along the axes in which it is free give back the accelerations they are for."""
    model = disc()
    q, u = model.initial_state()
    wanted = np.array([0.4, -0.7, 1.1])
    efforts = model.inverse_dynamics(q, u, wanted)
    found = model.accelerations(q, u) + model.solve(q, efforts)
    places = [
        model.coordinate_layout.u_names.index(name) for name in model.loops.independent_speeds
    ]
    assert worst(found[places], wanted) < 1e-11
    assert model.mass_matrix(q)[0, 0] > MASS
