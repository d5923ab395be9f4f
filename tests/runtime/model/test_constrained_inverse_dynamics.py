"""Mass matrix and inverse dynamics of mechanisms, over the motions that their loops leave."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.linalg

import mstmm
from tests.reference import newton_euler as dense
from tests.reference.compare import worst
from tests.reference.jets import Array
from tests.reference.random_loops import closure_jacobian, random_mechanism
from tests.reference.tree import read
from tests.runtime.packing.test_expansion import LAWS, SPEED, signs
from tests.support import planar_four_bar as planar
from tests.support.models import compile_scene
from tests.support.scenes.linkages import OBLIQUE, bricard, four_bar, legs
from tests.support.scenes.published_mechanisms import four_bars

SEEDS = (11, 31)


def ways_of_four_bar(found: Array) -> Array:
    """Rates of crank, coupler and rocker for a unit of the crank's."""
    rows = planar.closing(found)
    return np.r_[1.0, np.linalg.solve(rows[:, 1:], -rows[:, 0])]


@pytest.mark.parametrize("cut", planar.NAMES)
def test_mass_matrix_of_a_four_bar(cut: str) -> None:
    model = compile_scene(four_bar(speed=SPEED, cut=cut, laws=LAWS, tilt=OBLIQUE))
    assert model.loops.independent_speeds == ("foot.angle_rate",)
    found, rates = planar.start(0.9, SPEED)
    along = ways_of_four_bar(found)
    mass = along @ planar.matrix_and_load(found, rates, LAWS)[0] @ along
    assert worst(model.mass_matrix(model.initial_state()[0]), np.array([[mass]])) < 1e-13


@pytest.mark.parametrize("seed", SEEDS)
def test_random_mechanisms(seed: int) -> None:
    """Mass matrices by a null space from singular values and the kinetic energy of all bodies, and
    efforts that give the accelerations for which they were asked."""
    scene, q, u = random_mechanism(seed)
    model, tree = compile_scene(scene), read(scene)
    places = [
        model.coordinate_layout.u_names.index(name) for name in model.loops.independent_speeds
    ]
    ways = scipy.linalg.null_space(closure_jacobian(tree, q), rcond=1e-10)
    assert ways.shape[1] == len(places) == model.loops.mobility
    ways = ways @ np.linalg.inv(ways[places])
    mass = ways.T @ dense.mass_matrix(tree, q) @ ways
    found = model.mass_matrix(q)
    assert worst(found, mass) < 1e-11
    assert model.mass_matrix(np.array([q, q])).shape == (2, *found.shape)
    energy, wanted = u[places] @ found @ u[places], u @ dense.mass_matrix(tree, q) @ u
    assert worst(energy, wanted, floor=1.0) < 1e-11
    wanted = np.random.default_rng(seed).standard_normal(len(places))
    efforts = model.inverse_dynamics(q, u, wanted, t=0.3)
    assert not np.delete(efforts, places).any()
    after = model.accelerations(q, u, 0.3, efforts)
    scale = float(np.abs(model.accelerations(q, u, 0.3)).max())
    assert worst(after[places], wanted, floor=scale) < 1e-10
    assert worst(model.inverse_dynamics(q, u, after, 0.3), efforts) < 1e-9


@pytest.mark.parametrize("name", planar.NAMES)
@pytest.mark.parametrize("cut", ["foot", "tip"])
def test_any_pin_of_a_four_bar_acts(name: str, cut: str) -> None:
    """By virtual work the effort of a pin is that of the crank over how far it turns with it."""
    model = compile_scene(four_bar(speed=SPEED, cut=cut, laws=LAWS))
    found, rates = planar.start(0.9, SPEED)
    crank = planar.effort_of_crank(found, rates, -3.0, LAWS)
    turns = planar.HINGES @ ways_of_four_bar(found)
    q, u = model.initial_state()
    efforts = model.inverse_dynamics(q, u, [-3.0], actuators=[name])
    wanted = np.where(np.array(planar.NAMES) == name, crank / turns, 0.0)
    assert worst(signs(cut) * efforts, wanted) < 1e-11


