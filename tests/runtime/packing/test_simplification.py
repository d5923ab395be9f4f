"""Bodies on fixed hinges packed as part of what holds them: the same results, under their names."""

from __future__ import annotations

import json
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from typer.testing import CliRunner

import mstmm
from mstmm.cli.app import app
from tests.reference.random_scenes import random_scene, random_state
from tests.support.models import non_link_simplifications

Array = NDArray[np.float64]
SEEDS = range(40, 52)
KINDS = ("pin", "fixed", "fixed", "ball", "prismatic", "free")
TOLERANCE = 1e-12
ROD = {"mass": 2.0, "center_of_mass": [0.5, 0, 0], "inertia": [0.001, 0.2, 0.2],
       "ends": {"tip": [1, 0, 0]}}  # fmt: skip


def worst(a: Any, b: Any) -> float:
    """The largest difference, as a part of the largest number."""
    a, b = np.asarray(a), np.asarray(b)
    return float(np.abs(a - b).max(initial=0.0) / max(np.abs(b).max(initial=0.0), 1e-30))


def merged_and_full_models(scene: mstmm.Scene, **options: Any) -> tuple[mstmm.Model, mstmm.Model]:
    """Models of the simplified scene, and of the scene as it is described."""
    options = {"engine": "looped"} | options
    return mstmm.compile(scene, **options), mstmm.compile(scene, simplify=False, **options)


HINGES: list[dict[str, Any]] = [
    {"name": "shoulder", "type": "pin", "inboard": "ground", "outboard": "rod1"},
    {"name": "weld", "type": "fixed", "inboard": "rod1.tip", "outboard": "rod2",
     "orientation": [0, 0, np.pi / 2]},
    {"name": "splice", "type": "fixed", "inboard": "rod2.tip", "outboard": "rod3"},
    {"name": "elbow", "type": "pin", "inboard": "rod3.tip", "outboard": "rod4"},
]  # fmt: skip


def arm(count: int = 4, **more: Any) -> mstmm.Scene:
    """Two pins; on the first rod a second one at right angles, on that a third one in line."""
    bodies = [ROD | {"name": f"rod{i}"} for i in range(1, count + 1)]
    scene: dict[str, Any] = {"gravity": [0, -9.81, 0], "body": bodies, "hinge": HINGES[:count]}
    return mstmm.Scene(**scene | more)


@pytest.mark.parametrize("seed", SEEDS)
def test_drawn_scenes_are_the_same(seed: int) -> None:
    print("seed", seed)
    scene = mstmm.Scene(**random_scene(seed, types=KINDS))
    few, all_ = merged_and_full_models(scene)
    merged = {one.elements for one in non_link_simplifications(few)}
    assert few.packed_scene.topology.count == len(scene.body) - len(merged)
    assert (
        few.coordinate_layout.q_names == all_.coordinate_layout.q_names
        and not non_link_simplifications(all_)
    )
    q, u = random_state(random_scene(seed, types=KINDS), seed)
    assert worst(few.accelerations(q, u, 0.3), all_.accelerations(q, u, 0.3)) < TOLERANCE
    assert worst(few.mass_matrix(q), all_.mass_matrix(q)) < TOLERANCE
    runs = [one.simulate(0.02, "rk4", step=0.005) for one in (few, all_)]
    for name in runs[0].quantity_names():
        values = [run.quantity(name).values for run in runs]
        size = max(np.abs(values[1]).max(initial=0.0), 1.0)
        assert np.abs(values[0] - values[1]).max(initial=0.0) <= 1e-10 * size, name
    assert worst(runs[0].q, runs[1].q) < TOLERANCE


def test_an_angle_of_welded_rods_falls_as_one_body() -> None:
    model = mstmm.compile(arm(3), engine="looped")
    assert [one.elements for one in non_link_simplifications(model)] == [
        ("weld", "rod2", "rod1"), ("splice", "rod3", "rod1"),
    ]  # fmt: skip
    centers = np.array([[0.5, 0.0], [1.0, 0.5], [1.0, 1.5]])
    inertia = sum(0.2 + 2.0 * c @ c for c in centers)
    moment = 9.81 * 2.0 * centers[:, 0].sum()
    still = np.zeros(1)
    assert model.accelerations(still, still)[0] == pytest.approx(-moment / inertia, rel=1e-14)
    assert model.inverse_dynamics(still, still, still)[0] == pytest.approx(moment, rel=1e-14)


