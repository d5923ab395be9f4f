"""Linear models of closed loops beside states that move, or that do not last."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.run.scene_system import SceneSystem
from tests.reference.algebra import orientation, to_quaternion
from tests.reference.compare import worst
from tests.reference.jets import Array
from tests.runtime.linear.test_input_channels_drives_closed_loops import driven_five_bar
from tests.runtime.model.test_equilibrium_closed_loops import five_bar
from tests.runtime.packing.test_expansion import LAWS
from tests.support.models import compile_scene
from tests.support.scenes.linkages import OBLIQUE, bricard, four_bar, rod
from tests.system.loops.test_flexible_against_tree import shackled_beam, slider_crank

STEP, G = 5e-5, 9.81
#: The governor's arms (m, kg, kg m2 about their axes), sleeve (kg), and what else turns (kg m2).
ARM, MASS, THIN, SLEEVE, SHAFT = 0.3, 0.4, 2e-4, 1.5, 0.02


def ring() -> dict[str, Any]:
    """Bricard's ring off the axes of the ground."""
    scene = bricard()
    scene["hinge"][0] |= {"initial": {"q": 0.4}, "hold": True}
    return scene


def between_balls() -> dict[str, Any]:
    """A crank and a rocker about axes that cross, and a coupler between them on balls."""
    crank, rocker = orientation((0.0, 0.0, 0.4)), orientation((0.0, -1.2, 0.0))
    foot = np.array([1.0, 0.1, 0.0])
    along = foot + rocker[:, 0] * 0.5 - crank[:, 0] * 0.3
    length = float(np.linalg.norm(along))
    side = np.cross(along, [0.0, 0.0, 1.0]) / np.linalg.norm(np.cross(along, [0.0, 0.0, 1.0]))
    held = np.stack([along / length, side, np.cross(along / length, side)], axis=-1)
    near, far = (to_quaternion(x).tolist() for x in (crank.T @ held, held.T @ rocker))
    coupler = rod("coupler", length) | {"inertia": [0.02, 0.05, 0.04]}
    return {
        "gravity": [0, -9.81, 0],
        "body": [rod("crank", 0.3), coupler, rod("rocker", 0.5)],
        "hinge": [
            {"name": "foot", "type": "pin", "axis": [0, 0, 1], "inboard": "ground",
             "outboard": "crank", "initial": {"q": 0.4}, "law": {"damping": 0.2}},
            {"name": "near", "type": "ball", "inboard": "crank.tip", "outboard": "coupler",
             "initial": {"q": near}},
            {"name": "end", "type": "pin", "axis": [0, 1, 0], "inboard": "ground",
             "position": foot.tolist(), "outboard": "rocker", "initial": {"q": -1.2},
             "law": {"stiffness": 4.0}},
            {"name": "far", "type": "ball", "inboard": "coupler.tip", "outboard": "rocker.tip",
             "initial": {"q": far}},
        ],
    }  # fmt: skip


def coupled_five_bar() -> dict[str, Any]:
    """A five-bar whose cranks a coupling that goes by time holds together."""
    together = {"expression": "foot1.q - 0.4*foot0.q^2", "equals": "0.6 + 0.5*t + t^2"}
    return five_bar({"stiffness": 3.0, "damping": 0.4}) | {"coupling": [together]}


#: Laws without dry friction, which linear models leave out.
SMOOTH = {name: {k: x for k, x in law.items() if k != "friction"} for name, law in LAWS.items()}

MOVING: dict[str, tuple[Callable[[], mstmm.Model], float | list[float]]] = {
    "four-bar": (lambda: compile_scene(four_bar(laws=SMOOTH, tilt=OBLIQUE)), 1.7),
    "bricard": (lambda: compile_scene(ring()), -0.8),
    "on balls": (lambda: compile_scene(between_balls()), [1.1, -0.7]),
    "driven": (lambda: driven_five_bar(1.0, 0.9, 0), 0.6),
    "led": (lambda: compile_scene(coupled_five_bar()), -1.2),
    "a bent rod": (lambda: mstmm.compile(mstmm.Scene(**slider_crank())), [0.8] + [0.0] * 20),
    "bent and shackled": (lambda: mstmm.compile(mstmm.Scene(**shackled_beam())), 0.3),
    "at rest": (lambda: compile_scene(four_bar(laws=SMOOTH, tilt=OBLIQUE)), 0.0),
}


