"""Outputs of a scene: quantities and expressions of them, in results, files and measures."""

from __future__ import annotations

import csv
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import SceneError
from mstmm.pipeline.compilation import compile_level
from mstmm.runtime.engine.quantity_registry import SUMS
from mstmm.runtime.experiments.model_levels import with_model_level
from mstmm.runtime.experiments.model_reduction.advice_summary import with_available_outputs
from mstmm.runtime.experiments.model_reduction.beam_splitting import split_beams
from mstmm.runtime.result.result import Result
from mstmm.scene.checks.inputs import SCENE_QUANTITIES
from tests.support.scenes.minimal import body


def scene(*outputs: dict[str, Any], **tables: Any) -> mstmm.Scene:
    """Two rods, a motor on the first."""
    hinges = [
        {"name": "shoulder", "type": "pin", "inboard": "ground", "outboard": "rod1",
         "law": {"effort": "motor*cos(2*t)"}, "initial": {"q": [0.4]}},
        {"name": "elbow", "type": "ball", "inboard": "rod1.tip", "outboard": "rod2",
         "initial": {"u": [0.1, 0.2, 0.3]}},
    ]  # fmt: skip
    data: dict[str, Any] = {
        "gravity": [0, -9.81, 0], "body": [body("rod1"), body("rod2")], "hinge": hinges,
        "input": [{"name": "motor", "unit": "N m", "value": 2.0}], "constants": {"span": 2.0},
    }  # fmt: skip
    return mstmm.Scene(**data, **tables, output=outputs)


HEIGHT = {"name": "height", "of": "rod1.tip.y + rod2.tip.y/span", "unit": "m"}
OUTPUTS: tuple[dict[str, Any], ...] = (
    HEIGHT,
    {"name": "hand", "of": "rod2.tip.position"},
    {"name": "turn", "of": "rod2.orientation"},
    {"name": "pull", "of": "shoulder.fx", "unit": "newton"},
    {"name": "all", "of": "energy"},
    {"name": "push", "of": "momentum"},
    {"name": "lifted", "of": "where(rod2.tip.y > -1, 1, 0)"},
    {"name": "given", "of": "motor*cos(2*t)"},
    {"name": "first", "of": "shoulder.q[0]^2 + elbow.u[1]"},
)


@cache
def result() -> Result:
    times = np.linspace(0, 1, 11)
    return mstmm.compile(scene(*OUTPUTS), engine="looped").simulate(1.0, output_times=times)


def test_outputs_are_what_they_are_of() -> None:
    r = result()
    q, found = r.quantity, r.outputs()
    expected = {
        "height": q("rod1.tip.y").values + q("rod2.tip.y").values / 2,
        "hand": r.position("rod2.tip"), "turn": r.orientation("rod2"), "all": r.energy(),
        "pull": r.force("shoulder")[:, 0], "push": r.momentum(),
        "lifted": np.where(r.position("rod2.tip")[:, 1] > -1, 1.0, 0.0),
        "given": 2 * np.cos(2 * r.t), "first": r.q[:, 0] ** 2 + r.u[:, 2],
    }  # fmt: skip
    assert found.keys() == expected.keys() and 0 < found["lifted"].sum() < 11
    for name, values in expected.items():
        np.testing.assert_allclose(found[name], values, rtol=1e-14, atol=1e-14)


def test_outputs_have_units_labels_and_components() -> None:
    r = result()
    units = [r.quantity(name).unit for name in ("height", "hand", "pull", "all", "first")]
    assert units == ["m", "m", "newton", "J", ""]
    assert r.quantity("hand").labels == ("x", "y", "z")
    assert r.quantity("turn").labels == ("w", "x", "y", "z")
    np.testing.assert_array_equal(r.quantity("turn.w").values, r.orientation("rod2")[:, 0])
    np.testing.assert_array_equal(r.quantity("push.y").values, r.momentum()[:, 1])
    assert "height = rod1.tip.y + rod2.tip.y/span" in r.quantity("height").long_name
    assert {"height", "hand", "hand.z", "turn.w"} <= set(r.quantity_names())
    with pytest.raises(SceneError, match='did you mean "height"'):
        r.quantity("heigth")


