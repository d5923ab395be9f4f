"""The model's own promises: batches, parameters, start, efforts, equilibrium."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

import mstmm
from tests.reference import newton_euler as dense
from tests.reference.compare import fresh, worst
from tests.reference.random_scenes import random_state
from tests.support.models import compile_scene
from tests.support.scenes.rods import chain, drawn_state

# --- batches ----------------------------------------------------------------------------------


def test_a_batch_is_the_loop_over_its_states(rng: np.random.Generator) -> None:
    scene, _, _ = fresh(rng)
    model = compile_scene(scene)
    states = [random_state(scene, k) for k in range(6)]
    q = np.array([state[0] for state in states]).reshape(2, 3, -1)
    u = np.array([state[1] for state in states]).reshape(2, 3, -1)
    t, efforts = rng.uniform(0, 1, (2, 3)), rng.uniform(-1, 1, u.shape)
    found = model.accelerations(q, u, t, efforts)
    assert found.shape == u.shape
    for i in np.ndindex(2, 3):
        assert np.array_equal(found[i], model.accelerations(q[i], u[i], t[i], efforts[i]))


def test_one_time_serves_all_states_and_one_state_all_times(rng: np.random.Generator) -> None:
    scene = chain(["pin", "pin"])
    scene["hinge"][1]["law"] = {"effort": "sin(3*t)"}
    model, (q, u) = compile_scene(scene), drawn_state(scene, rng)
    times = np.linspace(0, 1, 5)
    found = model.accelerations(q, u, times)
    assert found.shape == (5, 2)
    assert np.array_equal(found, [model.accelerations(q, u, t) for t in times])
    many = model.accelerations(np.tile(q, (4, 1)), u, 0.3)
    assert np.array_equal(many, np.tile(model.accelerations(q, u, 0.3), (4, 1)))


def test_an_empty_batch_and_a_scene_without_freedom() -> None:
    model = compile_scene(chain(["pin", "pin"]))
    assert model.accelerations(np.zeros((0, 2)), np.zeros((0, 2))).shape == (0, 2)
    stiff = compile_scene(chain(["fixed", "fixed"]))
    assert stiff.accelerations([], []).shape == (0,)
    assert stiff.mass_matrix([]).shape == (0, 0)
    result = stiff.simulate(1.0)
    assert result.success
    assert result.force("hinge0")[-1] == pytest.approx([-2.0, 18.0, -6.0])


@pytest.mark.parametrize(
    ("q", "u", "message"),
    [
        ([0.0], [0.0, 0.0], r"q has shape \(1,\), expected \(\.\.\., 2\)"),
        ([0.0, 0.0], 0.0, r"u has shape \(\), expected \(\.\.\., 2\)"),
        ([0.0, np.nan], [0.0, 0.0], r"q\[1\] = nan: expected a finite number"),
        ([0.0, 0.0], [np.inf, 0.0], r"u\[0\] = inf: expected a finite number"),
    ],
)
def test_states_that_do_not_fit(q: Any, u: Any, message: str) -> None:
    with pytest.raises(mstmm.SceneError, match=message):
        compile_scene(chain(["pin", "pin"])).accelerations(q, u)


def test_the_arguments_are_left_alone(rng: np.random.Generator) -> None:
    scene = chain(["ball", "pin"])
    scene["hinge"][1]["drive"] = "sin(t)"
    model, (q, u) = compile_scene(scene), drawn_state(scene, rng)
    q *= 1.7
    kept = q.copy(), u.copy()
    model.accelerations(q, u, 0.3)
    model.inverse_dynamics(q, u, u, 0.3)
    model.mass_matrix(q)
    model.simulate(0.01, initial=(q, u))
    assert np.array_equal(q, kept[0])
    assert np.array_equal(u, kept[1])


# --- parameters -------------------------------------------------------------------------------


@pytest.mark.parametrize("draw", range(4))
def test_other_parameters_are_the_scene_built_again(draw: int, rng: np.random.Generator) -> None:
    scene, q, u = fresh(rng)
    model = compile_scene(scene)
    body, hinge = scene["body"][0], scene["hinge"][0]
    changes = {f"{body['name']}.mass": 1.5 * body["mass"], "gravity[1]": -3.0}
    changes |= {f"{body['name']}.center_of_mass[{k}]": 0.1 * k for k in range(3)}
    if "damping" in hinge.get("law", {}):
        changes[f"{hinge['name']}.law.damping[0]"] = 7.0
        hinge["law"]["damping"][0] = 7.0
    before = model.accelerations(q, u, 0.3)
    other = model.with_parameters(changes)
    body |= {"mass": 1.5 * body["mass"], "center_of_mass": [0.0, 0.1, 0.2]}
    scene["gravity"][1] = -3.0
    assert np.array_equal(
        other.accelerations(q, u, 0.3), compile_scene(scene).accelerations(q, u, 0.3)
    )
    assert np.array_equal(model.accelerations(q, u, 0.3), before)
    assert other.parameters["gravity[1]"] == -3.0


def test_unknown_and_impossible_parameters_are_refused() -> None:
    model = compile_scene(chain(["pin", "pin"]))
    with pytest.raises(mstmm.SceneError, match=r'rod1\.mas.*did you mean "rod1\.mass"'):
        model.with_parameters({"rod1.mas": 2.0})
    with pytest.raises(mstmm.SceneError, match=r'rod1".*mass'):
        model.with_parameters({"rod1.mass": -2.0})
    with pytest.raises(mstmm.SceneError, match="gravity"):
        model.with_parameters({"gravity[7]": 1.0})


def test_a_number_that_is_given_twice_is_refused() -> None:
    scene = chain(["pin"])
    scene["hinge"][0] |= {"name": "knee", "law": {"damping": 0.3}}
    model = compile_scene(scene)
    for given in (names := ["knee.law.damping[0]", "knee.law.damping"]), names[::-1]:
        said = re.escape('"{}" and "{}" are the same number'.format(*given))
        with pytest.raises(mstmm.SceneError, match=said):
            model.with_parameters(dict.fromkeys(given, 0.5))
    entries = dict.fromkeys(["rod0.inertia[0]", "rod0.inertia[1]"], 0.5)
    assert model.with_parameters(entries).parameters["rod0.inertia[1]"] == 0.5


def test_parameters_keep_the_sweep_and_its_accuracy() -> None:
    model = mstmm.compile(mstmm.Scene(**chain(["pin"] * 3)), sweep="product")
    q, u = np.array([0.3, 0.4, -0.5]), np.zeros(3)
    dumbbell = {f"rod0.inertia[{k}]": 0.25 for k in range(3)}
    model.accelerations(q, u)
    with pytest.raises(mstmm.NumericalFailure, match="pivot"):
        model.with_parameters(dumbbell).accelerations(q, u)


# --- inverse dynamics -------------------------------------------------------------------------


def test_efforts_that_hold_an_arm_still() -> None:
    """Two rods at rest: the gravity moments of a schoolbook."""
    model, g = compile_scene(chain(["pin", "pin"], gravity=(0, -9.81, 0))), 9.81
    q = np.array([0.3, 0.5])
    found = model.inverse_dynamics(q, np.zeros(2), np.zeros(2))
    outer = g * 0.5 * np.cos(q.sum())
    inner = outer + g * 0.5 * np.cos(q[0]) + g * np.cos(q[0])
    assert found == pytest.approx([inner, outer], rel=1e-14)


def test_inverse_dynamics_and_mass_matrix_agree(rng: np.random.Generator) -> None:
    scene, q, u = fresh(rng)
    model = compile_scene(scene)
    one, other = rng.uniform(-1, 1, (2, model.nu))
    difference = model.inverse_dynamics(q, u, one, 0.3) - model.inverse_dynamics(q, u, other, 0.3)
    expected = dense.mass_matrix(scene, q) @ (one - other)
    rest = model.inverse_dynamics(q, u, other, 0.3)
    size = max(np.abs(expected).max(initial=0.0), np.abs(rest).max(initial=0.0), 1.0)
    assert worst(difference, expected, floor=size) < 1e-11


# --- equilibrium ------------------------------------------------------------------------------


def test_hanging_equilibrium_of_a_chain() -> None:
    model = compile_scene(chain(["pin"] * 3, gravity=(0, -9.81, 0)))
    q = model.equilibrium()
    assert np.cumsum(q) % (2 * np.pi) == pytest.approx([1.5 * np.pi] * 3, abs=1e-9)
    assert np.abs(model.accelerations(q, np.zeros(3))).max() < 1e-8


def test_equilibrium_from_an_unstable_start_is_the_hanging_one() -> None:
    model = compile_scene(chain(["pin"] * 2, gravity=(0, -9.81, 0)))
    q = model.equilibrium([np.pi / 2 + 1e-3, 0.0])
    assert np.sin(q[0]) == pytest.approx(-1.0, abs=1e-9)


def test_equilibrium_of_springs_and_drives() -> None:
    """A slider on a spring below a driven slider: sag m g / k, measured along the axis."""
    scene = chain(["prismatic", "prismatic"], gravity=(0, 0, -9.81))
    scene["hinge"][0]["drive"] = "0.7 + 0*t"
    scene["hinge"][1]["law"] = {"stiffness": 50.0, "rest": 0.2}
    q = compile_scene(scene).equilibrium()
    assert q == pytest.approx([0.7, 0.2 - 9.81 / 50.0], abs=1e-10)


def test_equilibrium_of_a_free_body_on_bushings() -> None:
    scene = chain(["elastic"], gravity=(0, 0, -9.81))
    scene["hinge"][0]["law"] = {"stiffness": [100.0, 100.0, 200.0, 50.0, 50.0, 50.0]}
    model = compile_scene(scene)
    q = model.equilibrium()
    assert np.abs(model.accelerations(q, np.zeros(6))).max() < 1e-7
    assert q[2] == pytest.approx(-9.81 / 200.0, abs=1e-9)
    # Tilt about y: k angle = m g (0.5 cos angle) at the mass centre.
    angle = 2 * np.arctan2(q[5], q[3])
    assert 50.0 * angle == pytest.approx(9.81 * 0.5 * np.cos(angle), abs=1e-7)


@pytest.mark.parametrize("seed", range(3))
def test_equilibrium_of_random_springs_is_one_of_the_dense_equations(seed: int) -> None:
    scene = chain(["pin", "ball", "universal"], 0.7, inertia=(0.1, 0.15, 0.2))
    scene["hinge"][2]["axis2"] = [0, 1, 0]
    stiffness = np.random.default_rng(seed).uniform(5, 20, 3).tolist()
    scene["hinge"][0]["law"] = {"stiffness": stiffness[0]}
    scene["hinge"][1]["law"] = {"stiffness": stiffness}
    scene["hinge"][2]["law"] = {"stiffness": stiffness[:2]}
    q = compile_scene(scene).equilibrium()
    assert np.abs(dense.solve(scene, q, np.zeros(6)).udot).max() < 1e-6


def test_undetermined_coordinates_are_named() -> None:
    scene = chain(["pin", "pin"], gravity=(0, -9.81, 0))
    scene["hinge"][1]["orientation"] = [0.5 * np.pi, 0, 0]
    scene["body"][1]["center_of_mass"] = [0, 0, 0.5]
    with pytest.raises(mstmm.NumericalFailure, match=r"undetermined along hinge1\.angle"):
        compile_scene(scene).equilibrium()
    floating = chain(["free"], gravity=(0, 0, 0))
    with pytest.raises(mstmm.NumericalFailure, match="undetermined along hinge0"):
        compile_scene(floating).equilibrium()


def test_no_equilibrium_is_said() -> None:
    """Nothing holds the slider up; nothing balances a constant torque beyond m g l."""
    with pytest.raises(mstmm.NumericalFailure, match="no equilibrium"):
        compile_scene(chain(["prismatic"], gravity=(0, 0, -9.81))).equilibrium()
    scene = chain(["pin"], gravity=(0, -9.81, 0))
    scene["hinge"][0]["law"] = {"effort": 20.0}
    with pytest.raises(mstmm.NumericalFailure, match="no equilibrium"):
        compile_scene(scene).equilibrium()


def test_a_torque_below_the_weight_has_an_equilibrium() -> None:
    scene = chain(["pin"], gravity=(0, -9.81, 0))
    scene["hinge"][0]["law"] = {"effort": 3.0}
    q = compile_scene(scene).equilibrium()
    assert np.cos(q[0]) == pytest.approx(3.0 / (0.5 * 9.81), abs=1e-10)


# --- start ------------------------------------------------------------------------------------


def test_the_start_has_driven_values_and_unit_quaternions() -> None:
    scene = chain(["pin", "ball", "free"])
    scene["hinge"][0]["drive"] = "0.3 + 2*t"
    scene["hinge"][1]["initial"] = {"q": [0.6, 0, 0.8, 0], "u": [1, 2, 3]}
    q, u = compile_scene(scene).initial_state()
    assert q == pytest.approx([0.3, 0.6, 0, 0.8, 0, 0, 0, 0, 1, 0, 0, 0])
    assert u == pytest.approx([2, 1, 2, 3, 0, 0, 0, 0, 0, 0])
