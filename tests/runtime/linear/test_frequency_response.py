"""Frequency responses: against dense solutions, closed forms and a long run under a sine."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import NumericalFailure, SceneError
from mstmm.runtime.engine.tangent_matrix import HarmonicResponse, TangentMatrix
from mstmm.runtime.linear.linear_model import Linear
from tests.reference import random_scenes
from tests.reference.jets import Array
from tests.support.models import looped_model
from tests.support.paths import EXAMPLES
from tests.support.scenes import random_flexible as engine_scenes
from tests.support.work import calls

Scene = dict[str, Any]
OMEGA = np.array([0.3, 10.0, 1.0, 2.7, 100.0])
UNIT = 2.0**-53


def linear_model_at(scene: Scene, q: Array, t: float = 0.3) -> Linear:
    """The linear model near q, at rest there."""
    model = looped_model(scene)
    return model.linearize(q, np.zeros(model.nu), t)


def check_dense(linear: Linear) -> None:
    """Amplitudes under accelerations of the ground, by the sweep and by matrices."""
    found = linear.frequency_response(OMEGA)
    assert found.output_names == linear.coordinate_names
    for omega, values in zip(OMEGA, found.response, strict=True):
        z = linear.K + 1j * omega * linear.C - omega**2 * linear.M
        expected = np.linalg.solve(z, linear.W)
        size = np.abs(expected).max()
        bound = max(1e-10, 100 * UNIT * float(np.linalg.cond(z)))
        assert np.abs(values - expected).max() <= bound * size, omega


@pytest.mark.parametrize("seed", [0, 1, 3, 4, 5, 7, 8, 9])
def test_trees_with_springs_between_bodies(seed: int) -> None:
    scene = random_scenes.random_scene(seed)
    check_dense(linear_model_at(scene, random_scenes.random_state(scene, seed)[0]))


@pytest.mark.parametrize("seed", range(8))
def test_flexible_bodies(seed: int) -> None:
    scene, q, _ = engine_scenes.seeded_scene(seed, False, 3)
    for hinge in scene["hinge"]:
        if "drive" in hinge:
            hinge["drive"] = [x if x == "free" else "0.4" for x in hinge["drive"]]
    check_dense(linear_model_at(scene, q))


@pytest.mark.parametrize("name", ["satellite_panels", "elastic_link", "three_pin_arm_springs"])
def test_examples(name: str) -> None:
    model = mstmm.compile(mstmm.load_scene(EXAMPLES / name / "scene.toml"), engine="looped")
    check_dense(model.linearize(model.initial_state()[0]))


def chain(count: int, damping: float = 0.5) -> Scene:
    """Rods hanging from pins with springs."""
    rod = {"mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [0.01, 1 / 12, 1 / 12],
           "ends": {"tip": [1, 0, 0]}}  # fmt: skip
    law = {"stiffness": 200.0, "damping": damping}
    hinge = {"type": "pin", "axis": [0, 0, 1], "law": law}
    return {
        "gravity": [0, -9.81, 0],
        "chain": [{"name": "rope", "count": count, "inboard": "ground",
                   "orientation": [0, 0, -np.pi / 2], "body": rod, "hinge": hinge}],
    }  # fmt: skip


def test_a_chain_of_500() -> None:
    check_dense(looped_model(chain(500)).linearize(np.zeros(500)))


def test_a_frequency_costs_a_fixed_share_a_body() -> None:
    """No matrix: as many numbers for each of many bodies as of few, and no Python for any."""
    kept, called = [], []
    for count in (50, 2000):
        linear = looped_model(chain(count)).linearize(np.zeros(count), disturbances=())
        outputs = [linear.coordinate_names[-1]]

        def response_calls(
            points: int, linear: Linear = linear, outputs: list[str] = outputs
        ) -> int:
            omega = np.linspace(1, 2, points)
            return calls(
                lambda: linear.frequency_response(omega, ["rope[0].hinge.effort"], outputs)
            )

        engine = linear.model.looped
        numbers = len(TangentMatrix(engine).numbers) + engine.packed.workspace
        kept.append(numbers / count)
        called.append(response_calls(9) - response_calls(1))
    assert kept[1] <= kept[0] and called[0] == called[1] == 0


def test_two_and_four_frequencies_at_a_time() -> None:
    scene = random_scenes.random_scene(5)
    q, _ = random_scenes.random_state(scene, 5)
    engine = mstmm.compile(mstmm.Scene(**scene), engine="looped").looped
    still, columns = np.zeros(engine.nu), np.eye(engine.nu)
    few, many = (
        HarmonicResponse(engine, 0.3, q, still, still, lanes).amplitudes(1j * OMEGA, columns)[0]
        for lanes in (2, 4)
    )
    assert np.abs(few - many).max() < 1e-12 * np.abs(few).max()


# --- closed forms -----------------------------------------------------------------------------


def masses(*links: tuple[float, float, float]) -> Scene:
    """Masses in a row on x with (mass, stiffness, damping) of the spring before each."""
    bodies = [
        {"name": f"m{k}", "mass": m, "inertia": [1, 1, 1]} for k, (m, _, _) in enumerate(links)
    ]
    hinges = [
        {"name": f"s{k}", "type": "prismatic", "inboard": f"m{k - 1}" if k else "ground",
         "outboard": f"m{k}", "axis": [1, 0, 0], "law": {"stiffness": c, "damping": d}}
        for k, (_, c, d) in enumerate(links)
    ]  # fmt: skip
    return {"gravity": [0, 0, 0], "body": bodies, "hinge": hinges}


def test_an_oscillator_with_its_rates_and_ends() -> None:
    m, k, d = 2.0, 50.0, 0.3
    model = looped_model(masses((m, k, d)))
    outputs = ["s0.displacement", "s0.displacement_rate", "s0.displacement_acceleration",
               "m0.position.x", "m0.vx", "m0.acceleration.x", "m0.y"]  # fmt: skip
    omega = np.array([0.1, 5.0, 4.9999, 700.0])
    found = model.frequency_response(
        omega, ["s0.effort", "m0.fx", "ground.acceleration.x"], outputs
    )
    assert found.output_units == ("m", "m/s", "m/s2", "m", "m/s", "m/s2", "m")
    assert found.input_units == ("N", "N", "m/s2")
    for row, w in zip(found.response, omega, strict=True):
        x = 1 / (k + 1j * w * d - w**2 * m)
        v, a = 1j * w * x, -(w**2) * x
        expected = np.outer([x, v, a, x, v, a, 0], [1, 1, -m])
        np.testing.assert_allclose(row, expected, rtol=1e-13, atol=1e-300)
    np.testing.assert_array_equal(found.magnitude, np.abs(found.response))
    assert found.phase[-1, 0, 0] < -3.1  # far above the resonance it moves against the push


def test_ends_go_along_with_coordinates() -> None:
    """A rod of length 2 at rest at 0.4 rad: its tip moves across it."""
    body = {"name": "rod", "mass": 1.0, "center_of_mass": [1, 0, 0], "inertia": [1, 1, 1],
            "ends": {"tip": [2, 0, 0]}}  # fmt: skip
    hinge = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod",
             "axis": [0, 0, 1], "law": {"stiffness": 9.0, "damping": 0.1}}  # fmt: skip
    model = looped_model({"gravity": [0, 0, 0], "body": [body], "hinge": [hinge]})
    outputs = ["pin.angle", "rod.tip.x", "rod.tip.vy", "rod.wz", "rod.alphaz"]
    found = model.frequency_response([1.5], ["rod.tip.mz"], outputs, q=[0.4]).response[0, :, 0]
    angle = 1 / (9.0 + 0.15j - 1.5**2 * 2.0)
    expected = [1, -2 * np.sin(0.4), 1.5j * 2 * np.cos(0.4), 1.5j, -(1.5**2)]
    np.testing.assert_allclose(found, angle * np.array(expected), rtol=1e-13)


@pytest.mark.parametrize("omega", [10.0, 10.0 * (1 + 1e-12), 10.0 * (1 - 1e-9)])
def test_an_absorber_at_its_own_frequency(omega: float) -> None:
    """Held fast, what hangs outboard resonates there; the whole scene does not."""
    model = looped_model(masses((3.0, 70.0, 0.0), (1.0, 100.0, 0.0), (0.5, 20.0, 0.0)))
    beside = [3.0, omega, 11.0, 4.0, 7.0]
    linear = model.linearize(inputs=["s0.effort"])
    for w, found in zip(beside, linear.frequency_response(beside).response[:, :, 0], strict=True):
        expected = np.linalg.solve(linear.K - w**2 * linear.M, np.eye(3)[0])
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-13)
    two = looped_model(masses((3.0, 70.0, 0.0), (1.0, 100.0, 0.0)))
    first, apart = two.frequency_response([omega], ["s0.effort"]).response[0, :, 0]
    assert abs(first) < 1e-9
    assert abs(first + apart - -0.01) < 1e-9  # x2 = -F / k2


@pytest.mark.parametrize("turned", [0.0, 0.7])
@pytest.mark.parametrize("output", ["m0.x", "m0.vx", "m0.ax", "s0.displacement", "twice", "m0.z"])
def test_a_response_that_is_zero_is_an_answer(output: str, turned: float) -> None:
    """At omega^2 = k2/m2 the first mass stands still: x1 = 0, x2 = -F/k2 (an antiresonance)."""
    scene = masses((2.0, 70.0, 0.0), (3.0, 50.0, 0.0))
    along = [float(np.cos(turned)), float(np.sin(turned)), 0.0]
    scene["hinge"] = [hinge | {"axis": along} for hinge in scene["hinge"]]
    scene["output"] = [{"name": "twice", "of": "2*s0.displacement"}]
    omega = float(np.sqrt(50 / 3))
    linear = looped_model(scene).linearize(inputs=["s0.effort"])
    found = linear.frequency_response([omega], outputs=[output]).response[0, 0, 0]
    assert abs(found) < 1e-12  # m, m/s, m/s2 a N


def test_equal_masses_beside_each_other_do_not_move_apart() -> None:
    """Two equal masses, each with an absorber, that one ground shakes: x1 - x2 = 0 at any
    frequency, at that of the absorbers too."""
    both = masses((2.0, 70.0, 0.0), (3.0, 50.0, 0.0))
    scene: Scene = {"gravity": [0, 0, 0], "body": [], "hinge": []}
    for side in "lr":
        scene["body"] += [body | {"name": side + body["name"]} for body in both["body"]]
        for hinge in both["hinge"]:
            ends = {"inboard": hinge["inboard"], "outboard": side + hinge["outboard"]}
            ends["inboard"] = "ground" if ends["inboard"] == "ground" else side + ends["inboard"]
            scene["hinge"].append(hinge | ends | {"name": side + hinge["name"]})
    scene["output"] = [{"name": "apart", "of": "ls0.displacement - rs0.displacement"}]
    omega = float(np.sqrt(50 / 3))
    found = looped_model(scene).frequency_response(
        [omega, 3.0], ["ground.acceleration.x"], ["apart"]
    )
    assert np.abs(found.response).max() < 1e-12


@pytest.mark.parametrize("output", ["s0.displacement", "s1.displacement", "m1.ax"])
def test_a_resonance_is_refused_whatever_is_read(output: str) -> None:
    scene = masses((2.0, 70.0, 0.0), (3.0, 50.0, 0.0))
    omega = float(looped_model(scene).modes().omega[1])
    with pytest.raises(NumericalFailure, match="is an undamped resonance"):
        looped_model(scene).frequency_response([omega], ["s0.effort"], [output])


def test_a_long_run_under_a_sine() -> None:
    omega, push = 3.0, 1e-4
    scene = chain(3, damping=4.0)
    linear = looped_model(scene).linearize(np.zeros(3), inputs=["rope[1].tip.fx"])
    outputs = ["rope[2].tip.x", "rope[0].tip.vx"]
    found = linear.frequency_response([omega], outputs=outputs).response[0, :, 0]
    load = {"on": "rope[1].tip", "force": [f"{push}*sin({omega}*t)", 0, 0]}
    times = 200.0 + np.linspace(0, 2 * np.pi / omega, 41)
    run = looped_model({**scene, "load": [load]}).simulate(
        times[-1], rtol=1e-10, atol=1e-14, output_times=times
    )
    turns = np.stack([np.sin(omega * times), np.cos(omega * times), np.ones_like(times)], axis=1)
    for name, expected in zip(outputs, found, strict=True):
        sine, cosine, _ = np.linalg.lstsq(turns, run.quantity(name).values, rcond=None)[0]
        assert abs((sine + 1j * cosine) / push - expected) < 1e-8 * abs(expected), name


# --- what is refused --------------------------------------------------------------------------


def test_a_resonance_without_damping_is_named() -> None:
    model = looped_model(masses((2.0, 50.0, 0.0)))
    with pytest.raises(
        NumericalFailure, match=r'omega = 5 rad/s is an undamped resonance.*hinge "s0"'
    ):
        model.frequency_response([1.0, 5.0])


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (([],), "omega is empty"),
        (([1.0, 0.0],), "omega = 0: expected angular frequencies above 0"),
        (([1e154],), r"omega = 1e\+154: expected angular frequencies above 0 and below 1e\+100"),
        (([np.nan],), "omega = nan"),
        ((["fast"],), "expected angular frequencies"),
        (([1.0], ["s0.efort"]), '"s0.efort": expected an effort'),
        (([1.0], []), "inputs is empty"),
        (([1.0], "s0.effort"), "expected a list of names"),
        (([1.0], None, ["m0.vxx"]), '"m0.vxx": expected a coordinate.*m0'),
        (([1.0], None, ["m1.x"]), '"m1.x": expected a coordinate'),
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_refused(arguments: tuple[Any, ...], expected: str) -> None:
    model = looped_model(masses((2.0, 50.0, 0.1)))
    with pytest.raises(SceneError, match=expected):
        model.frequency_response(*arguments)


def test_speeds_of_ends_are_refused_in_motion() -> None:
    linear = looped_model(masses((2.0, 50.0, 0.1))).linearize([0.1], [1.0])
    linear.frequency_response([1.0], outputs=["s0.displacement_rate", "m0.x"])
    with pytest.raises(SceneError, match=r'"m0\.vx": at a moving state'):
        linear.frequency_response([1.0], outputs=["m0.vx"])
    scene = random_scenes.random_scene(0, 3, types=("ball",), loads=False)
    q, u = random_scenes.random_state(scene, 0)
    turning = mstmm.compile(mstmm.Scene(**scene), engine="looped").linearize(q, u)
    with pytest.raises(SceneError, match="or a state at rest"):
        turning.frequency_response([1.0])