def test_the_load_of_a_hinge_that_welds_one_body() -> None:
    """Of what hangs behind it, held still by drives: its weight, and the moment of that."""
    held = [one | ({"drive": ["0"]} if one["type"] == "pin" else {}) for one in HINGES]
    model = mstmm.compile(arm(hinge=held), engine="looped")
    assert len(non_link_simplifications(model)) == 2
    result = model.simulate(0.1, "rk4", step=0.05)
    weight = 2.0 * 9.81
    assert result.force("weld")[-1] == pytest.approx([0, 3 * weight, 0], abs=1e-12)
    # the last rod goes on upwards: all of them stand over the weld
    assert result.quantity("weld.moment").values[-1] == pytest.approx([0, 0, 0], abs=1e-12)
    assert result.position("rod3.tip")[-1] == pytest.approx([1, 2, 0], abs=1e-14)


@pytest.mark.parametrize(
    "stays",
    [
        {"output": [{"name": "strain", "of": "weld.moment.z"}]},
        {"event": [{"do": "release", "hinge": "weld", "when": "rod4.y < 0"}]},
    ],
)
def test_a_hinge_that_is_asked_of_or_lets_go_stays(stays: dict[str, Any]) -> None:
    model = mstmm.compile(arm(**stays), engine="looped")
    assert [one.elements[0] for one in non_link_simplifications(model)] == ["splice"]
    assert non_link_simplifications(model)[0].elements == ("splice", "rod3", "rod2")


def test_parameters_of_a_body_that_is_part_of_another() -> None:
    few, all_ = merged_and_full_models(arm())
    changes = {"rod2.mass": 5.0, "rod3.center_of_mass[1]": 0.2, "rod2.ends.tip.position[0]": 1.3}
    q, u = np.array([0.3, -0.4]), np.array([1.0, 2.0])
    there = [one.with_parameters(changes) for one in (few, all_)]
    assert len(non_link_simplifications(there[0])) == 2 and not non_link_simplifications(there[1])
    assert worst(there[0].accelerations(q, u), there[1].accelerations(q, u)) < TOLERANCE
    assert worst(there[0].accelerations(q, u), few.accelerations(q, u)) > 0.01
    again = pickle.loads(pickle.dumps(there[0]))
    assert non_link_simplifications(again) == non_link_simplifications(there[0])
    masses = np.array([1.0, 4.0])
    runs = [one.simulate_batch((q, u), {"rod2.mass": masses}, t_end=0.1, method="rk4", step=0.01)
            for one in (few, all_)]  # fmt: skip
    assert worst(runs[0].q, runs[1].q) < TOLERANCE
    slopes = [one.derivatives(q, u, parameters=["rod2.mass"]) for one in (few, all_)]
    assert worst(*(one.parameters["rod2.mass"] for one in slopes)) < 1e-11
    assert worst(*(one.q for one in slopes)) < 1e-11 and worst(*(one.u for one in slopes)) < 1e-11


def test_what_acts_on_a_part_acts_on_the_whole() -> None:
    """Loads along its axes, springs, bushings, events and controllers that read where it is."""
    few, all_ = merged_and_full_models(
        arm(
            load=[{"name": "push", "on": "rod2.tip", "force": [1, "sin(t)", 0], "axes": "body"},
                  {"name": "turned", "on": "rod4", "force": [3, 0, 0], "axes": "rod3"}],
            spring=[{"name": "rope", "from": "rod2", "to": "rod4.tip", "law": {"stiffness": 30}}],
            bushing=[{"name": "mount", "from": "rod3", "to": "ground", "stiffness": [5] * 6}],
            event=[{"when": "rod3.tip.y < 1.9", "do": "stop"}],
        )
    )  # fmt: skip
    assert len(non_link_simplifications(few)) == 2
    runs = [one.simulate(2.0, rtol=1e-11, atol=1e-13) for one in (few, all_)]
    assert runs[0].position("rod3.tip")[-1, 1] == pytest.approx(1.9, abs=1e-9)
    assert runs[0].t[-1] == pytest.approx(runs[1].t[-1], rel=1e-9)
    for name in ("push.power", "rope.length", "rod2.velocity", "weld.force", "energy"):
        values = [run.quantity(name).values[-1] for run in runs]
        assert values[0] == pytest.approx(values[1], rel=1e-8, abs=1e-9), name


