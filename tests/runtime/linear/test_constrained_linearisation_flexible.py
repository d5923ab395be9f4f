"""Linear models of mechanisms that bend: beams held at both ends by a loop, a frame, and the open
tree under the forces that close it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh, null_space
from scipy.optimize import brentq

import mstmm
from tests.reference.compare import worst
from tests.reference.jets import Array
from tests.system.loops.test_flexible_against_tree import (
    SCENES,
    Scene,
    opened_tree,
    shackled_beam,
    slider_crank,
)

#: Shapes of every beam; all have EI = 1, 1 kg/m.
COUNT = 10
#: Of central differences, s and m.
STEP = 1e-5


def beam(name: str, length: float = 1.0, **more: Any) -> Scene:
    return {"name": name, "length": length, "mass_per_length": 1.0, "bending_stiffness": 1.0,
            "modes": {"y": COUNT}, **more}  # fmt: skip


def at_ground(name: str, outboard: str, kind: str, x: float, **more: Any) -> Scene:
    return {"name": name, "type": kind, "inboard": "ground", "outboard": outboard,
            "position": [x, 0, 0], **more}  # fmt: skip


def squares(scene: Scene) -> Array:
    """(k L)^2 of the motions, which are omega.  Only beams have elastic energy."""
    modes = mstmm.compile(mstmm.Scene(gravity=[0, 0, 0], **scene)).modes()
    shares = modes.strain_energy_shares()
    assert sum(shares[bent["name"]] for bent in scene["beam"]) == pytest.approx(1.0)
    return modes.omega


def roots(equation: Any, starts: list[float]) -> Array:
    return np.array([brentq(equation, x - 0.2, x + 0.2, xtol=1e-14) for x in starts]) ** 2


CLAMPED = roots(lambda x: np.cos(x) - 1 / np.cosh(x), [4.73, 7.85, 11.0])
PROPPED = roots(lambda x: np.tan(x) - np.tanh(x), [3.93, 7.07, 10.21])
HINGED = (np.pi * np.arange(1, 4)) ** 2
ROD = {"axial_stiffness": 1e6, "modes": {"y": COUNT, "axial": 2}}


@pytest.mark.parametrize(
    ("first", "last", "more", "known", "bound"),
    [
        ("fixed", "prismatic", {}, CLAMPED, 1e-12),
        ("fixed", "fixed", ROD, CLAMPED, 1e-11),
        ("fixed", "pin", ROD, PROPPED, 2e-5),
        ("pin", "pin", ROD, HINGED, 1e-9),
    ],
)
def test_beams_between_two_hinges_on_the_ground(
    first: str, last: str, more: Scene, known: Array, bound: float
) -> None:
    """Clamped at both ends, at one, at none; shapes of clamped ends approach a pinned one."""
    along = {"axis": [1, 0, 0]} if last == "prismatic" else {}
    hinges = [at_ground("foot", "b", first, 0.0), at_ground("far", "b.tip", last, 1.0, **along)]
    found = squares({"beam": [beam("b", **more)], "hinge": hinges})
    assert worst(found[:3], known) < bound


def test_a_beam_that_slides_along_a_plane() -> None:
    """By a constraint in place of a hinge, at a tip where nothing else is."""
    held = {"name": "rail", "type": "point-on-plane", "from": "ground", "to": "b.tip",
            "normal": [0, 1, 0], "offset": 0.0}  # fmt: skip
    foot = at_ground("foot", "b", "pin", 0.0)
    found = squares({"beam": [beam("b")], "hinge": [foot], "constraint": [held]})
    assert worst(found[:3], HINGED) < 1e-7


def test_a_portal_sways_as_its_dynamic_stiffness_says() -> None:
    """Two columns and a beam of their length, welded: the beam shifts, both corners turn."""
    upright = {"orientation": [0, 0, np.pi / 2]}
    hinges = [
        at_ground("left_foot", "left", "fixed", 0.0, **upright),
        at_ground("right_foot", "right", "fixed", 1.0, **upright),
        {"name": "corner", "type": "fixed", "inboard": "left.tip", "outboard": "top",
         "orientation": [0, 0, -np.pi / 2]},
        {"name": "weld", "type": "fixed", "inboard": "top.tip", "outboard": "right.tip",
         "orientation": [0, 0, np.pi / 2], "cut": True},
    ]  # fmt: skip

    def stiffness(k: float) -> float:
        """det of the forces by shift and turn, after Kolousek."""
        c, s, ch, sh = np.cos(k), np.sin(k), np.cosh(k), np.sinh(k)
        under = 1 - c * ch
        near = k * (s * ch - c * sh) / under  # moment where an end turns
        across = k * (sh - s) / under  # and at the other end
        mixed = k**2 * s * sh / under  # moment by a shift
        force = k**3 * (c * sh + s * ch) / under
        sway = np.array([[2 * force - k**4, 2 * mixed], [mixed, near + near + across]])
        return float(np.linalg.det(sway))

    found = squares({"beam": [beam("left"), beam("right"), beam("top")], "hinge": hinges})
    known = brentq(stiffness, 1.0, 2.5) ** 2
    assert abs(found[0] / known - 1) < 1e-7


def column(push: float) -> Scene:
    """On a pin, below a slider on which a force stands: the loop carries it into the beam."""
    slider = {"name": "slider", "mass": 2.0, "inertia": [1, 1, 1]}
    hinges = [
        at_ground("foot", "b", "pin", 0.0),
        at_ground("guide", "slider", "prismatic", 0.0, axis=[1, 0, 0], initial={"q": 1.0}),
        {"name": "head", "type": "pin", "inboard": "b.tip", "outboard": "slider", "cut": True},
    ]  # fmt: skip
    return {"gravity": [0, 0, 0], "constants": {"push": push}, "body": [slider],
            "beam": [beam("b")], "hinge": hinges,
            "load": [{"on": "slider", "force": ["0 - push", 0, 0]}]}  # fmt: skip


def test_a_column_under_what_its_loop_carries() -> None:
    """omega = (n pi)^2 sqrt(1 - P / (n pi)^2), and Euler's load, where the first is zero."""
    for push in (-30.0, 0.0, 8.0):
        linear = mstmm.compile(mstmm.Scene(**column(push))).linearize()
        assert worst(linear.modes().omega[:3], HINGED * np.sqrt(1 - push / HINGED)) < 1e-6
        assert worst(linear.K_elastic + linear.K_geometric + linear.K_load, linear.K) < 1e-12
    found = mstmm.compile(mstmm.Scene(**column(9.0))).stability_limit("constants.push", 9.0, 10.5)
    assert found.value == pytest.approx(np.pi**2, rel=1e-6)


