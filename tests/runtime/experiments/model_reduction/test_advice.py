"""What an advice is where there is little to say, what it refuses, and what it writes."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

import mstmm
from mstmm.runtime.experiments.model_reduction.advice_state import advice_request
from mstmm.runtime.experiments.model_reduction.advise import make_advice
from mstmm.runtime.experiments.model_reduction.body_models import body_predictions
from mstmm.runtime.experiments.model_reduction.trial_models import ComparisonWindow
from mstmm.runtime.experiments.runs import Budget
from tests.support.scenes.advice import TIP, hub_and_beam, period
from tests.support.scenes.chart import Clock, hub, pendulum


def test_nothing_to_reduce_is_an_answer() -> None:
    made = mstmm.advise(pendulum(), 1.0, error=1e-4, of="bob.tip.position", rounds=0, budget=600)
    assert made.bodies == ()
    assert not made.is_reduced
    assert any("nothing to reduce" in note for note in made.notes)
    assert made.error <= 1e-4
    assert made.scene == pendulum()


def test_bodies_that_respond_no_way_but_coupled() -> None:
    """A viscous drag is refused below the coupled level: the richest model itself tells."""
    made = mstmm.advise(
        hub(drag=0.5), 1.2, error=1e-2, of="blade.tip.position", rounds=0, budget=600
    )
    (body,) = made.bodies
    assert body.evidence is not None
    assert body.evidence.deflection == pytest.approx(1.07e-2, rel=0.01)
    assert body.model.is_coupled
    assert made.error <= 1e-2
    refused = [one for one in made.tried_models if one.error is None]
    assert refused == [] or all("drag" in one.reason for one in refused)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"error": 0}, "above 0 and below 1"),
        ({"error": 1.0}, "above 0 and below 1"),
        ({"error": float("nan")}, "error"),
        ({"error": "small"}, "error"),
        ({"error": 0, "of": TIP}, "in the unit of the quantity"),
        ({"of": 3}, "expected the name of a quantity"),
        ({"of": [TIP, 3]}, "expected the name of a quantity"),
        ({"of": "arm.tip.positon"}, "did you mean"),
        ({"t_end": 0}, "a time in s above 0"),
        ({"budget": -1}, "a time in s above 0"),
        ({"samples": 1}, "2 or more"),
        ({"rounds": -1}, "0 or more"),
    ],
)
def test_bad_input(arguments: dict[str, object], words: str) -> None:
    with pytest.raises(mstmm.SceneError, match=words):
        mstmm.advise(hub_and_beam("B", 1), **({"t_end": 0.5} | arguments))  # type: ignore[arg-type]


def test_no_scene() -> None:
    with pytest.raises(mstmm.SceneError, match="expected a Scene"):
        mstmm.advise("scene.toml")  # type: ignore[arg-type]


def test_a_scene_that_fails_says_why() -> None:
    """A force that grows beyond all numbers."""
    scene = mstmm.Scene(
        gravity=[0, 0, 0],
        body=[{"name": "bob", "mass": 1.0, "inertia": [1.0, 1.0, 1.0]}],
        hinge=[{"name": "rail", "type": "prismatic", "inboard": "ground", "outboard": "bob",
                "law": {"effort": "1/(0.5 - t)^3"}}],
    )  # fmt: skip
    with pytest.raises(mstmm.NumericalFailure, match="t = "):
        mstmm.advise(scene, 1.0, rounds=0, budget=600)


def test_the_scene_that_is_written(tmp_path: Path) -> None:
    made = mstmm.advise(hub_and_beam("B", 2), period("B"), error=1e-3, of=TIP, rounds=0, budget=600)
    path = made.save_scene(tmp_path / "small.toml")
    text = path.read_text()
    assert text.startswith("# Reduced for an error of 0.001 m of arm.tip.position")
    assert f"--method {made.method}" in text
    assert "# arm: " in text
    scene = mstmm.load_scene(path)
    assert scene == mstmm.Scene.from_data(tomllib.loads(made.scene.to_toml()))
    assert mstmm.compile(scene, engine="looped").simulate(0.1).success


def test_an_error_of_a_quantity_has_its_unit() -> None:
    made = mstmm.advise(
        hub_and_beam("B", 1), period("B"), error=20.0, of="root.force", rounds=0, budget=600
    )
    assert (made.unit, made.target_error) == ("N", 20.0)
    assert made.error <= 20.0


def test_what_is_written_is_toml(tmp_path: Path) -> None:
    made = mstmm.advise(pendulum(), 0.2, rounds=0, budget=600)
    with pytest.raises(mstmm.SceneError, match=r"ends in \.toml"):
        made.save_scene(tmp_path / "small.json")


def test_as_plain_values() -> None:
    made = mstmm.advise(hub_and_beam("B", 2), period("B"), error=1e-3, of=TIP, rounds=0, budget=600)
    data = json.loads(made.to_json())
    assert data["method"] == made.method
    assert data["bodies"][0]["advised"]["shapes"] == {"y": 1}
    assert data["bodies"][0]["evidence"]["coupling"] == pytest.approx(0.061, rel=0.01)
    assert {one["name"] for one in data["tried"]} >= {"the richest model", "as given"}


def test_a_window_where_the_whole_run_takes_too_long() -> None:
    """By a clock of which a tenth of the budget passes at each look."""
    model = mstmm.compile(hub_and_beam("B", 2), engine="looped")
    asked = advice_request(period("B"), 1e-2, TIP, 100.0, 51, 0)
    said: list[str] = []
    made = make_advice(
        model, asked, lambda scene: mstmm.compile(scene, engine="looped"), lambda _: None,
        said.append, Budget(100.0, Clock(0.4)),
    )  # fmt: skip
    assert not made.covers_whole_run
    assert "the first" in made.comparison_text
    assert any("errors times" in text for text in said)


def test_errors_of_a_window_grow_with_time() -> None:
    span = ComparisonWindow(0.5, 2.0)
    assert not span.is_whole_run
    assert span.growth == 4.0
    assert ComparisonWindow(2.0, 2.0).is_whole_run
    assert np.isclose(ComparisonWindow(2.0, 2.0).growth, 1.0)


def test_what_deflects_after_a_window() -> None:
    """A push that is ten times stronger from 1 s on."""
    scene = hub_and_beam("B", 1).model_dump(by_alias=True, exclude_none=True)
    push = {"effort": "where(t < 1, 0.5, 5)*sin(2*pi*t/0.5)"}
    axle = scene["hinge"][0] | {"law": push}
    model = mstmm.compile(
        mstmm.Scene(**scene | {"hinge": [axle, scene["hinge"][1]]}), "looped",
        flexibility="one-way",
    )  # fmt: skip
    result = model.simulate(2.0, output_times=np.linspace(0, 2, 101))
    known = body_predictions(result, 1.0)["arm"]
    assert 5 < known.rise(0.9) < 15
    assert known.rise(2.0) == 1.0