def test_words_that_are_none_are_refused() -> None:
    with pytest.raises(mstmm.SceneError, match=r"simplify: expected True.*; found 'weld'"):
        mstmm.compile(arm(), simplify=["weld"])
    assert len(non_link_simplifications(mstmm.compile(arm(), simplify=["welds"]))) == 2
    for wrong in (None, 1, [["welds"]]):
        with pytest.raises(mstmm.SceneError, match=r"simplify = .*: expected a list of names"):
            mstmm.compile(arm(), simplify=wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize("word", ["welds", "links"])
def test_what_is_done_or_not_is_said_by_true_or_false(word: str) -> None:
    for wrong in ("no", 1e-3, None, 2):
        with pytest.raises(mstmm.SceneError, match=f"simplify: {word}: expected True or False"):
            mstmm.compile(arm(), simplify={word: wrong})
    for given in (0, 1, False, True):
        merged = len(non_link_simplifications(mstmm.compile(arm(), simplify={word: given})))
        assert merged == (0 if word == "welds" and not given else 2)


def test_where_loops_are_closed_nothing_is_merged_but_couplings_couple_parts() -> None:
    row = {"name": "follows", "expression": "shoulder.q^2 + elbow.q", "equals": 0.9}
    few, all_ = merged_and_full_models(arm(coupling=[row]))
    assert len(non_link_simplifications(few)) == 2 and few.loops == all_.loops
    runs = [one.simulate(0.3, rtol=1e-11, atol=1e-13) for one in (few, all_)]
    for name in ("weld.force", "splice.moment", "rod3.tip.position", "rod2.momentum"):
        values = [run.quantity(name).values[-1] for run in runs]
        assert values[0] == pytest.approx(values[1], rel=1e-8, abs=1e-8), name
    ring = [
        {"name": "wrist", "type": "pin", "inboard": "rod4.tip", "outboard": "rod5",
         "orientation": [0, 0, -np.pi / 2]},
        {"name": "ring", "type": "pin", "inboard": "ground", "outboard": "rod5.tip",
         "position": [2, 3, 0], "orientation": [0, 0, -0.3]},
    ]  # fmt: skip
    bodies = [ROD | {"name": f"rod{i}"} for i in (1, 2, 3, 4, 5)]
    closed = mstmm.compile(arm(body=bodies, hinge=[*HINGES, *ring]), engine="looped")
    assert closed.loops.mobility == 1 and not non_link_simplifications(closed)


@pytest.mark.parametrize("level", ["coupled", "one-way"])
def test_flexible_bodies_hang_on_parts(level: str) -> None:
    """Of a beam on a part, with parts at its tip; behind an elastic response nothing is merged."""
    beam = {"name": "blade", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 100.0,
            "modes": {"y": 2}}  # fmt: skip
    root = {"name": "root", "type": "fixed", "inboard": "rod3.tip", "outboard": "blade.root"}
    tip = [{"name": "hold", "type": "fixed", "inboard": "blade.tip", "outboard": "rod5"},
           {"name": "on", "type": "fixed", "inboard": "rod5.tip", "outboard": "rod4"}]  # fmt: skip
    bodies = [ROD | {"name": f"rod{i}"} for i in (1, 2, 3, 4, 5)]
    scene = arm(body=bodies, beam=[beam], hinge=[*HINGES[:3], root, *tip])
    few, all_ = merged_and_full_models(scene, flexibility=level)
    merged = [one.elements[1:] for one in non_link_simplifications(few)]
    expected = [("rod2", "rod1"), ("rod3", "rod1"), ("rod4", "rod5")]
    assert merged == (expected if level == "coupled" else [])
    q, u = few.initial_state()
    assert worst(few.accelerations(q, u), all_.accelerations(q, u)) < 1e-11
    if level == "coupled":
        shares = [one.linearize(q, u).modes().kinetic_energy_shares() for one in (few, all_)]
        assert shares[0].keys() == shares[1].keys() and "rod4" in shares[0]
        assert worst(*(list(share.values()) for share in shares)) < 1e-9


def test_the_classical_method_has_its_own_matrices_for_every_body() -> None:
    few, all_ = merged_and_full_models(arm())
    runs = [one.simulate(0.1, "dttmm-classical", step=0.01) for one in (few, all_)]
    assert np.array_equal(runs[0].q, runs[1].q)


def test_runs_say_what_is_packed_otherwise(tmp_path: Path) -> None:
    runner, file = CliRunner(), tmp_path / "arm.toml"
    file.write_text(arm().to_toml())
    done = runner.invoke(app, ["check", str(file)])
    line = 'body "rod2": merged into "rod1", as hinge "weld" between them is fixed'
    assert done.exit_code == 0 and line in done.output
    for options, there in (((), True), (("--no-simplify",), False)):
        asked = ["simulate", str(file), "--t-end", "0.01", "--json", *options]
        done = runner.invoke(app, [*asked, "--output", str(tmp_path / "arm.csv")])
        kinds = {one["kind"] for one in json.loads(done.stdout)["simplifications"]}
        assert ("welds" in kinds) == ("links" in kinds) == there