@pytest.mark.parametrize("name", ["slider_crank", "shackled", "meshed"])
def test_against_the_tree_under_the_forces_that_close_it(name: str) -> None:
    """Dead forces on both ends have the stiffness of a point that is met: K and M of the tree on
    the motions that their columns leave."""
    made, other, rows = SCENES[name]
    scene = made()
    linear = mstmm.compile(mstmm.Scene(**scene)).linearize()
    wrist = scene["hinge"][3]
    bent = wrist["outboard"] if "tip" in wrist["outboard"] else wrist["inboard"]
    tree = opened_tree(scene, rows, (bent, other))
    q = np.delete(linear.state.q, linear.model.coordinate_layout.hinges["wrist"].q_slice)
    pulls = [f"pull{k}" for k in range(rows)]
    free = tree.linearize(q, np.zeros(tree.nu), inputs=pulls)
    efforts = free.M @ free.state.udot[list(free.free_speed_indices)]
    forces = np.linalg.lstsq(free.V, -efforts)[0]
    assert np.abs(forces).max() > 0.1
    assert worst(free.V @ forces, -efforts) < 1e-8
    loaded = tree.with_inputs(dict(zip(pulls, forces.tolist(), strict=True)))
    held = loaded.linearize(q, np.zeros(tree.nu), inputs=pulls)
    ways = null_space(held.V.T)
    known = eigh(ways.T @ held.K @ ways, ways.T @ held.M @ ways, eigvals_only=True)
    found = eigh(linear.K, linear.M, eigvals_only=True)
    assert np.abs(found - known).max() < 1e-9 * np.abs(known).max()
    assert np.abs(found[0] / known[0] - 1) < 1e-8


def test_responses_are_those_of_the_matrices() -> None:
    """Of shapes and of what hangs behind them, with the damping of a beam."""
    scene = slider_crank()
    scene["beam"][0]["damping"] = 0.02
    linear = mstmm.compile(mstmm.Scene(**scene)).linearize(inputs=["foot.effort", "bar.tip.fy"])
    outputs = ["bar.tip.position.y", "slider.acceleration.x", "wrist.angle"]
    c, d = linear.output_matrices(outputs)
    assert worst(linear.C_damping, linear.C) < 1e-12 and np.abs(linear.C).max() > 1e-3
    omega = np.array([2.0, 50.0, 180.0])
    found = linear.frequency_response(omega, outputs=outputs)
    for k, s in enumerate(1j * omega):
        wanted = c @ np.linalg.solve(s * np.eye(len(linear.A)) - linear.A, linear.B) + d
        assert np.abs(found.response[k] - wanted).max() < 1e-10 * np.abs(wanted).max()


@pytest.mark.parametrize("make", [slider_crank, shackled_beam], ids=["slider_crank", "shackled"])
def test_matrices_are_slopes_of_accelerations(make: Any) -> None:
    """Beside rest under weight, by central differences between closed states."""
    model = mstmm.compile(mstmm.Scene(**make()))
    linear = model.linearize(inputs=["bar.tip.fy"])
    loops, q, still = linear.constrained_motion, linear.state.q, np.zeros(model.nu)
    n, places, memory = len(linear), list(linear.free_speed_indices), model.looped.start_memory()
    assert loops is not None

    def accelerations_at(x: Array) -> Array:
        moved = q + model.looped.rates(0.0, q, loops.motion_basis @ x, memory)
        return model.accelerations(model.assemble(moved, still)[0], still)[places]

    slopes = [(accelerations_at(x) - accelerations_at(-x)) / (2 * STEP) for x in STEP * np.eye(n)]
    assert worst(np.array(slopes).T, linear.A[n:, :n]) < 1e-6
    whole = linear.K_elastic + linear.K_geometric + linear.K_load
    assert worst(whole, linear.K) < 1e-12

    omega, outputs = np.array([3.0, 40.0]), ["bar.tip.position.y", "wrist.angle_rate"]
    found = linear.frequency_response(omega, outputs=outputs, structural=0.05)
    c = linear.output_matrices(outputs)[0]
    for k, s in enumerate(1j * omega):
        stiff = linear.K + 0.05j * linear.K_elastic
        x = np.linalg.solve(s**2 * linear.M + s * linear.C + stiff, linear.V)
        wanted = c[:, :n] @ x + c[:, n:] @ (s * x)
        assert np.abs(found.response[k] - wanted).max() < 1e-9 * np.abs(wanted).max()