def test_legs_carry_a_platform() -> None:
    """At rest, of legs without weight: forces along them in balance with the platform's weight."""
    scene = legs()
    for body in scene["body"][1:]:
        body["mass"], body["inertia"] = 1e-9, [1e-10, 1e-10, 1e-10]
    model = compile_scene(scene)
    q, u = model.initial_state()
    slides = [f"slide{k}" for k in range(6)]
    efforts = model.inverse_dynamics(q, u, np.zeros(6), actuators=slides)
    result = model.simulate(0.0, "dop853")
    feet = np.array([hinge["position"] for hinge in scene["hinge"][::3]])
    heads = np.array([result.position(f"platform.head{k}")[0] for k in range(6)])
    along = (heads - feet) / np.linalg.norm(heads - feet, axis=1)[:, None]
    middle = result.position("platform")[0]
    wrench = np.hstack([along, np.cross(heads - middle, along)]).T
    forces = np.linalg.solve(wrench, [0, 0, 20 * 9.81, 0, 0, 0])
    places = [model.coordinate_layout.hinges[name].u for name in slides]
    assert worst(efforts[places], forces) < 1e-7


@pytest.mark.parametrize("cut", ["foot", "tip"])
def test_efforts_of_drives(cut: str) -> None:
    """What a drive gives, in the tree and cut, with nothing left to act elsewhere."""
    drive: dict[str, Any] = {"drive": "0.9 + 2*t - 1.5*t^2", "law": {}}
    scene = four_bar(cut=cut, foot=drive)
    for hinge in scene["hinge"]:
        hinge["initial"] = {} if "drive" in hinge else hinge["initial"]
    model = compile_scene(scene)
    q, u = model.initial_state()
    efforts = model.inverse_dynamics(q, u, np.zeros(0))
    found, rates = planar.start(0.9, 2.0)
    wanted = [planar.effort_of_crank(found, rates, -3.0, {}), 0.0, 0.0, 0.0]
    assert worst(efforts, np.array(wanted)) < 1e-11


def test_columns_of_efforts() -> None:
    """M^-1 of a mechanism: N (N^T M N)^-1 N^T."""
    model = compile_scene(legs())
    q, _ = model.initial_state()
    columns = np.random.default_rng(1).standard_normal((model.nu, 3))
    found = model.solve(q, columns)
    places = [
        model.coordinate_layout.u_names.index(name) for name in model.loops.independent_speeds
    ]
    twice = model.solve(q, np.eye(model.nu)[:, places])
    assert worst(np.linalg.inv(twice[places]), model.mass_matrix(q)) < 1e-11
    assert worst(found, model.solve(q, np.eye(model.nu)) @ columns) < 1e-11


REFUSED: dict[str, tuple[list[str], str]] = {
    "too many": (["foot", "end"], "the mobility of the mechanism, 1, found 2"),
    "none": ([], "1, found 0"),
    "unknown": (["foo.effort"], '"foo.effort": expected an effort'),
    "no effort": (["crank.force.x"], "expected a hinge, or an effort of one"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_refused_actuators(what: str) -> None:
    names, message = REFUSED[what]
    model = compile_scene(four_bar())
    q, u = model.initial_state()
    with pytest.raises(mstmm.SceneError, match=message):
        model.inverse_dynamics(q, u, [0.0], actuators=names)


def test_accelerations_that_tear_a_loop() -> None:
    model = compile_scene(four_bar())
    q, u = model.initial_state()
    with pytest.raises(mstmm.SceneError, match=r"udot of .* where closed loops need"):
        model.inverse_dynamics(q, u, np.ones(4))


def test_a_dead_centre() -> None:
    """Where coupler and crank are in line the rocker turns round and cannot move them."""
    line = np.arccos((1.6**2 + 1.2**2 - 0.8**2) / (2 * 1.6 * 1.2))
    model = compile_scene(four_bar(crank=float(line)))
    q, u = model.initial_state()
    assert np.isfinite(model.inverse_dynamics(q, u, [1.0])).all()
    with pytest.raises(
        mstmm.NumericalFailure, match=r"end.* cannot drive all motions of the mechanism"
    ):
        model.inverse_dynamics(q, u, [1.0], actuators=["end"])


def test_a_singular_pose() -> None:
    """Windows that are folded flat can go on more ways than one."""
    model = compile_scene(four_bars(2, 0.0, 0.0))
    assert model.loops.singular
    with pytest.raises(mstmm.NumericalFailure, match="singular configuration; use a nearby state"):
        model.mass_matrix(model.initial_state()[0])


def test_actuators_of_a_tree() -> None:
    scene = bricard()
    scene["hinge"].pop()
    model = compile_scene(scene)
    q, u = model.initial_state()
    with pytest.raises(mstmm.SceneError, match="actuators: expected a scene with closed loops"):
        model.inverse_dynamics(q, u, u, actuators=["pin0"])