def test_outputs_are_saved(tmp_path: Path) -> None:
    r = result()
    again = mstmm.load_result(r.save(tmp_path / "run.nc"))
    data = again.to_xarray()
    for name, values in again.outputs().items():
        np.testing.assert_array_equal(values, r.outputs()[name])
        np.testing.assert_array_equal(data[f"output_{name}"], values)
    assert data["output_hand"].dims == ("time", "axis") and data["output_pull"].units == "newton"
    with r.save(tmp_path / "run.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert float(rows[-1]["height [m]"]) == r.outputs()["height"][-1]
    assert float(rows[-1]["hand.x [m]"]) == r.outputs()["hand"][-1, 0]


def test_outputs_are_shown_where_nobody_chose() -> None:
    assert result().table().split()[:4] == ["t", "height", "hand.x", "hand.y"]


def test_the_error_of_an_output_can_be_asked_for() -> None:
    model = mstmm.compile(scene(HEIGHT), engine="looped")
    loose = model.simulate(1.0, error=mstmm.ErrorRequest(1e-4, of="height"))
    tight = model.simulate(1.0, rtol=1e-11, atol=1e-13, output_times=loose.t)
    assert loose.achieved_error is not None and "m of height" in str(loose.achieved_error)
    apart = loose.outputs()["height"] - tight.outputs()["height"]
    assert np.abs(apart).max() < 1e-4


def test_the_scene_is_written_as_it_is_read() -> None:
    given = scene(*OUTPUTS)
    assert mstmm.Scene.from_data(tomllib.loads(given.to_toml())) == given
    assert 'of = "rod1.tip.y + rod2.tip.y/span"' in given.to_toml()


def test_quantities_of_the_scene_are_known_by_name() -> None:
    assert {name.partition(".")[0] for name in SUMS} | {"work"} == set(SCENE_QUANTITIES)
    for wrong in (3, None, ["energy"]):
        with pytest.raises(SceneError, match="expected a name, such as energy"):
            result().quantity(wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("output", "says"),
    [
        ({"of": "rod3.tip.y"}, '"rod3.tip.y": there is no such quantity'),
        ({"of": "rod2.tip.yy + 1"}, '"rod2.tip.yy": there is no such quantity; did you mean'),
        ({"of": "shoulder.angel"}, 'did you mean "shoulder.angle"'),
        ({"of": "q"}, '"q": there is no such quantity'),
        ({"of": "2*rod2.tip.position"}, "has 3 components; use one of them, such as rod2.tip"),
        ({"of": "elbow.q[9]"}, '"elbow.q[9]": there is no such quantity'),
        ({"of": "2*span"}, "found '2*span', which is constant"),
        ({"of": "rod2.tip.y +"}, "of: "),
        ({"of": 3}, "expected a quantity of results or an expression of some, found 3"),
        ({"of": "height"}, '"height" is an output; write its expression'),
        ({"name": "rod2", "of": "energy"}, "also the name of a body, hinge or chain"),
        ({"name": "motor", "of": "energy"}, "also the name of an input"),
        ({"name": "energy", "of": "work"}, "is reserved for a quantity of results"),
        ({}, "of: missing; expected a quantity of results"),
    ],
)  # fmt: skip
def test_what_an_output_cannot_be(output: dict[str, Any], says: str) -> None:
    with pytest.raises(SceneError) as error:
        mstmm.compile(scene(HEIGHT, {"name": "new"} | output))
    assert says in str(error.value), str(error.value)
    assert f'output "{output.get("name", "new")}": ' in str(error.value)


# --- flexible bodies, and models of them ----------------------------------------------------------


def blade(*outputs: dict[str, Any]) -> mstmm.Scene:
    beam = {"name": "blade", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 40.0,
            "modes": {"y": 2}}  # fmt: skip
    pin = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "blade",
           "law": {"effort": "sin(3*t)"}}  # fmt: skip
    return mstmm.Scene(gravity=[0, 0, 0], beam=[beam], hinge=[pin], output=outputs)


BENT = {"name": "bent", "of": "blade.tip.deflection.y*1000", "unit": "mm"}
TIP = {"name": "tip", "of": "blade.tip.x"}


def test_a_lower_level_lacks_outputs_of_what_it_lacks(tmp_path: Path) -> None:
    given = blade(BENT, TIP, {"name": "slope", "of": "blade.tip.slope"})
    full = mstmm.compile(given).simulate(0.3)
    assert list(full.outputs()) == ["bent", "tip", "slope"]
    data = full.to_xarray()
    np.testing.assert_array_equal(data["output_slope_z"], full.outputs()["slope"][:, 1])
    rigid = mstmm.compile(given, flexibility="rigid").simulate(0.3)
    assert list(rigid.outputs()) == ["tip"]
    assert "output_tip" in rigid.to_xarray() and rigid.save(tmp_path / "rigid.csv").exists()
    with pytest.raises(SceneError, match="there is no such quantity"):
        rigid.quantity("bent")


def test_outputs_follow_a_beam_into_its_parts() -> None:
    split = split_beams(
        blade({"name": "reach", "of": "blade.tip.x - 0.5*blade.tip.x"}), ["blade"], 2
    )
    assert split.scene.output[0].of.text == "blade_2.tip.x - 0.5*blade_2.tip.x"
    mstmm.compile(split.scene)


def test_a_reduced_scene_keeps_the_outputs_that_it_has() -> None:
    reduced = with_available_outputs(with_model_level(blade(BENT, TIP), "rigid"), compile_level)
    assert [output.name for output in reduced.output] == ["tip"]
    assert list(mstmm.compile(reduced).simulate(0.1).outputs()) == ["tip"]


def test_names_of_four_parts_are_of_outputs_alone() -> None:
    event = {"when": "rod1.tip.velocity.x > 1", "do": "stop"}
    with pytest.raises(SceneError, match=r"has no end 'tip\.velocity'"):
        scene(event=[event])


@pytest.mark.parametrize("formula", ["sqrt(0 - 1 - t)", "1/(t - t)", "log(t)"])
def test_an_output_that_is_no_number_is_told(formula: str) -> None:
    scene = mstmm.Scene(
        gravity=(0, -9.81, 0), output=[{"name": "lost", "of": formula}],
        body=[{"name": "bob", "mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [1, 1, 1]}],
        hinge=[{"name": "pin", "type": "pin", "inboard": "ground", "outboard": "bob"}],
    )  # fmt: skip
    run = mstmm.compile(scene).simulate(0.1, certify=True)
    (risk,) = (one for one in run.risks if one.name == "not-finite")
    assert risk.element == 'output "lost"' and "first at t = 0 s" in risk.description
    assert run.success and not run.trusted and any("lost" in text for text in run.warnings)


def test_a_result_without_samples_has_outputs_of_none() -> None:
    scene = mstmm.Scene(
        gravity=(0, -9.81, 0), output=[{"name": "twice", "of": "2*pin.angle"}],
        body=[{"name": "bob", "mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [1, 1, 1]}],
        hinge=[{"name": "pin", "type": "pin", "inboard": "ground", "outboard": "bob"}],
    )  # fmt: skip
    run = mstmm.compile(scene).simulate(0.1, output_times=[])
    assert run.outputs()["twice"].shape == (0,) and not [x for x in run.risks if x.invalidates]