@pytest.mark.parametrize("scene", MOVING)
def test_slopes_along_closed_motions(scene: str) -> None:
    """Accelerations, and speeds of what goes along, by central differences between states in which
    loops and speeds fit: x' = G x + dv, and A is that of (x, x')."""
    make, speeds = MOVING[scene]
    model = make()
    q, u = model.initial_state()
    freedom = model.independent_speeds
    assert freedom is not None
    places = list(freedom.select(q))
    u = u + freedom.motion_matrix(q, places) @ (np.resize(speeds, len(places)) - u[places])

    def closed_state(q: Array) -> tuple[Array, Array]:
        """A state near q and u that satisfies the loops."""
        whole = SceneSystem(model.looped).start(0.0, model.assemble(q, 0 * u)[0], u)
        return whole[: model.nq], whole[model.nq : model.nq + model.nu]

    q, u = closed_state(q)
    linear = model.linearize(q, u)
    n, loops, memory = len(linear), linear.constrained_motion, model.looped.start_memory()
    assert loops is not None and list(linear.free_speed_indices) == places
    assert (linear.rate_matrix is not None) == (scene == "on balls")

    def speeds_and_accelerations(x: Array, dv: Array) -> Array:
        """All speeds, and the accelerations of the independent ones."""
        moved = q + model.looped.rates(0.0, q, loops.motion_basis @ x, memory)
        moved, fit = closed_state(moved)
        fit = fit + freedom.motion_matrix(moved, places) @ (u[places] + dv - fit[places])
        return np.concatenate([fit, model.accelerations(moved, fit)[places]])

    still, found = np.zeros(n), []
    for unit in np.eye(n) * STEP:
        for pair in ((unit, still), (still, unit)):
            ahead, behind = (speeds_and_accelerations(s * pair[0], s * pair[1]) for s in (1, -1))
            found.append((ahead - behind) / (2 * STEP))
    by_x, by_v = np.array(found[::2]).T, np.array(found[1::2]).T
    turn = np.zeros((n, n)) if linear.rate_matrix is None else linear.rate_matrix
    down, rate = linear.A[n:, :n], linear.A[n:, n:]
    assert worst(by_x[model.nu :], down + rate @ turn - turn @ turn) < 1e-6
    assert worst(by_v[model.nu :], rate - turn) < 1e-7
    names = [
        name
        for name in model.coordinate_layout.u_names
        if name.rpartition(".")[0] in model.coordinate_layout.hinges
    ]
    rates = linear.output_matrices(names)[0]
    kept = [model.coordinate_layout.u_names.index(name) for name in names]
    assert worst(by_x[kept], rates[:, :n] + rates[:, n:] @ turn, floor=1.0) < 1e-6
    assert worst(by_v[kept], rates[:, n:]) < 1e-7


def governor(angle: float, drive: str = "") -> dict[str, Any]:
    """A shaft that turns, an arm on it, and a rod of the same length to a sleeve below."""
    about = MASS * ARM**2 / 12
    body = {"mass": MASS, "center_of_mass": [0, -ARM / 2, 0], "inertia": [about, THIN, about],
            "ends": {"tip": [0, -ARM, 0]}}  # fmt: skip
    heavy = {"mass": SLEEVE, "inertia": [0.01, SHAFT / 2, 0.01]}
    spin: dict[str, Any] = {"drive": drive} if drive else {}
    upright = {"type": "pin", "axis": [0, 0, 1]}
    return {
        "gravity": [0, -G, 0],
        "body": [{"name": "shaft", "mass": 1.0, "inertia": [0.01, SHAFT / 2, 0.01]},
                 body | {"name": "arm"}, body | {"name": "rod"}, heavy | {"name": "sleeve"}],
        "hinge": [
            {"name": "spin", "type": "pin", "axis": [0, 1, 0], "inboard": "ground",
             "outboard": "shaft", **spin},
            {"name": "swing", **upright, "inboard": "shaft", "outboard": "arm",
             "initial": {"q": angle}},
            {"name": "knee", **upright, "inboard": "arm.tip", "outboard": "rod",
             "initial": {"q": -2 * angle}},
            {"name": "slide", "type": "prismatic", "axis": [0, 1, 0], "inboard": "shaft",
             "outboard": "sleeve", "initial": {"q": -2 * ARM * np.cos(angle)}},
            {"name": "foot", **upright, "inboard": "sleeve", "outboard": "rod.tip",
             "initial": {"q": -angle}},
        ],
    }  # fmt: skip


