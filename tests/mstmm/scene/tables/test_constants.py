"""Named constants, and numbers that are written as constant expressions."""

from __future__ import annotations

import math
import pickle
import tomllib
from typing import Any

import pytest

from mstmm.errors import SceneError
from mstmm.scene import Scene
from tests.support.scenes.minimal import Data, beam, body, hinge, one_rod


def rod(constants: Any = None, **changes: Any) -> Data:
    """A rod on a pin; `changes` are to the body."""
    data: Data = {"gravity": [0, -9.81, 0], "body": [body(**changes)], "hinge": [hinge()]}
    return data if constants is None else {**data, "constants": constants}


def reload_scene(scene: Scene) -> Scene:
    return Scene.from_data(tomllib.loads(scene.to_toml()))


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("pi/6", math.pi / 6),
        ("30*deg", math.pi / 6),
        ("-90*deg", -math.pi / 2),
        ("sqrt(2)/2", math.sqrt(2) / 2),
        ("1/3 + 1e-3", 1 / 3 + 1e-3),
        ("deg", math.pi / 180),
        ("2*2^0.5", 2 * 2**0.5),
    ],
)
def test_a_number_may_be_a_constant_expression(text: str, value: float) -> None:
    scene = Scene.from_data(one_rod(initial={"q": [text]}))
    assert scene.hinge[0].initial is not None and scene.hinge[0].initial.q is not None
    assert scene.hinge[0].initial.q[0] == pytest.approx(value, rel=4e-16)
    assert reload_scene(scene) == scene


def test_numbers_and_expressions_name_constants() -> None:
    constants = {"half": 0.5, "whole": "2*half", "w": "sqrt(9.81/half)"}
    data = rod(constants, mass="2*half", ends={"tip": ["whole", 0, 0]})
    data["gravity"] = [0, "-9.81*whole", 0]
    data["hinge"] = [hinge(law={"effort": "half*sin(w*t)", "stiffness": "half"})]
    data["load"] = [{"on": "rod1.tip", "force": [0, "where(t < half, 1, whole)", 0]}]
    scene = Scene.from_data(data)
    assert scene.constants == {"half": 0.5, "whole": 1.0, "w": math.sqrt(9.81 / 0.5)}
    assert scene.body[0].mass == 1.0 and scene.gravity == (0.0, -9.81, 0.0)
    assert scene.body[0].ends["tip"].position == (1.0, 0.0, 0.0)
    assert scene.load[0].force[1].time_breaks() == (0.5,)
    effort = scene.hinge[0].law.effort[0]
    assert [name.text for name in effort.names] == ["t"]
    assert effort.evaluate(lambda _: 0.2) == pytest.approx(0.5 * math.sin(constants_w() * 0.2))
    text = scene.to_toml()
    assert 'mass = "2*half"' in text and 'whole = "2*half"' in text
    assert '"half*sin(w*t)"' in text and reload_scene(scene) == scene


def constants_w() -> float:
    return math.sqrt(9.81 / 0.5)


def test_expressions_of_other_constants_are_other_expressions() -> None:
    one_, two = (
        Scene.from_data({**rod({"k": k}), "hinge": [hinge(law={"effort": "k*t"})]})
        for k in (1.0, 2.0)
    )
    assert one_.hinge[0].law.effort[0].text == two.hinge[0].law.effort[0].text
    assert one_.hinge[0].law.effort != two.hinge[0].law.effort


def test_normalised_quaternions_keep_how_they_are_written() -> None:
    data = one_rod(orientation=[1, 0, 0, "half"])
    scene = Scene.from_data({**data, "constants": {"half": 0.5}})
    length = math.hypot(1.0, 0.5)
    assert scene.hinge[0].orientation == pytest.approx((1 / length, 0, 0, 0.5 / length))
    assert 'orientation = [1.0, 0.0, 0.0, "half"]' in scene.to_toml()
    assert reload_scene(scene) == scene


def test_beams_take_them_everywhere() -> None:
    table = beam(
        length="3*k", mass_per_length="k", bending_stiffness=..., ends={"mid": "1.5*k"},
        section=[
            {"from": 0, "to": "1.5*k", "bending_stiffness": ["1e3*k", 1e3]},
            {"from": "1.5*k", "to": "3*k", "bending_stiffness": "1e3*k"},
        ],
    )  # fmt: skip
    held = {"name": "hub", "type": "fixed", "inboard": "ground", "outboard": "blade"}
    scene = Scene.from_data(
        {"gravity": [0, 0, 0], "constants": {"k": 2.0}, "beam": [table], "hinge": [held]}
    )
    assert scene.beam[0].length == 6.0 and scene.beam[0].ends["mid"].position[0] == 3.0
    assert reload_scene(scene) == scene


def test_a_written_number_survives_pickling() -> None:
    scene = Scene.from_data(rod({"half": 0.5}, mass="2*half"))
    copied = pickle.loads(pickle.dumps(scene.body[0].mass))
    assert copied == 1.0 and copied.text == "2*half"


@pytest.mark.parametrize("mass", ["2", "2.0", "1+1", " 2e0 ", "+2"])
def test_a_number_in_quotes_is_a_constant_expression(mass: str) -> None:
    scene = Scene.from_data(rod({}, mass=mass))
    assert scene.body[0].mass == 2.0 and reload_scene(scene) == scene


@pytest.mark.parametrize(
    ("constants", "mass", "words"),
    [
        (3, 1, "constants: expected a table of named numbers, found 3"),
        ({"1k": 3}, 1, "constants.1k: expected a name (a letter, then letters, digits or _"),
        ({"t": 3}, 1, 'constants.t: "t" already has a meaning in expressions; choose another'),
        ({"L": 3}, 1, 'constants.L: "L" already has a meaning'),
        ({"sin": 3}, 1, 'constants.sin: "sin" already has a meaning'),
        (
            {"a": True},
            1,
            "constants.a: expected a number, or an expression of constants above, found",
        ),
        ({"a": "2*b", "b": 1}, 1, "found '2*b'; 'b' is no constant of the scene: define it"),
        (
            {"a": "1/0"},
            1,
            "constants.a: expected a number, or an expression of constants above, found",
        ),
        ({"half": 1}, "2*haf", "found '2*haf'; 'haf' is no constant of the scene: did you mean"),
        ({"half": 1}, "2*half*t", "'t' is no constant of the scene"),
        ({"half": 1}, "half*", "mass: expected a number in kg, 0 or more, found 'half*'; the exp"),
        ({"half": 1}, "half < 2", "mass: expected a number in kg, 0 or more, found 'half < 2'"),
        ({"half": -1}, "half", "mass: expected a number in kg, 0 or more, found -1"),
        ({}, "1/0", "found '1/0'; division by zero"),
    ],
)
def test_what_is_no_constant_is_refused(constants: Any, mass: Any, words: str) -> None:
    with pytest.raises(SceneError) as refused:
        Scene.from_data(rod(constants, mass=mass), "rod.toml")
    assert words in str(refused.value)
    assert all(line.startswith("rod.toml: ") for line in str(refused.value).split("\n"))