def steady(angle: float) -> tuple[float, float, float]:
    """The spin at which the arm keeps its angle (rad/s), and omega^2 beside it where the spin is
    free and where it is held, by Lagrange's equations of the two coordinates."""
    s, c = np.sin(angle), np.cos(angle)
    spread = 2 * (MASS * ARM**2 / 3 - THIN)  # J = J_0 + spread sin^2
    weight = 2 * (MASS + SLEEVE) * G * ARM
    square = weight / (spread * c)
    whole = SHAFT + 2 * THIN + spread * s**2
    slope, bend = 2 * spread * s * c, 2 * spread * np.cos(2 * angle)
    rod = MASS * ARM**2 * (c**2 / 4 + 9 * s**2 / 4 + 1 / 12)
    inertia = MASS * ARM**2 / 3 + rod + 4 * SLEEVE * ARM**2 * s**2
    held = (weight * c - square * bend / 2) / inertia
    return float(np.sqrt(square)), held + square * slope**2 / whole / inertia, held


def test_a_governor_turns_freely() -> None:
    """Its arm swings about the angle that it keeps, and takes from the spin what it gives back."""
    angle = 0.7
    spin, free, _ = steady(angle)
    model = compile_scene(governor(angle))
    q = model.initial_state()[0]
    u = np.zeros(model.nu)
    u[0] = spin
    linear = model.linearize(q, u, inputs=["spin.effort", "swing.effort"])
    assert not any("is not steady" in warning for warning in linear.warnings)
    modes = linear.modes()
    assert modes.omega[-1] ** 2 == pytest.approx(free, rel=1e-9)
    assert worst(linear.C_gyroscopic, linear.C) < 1e-12
    omega, outputs = np.array([2.0, 9.0, 31.0]), ["knee.angle", "spin.angle_rate", "arm.tip.y"]
    found = linear.frequency_response(omega, outputs=outputs)
    c, d = linear.output_matrices(outputs)
    for k, s in enumerate(1j * omega):
        wanted = c @ np.linalg.solve(s * np.eye(len(linear.A)) - linear.A, linear.B) + d
        assert np.abs(found.response[k] - wanted).max() < 1e-9 * np.abs(wanted).max()


def test_a_governor_is_turned() -> None:
    """A drive holds the spin: the arm finds its angle, and swings otherwise."""
    spin, _, held = steady(0.7)
    model = compile_scene(governor(0.6, drive=f"{spin!r}*t"))
    linear = model.linearize()
    assert linear.state.q[1] == pytest.approx(0.7, abs=1e-9)
    assert linear.modes().omega ** 2 == pytest.approx([held], rel=1e-9)
    assert np.all(np.abs(linear.C) < 1e-12)


def test_parts_of_a_motion() -> None:
    """Springs and dampers apart from what the motion makes."""
    scene = governor(0.7)
    scene["hinge"][1]["law"] = {"stiffness": 5.0, "rest": 0.7, "damping": 0.3}
    sprung, bare = compile_scene(scene), compile_scene(governor(0.7))
    q, u = sprung.initial_state()[0], np.zeros(sprung.nu)
    u[0] = steady(0.7)[0]
    here, there = sprung.linearize(q, u), bare.linearize(q, u)
    place = here.free_speed_indices.index(1)
    spring, damper = (np.zeros((2, 2)) for _ in range(2))
    spring[place, place], damper[place, place] = 5.0, 0.3
    assert worst(here.K_elastic, spring) < 1e-11 and worst(here.C_damping, damper) < 1e-11
    assert worst(here.K_geometric, there.K) < 1e-9 and worst(here.C_gyroscopic, there.C) < 1e-9
    assert worst(here.K_elastic + here.K_geometric + here.K_load, here.K) < 1e-12
    assert here.modes(damped=False).strain_energy_shares()["swing"].max() == pytest.approx(1.0)


def test_a_drive_that_drags_loops_along_leaves_no_rest() -> None:
    (warning, *_) = driven_five_bar(1.0, 0.9, 0).linearize().warnings
    assert warning.startswith("the state is not steady: foot0.angle accelerate")
