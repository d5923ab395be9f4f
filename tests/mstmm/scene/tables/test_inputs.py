"""Signals and inputs as a scene has them: numbers over time, their names, and what is refused."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from mstmm import load_scene
from mstmm.errors import SceneError
from mstmm.numerics.piecewise_polynomial import constant, discontinuities, interpolate
from mstmm.scene import Scene, Signal
from tests.support.scenes.minimal import Data, body, hinge

TIMES = (0.0, 0.4, 1.0, 1.3, 2.5)
VALUES = (0.0, 1.0, -2.0, 0.5, 0.25)


def motor(effort: str = "wind", **tables: Any) -> Data:
    """A rod with a motor on its hinge."""
    pin = hinge(law={"effort": effort})
    return {"gravity": [0, 0, 0], "body": [body()], "hinge": [pin], **tables}


def wind(**changes: Any) -> Data:
    return {"name": "wind", "times": list(TIMES), "values": list(VALUES)} | changes


def message_of(data: Data) -> str:
    with pytest.raises(SceneError) as error:
        Scene.from_data(data)
    return str(error.value)


# --- numbers over time ----------------------------------------------------------------------------


@pytest.mark.parametrize("count", [2, 3, 4, 5])
def test_a_cubic_signal_is_the_spline_that_is_not_a_knot_at_its_ends(count: int) -> None:
    times, values = TIMES[:count], VALUES[:count]
    found, spline = interpolate(times, values, "cubic"), CubicSpline(times, values)
    at = np.linspace(times[0], times[-1], 101)
    np.testing.assert_allclose([found.value(t) for t in at], spline(at), rtol=0, atol=1e-14)


def test_lines_and_steps_go_through_their_values() -> None:
    line, hold = interpolate(TIMES, VALUES, "line"), interpolate(TIMES, VALUES, "hold")
    at = np.linspace(-1.0, 4.0, 301)
    expected = np.interp(at, TIMES, VALUES)
    np.testing.assert_allclose([line.value(t) for t in at], expected, rtol=0, atol=1e-15)
    for k, (t, value) in enumerate(zip(TIMES, VALUES, strict=True)):
        assert hold.value(t) == value
        assert hold.value(math.nextafter(t, -1)) == VALUES[max(0, k - 1)]


@pytest.mark.parametrize("interpolation", ["hold", "line", "cubic"])
def test_a_signal_stands_still_outside_its_times(interpolation: str) -> None:
    found = interpolate(TIMES, VALUES, interpolation)
    assert [found.value(t) for t in (-5.0, 0.0)] == [VALUES[0]] * 2
    assert [found.value(t) for t in (2.6, 50.0)] == [VALUES[-1]] * 2
    assert found.piece_at(50.0)[2:] == (0.0, 0.0, 0.0)


def test_a_line_has_not_stopped_at_its_last_time() -> None:
    found = interpolate(TIMES, VALUES, "line")
    assert found.piece_at(2.5)[2] == pytest.approx(-0.25 / 1.2)
    assert found.value(2.5) == pytest.approx(0.25, abs=1e-15)


def test_jumps_are_found_among_the_knots() -> None:
    assert discontinuities(interpolate(TIMES, VALUES, "cubic"))[0] == 0.0
    assert len(discontinuities(interpolate(TIMES, VALUES, "cubic"))) == 2
    assert discontinuities(interpolate((0, 1, 2, 3), (0, 1, 2, 4), "line"))[1:] == [
        2.0,
        math.nextafter(3.0, 4),
    ]
    assert discontinuities(interpolate(TIMES, VALUES, "hold")) == list(TIMES[1:])


def test_rates_of_an_input_are_those_of_its_start() -> None:
    found = constant(1.0, 2.0, 6.0)
    assert [found.value(t) for t in (0.0, 1.0, 2.0)] == [1.0, 6.0, 17.0]
    assert not found.varies and not found.is_constant and constant(1.0).is_constant


# --- files ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("separator", [",", ";", "\t"])
@pytest.mark.parametrize("column", [3, "gust"])
def test_a_file_of_columns_is_read_with_the_scene(
    tmp_path: Path, separator: str, column: int | str
) -> None:
    values = zip(map(str, TIMES), map(str, VALUES), strict=True)
    rows = [["time", "mean", "gust"], *([t, "0", value] for t, value in values)]
    text = "# measured\n" + "\n\n".join(separator.join(row) for row in rows)
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "wind.csv").write_text(text)
    signal = f'[[signal]]\nname = "wind"\nfile = "data/wind.csv"\ncolumn = {column!r}\n'
    scene_file = tmp_path / "scene.toml"
    scene_file.write_text(Scene.from_data(motor("0")).to_toml() + signal.replace("'", '"'))
    scene = load_scene(scene_file)
    assert (scene.signal[0].times, scene.signal[0].values) == (TIMES, VALUES)
    assert Scene.from_data(tomllib.loads(scene.to_toml())) == scene  # it needs no file any more


@pytest.mark.parametrize(
    ("text", "column", "says"),
    [
        ("0,1\n1,2\n1,3\n", 2, ("row 2 and", "row 3 are both at 1 s", "keep one of them")),
        ("t,v\n0,1\n2,2\n\n1,3\n", 2, ("row 5, 1 s, comes after", "row 3, 2 s", "sort them")),
        ("0,1\n1,x\n", 2, ("row 2", "expected a number", "'x'")),
        ("0,1\n1\n", 2, ("row 2: expected 2 columns or more", "found 1")),
        ("t,v\n0,1\n", "w", ("no column 'w'", "t, v")),
        ("0,1\n", "v", ("no column", "give the column number")),
        ("0,1\n", 3, ("no column 3", "it has 2")),
        ("t,v\n", 2, ("expected rows of numbers, times in s first, found none",)),
        ("", 2, ("expected rows of numbers",)),
        ("0,1\n1_0,2\n", 2, ("row 2", "expected a number", "'1_0'")),
        ("0,1_0\n", 2, ("row 1", "'1_0'")),
        ("0,nan\n", 2, ("expected a number", "'nan'")),
        ("0,1e300\n1e-300,-1e300\n", 2, ("row 1 on its rate",)),
    ],
)
def test_what_a_file_of_columns_cannot_be(
    tmp_path: Path, text: str, column: int | str, says: tuple[str, ...],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    (tmp_path / "wind.csv").write_text(text)
    monkeypatch.chdir(tmp_path)
    signal = {"name": "wind", "file": "wind.csv", "column": column}
    message = message_of(motor(signal=[signal]))
    assert message.startswith('scene: signal "wind": file: ')
    for part in says:
        assert part in message


@pytest.mark.parametrize("name", ["../wind.csv", "/etc/hostname", "there/../../wind.csv", "link"])
def test_a_file_outside_the_folder_of_the_scene_is_refused(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "wind.csv").write_text("0,1\n")
    (tmp_path / "scenes").mkdir()
    (tmp_path / "scenes" / "link").symlink_to(tmp_path / "wind.csv")
    monkeypatch.chdir(tmp_path / "scenes")
    message = message_of(motor(signal=[{"name": "wind", "file": name}]))
    assert "expected a file in the folder of the scene" in message and "copy it there" in message


def test_a_file_that_is_none_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    (tmp_path / "latin.csv").write_bytes(b"t,\xe9\n0,1\n")
    for name, says in (("none.csv", "no such file"), ("folder", "no such file"),
                       ("latin.csv", "not UTF-8"), ("a\0b", "expected a CSV file")):  # fmt: skip
        assert says in message_of(motor(signal=[{"name": "wind", "file": name}]))


# --- what is refused ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"times": [0, 1, 1, 2], "values": [0] * 4}, ("times[1] and times[2] are both at 1 s",)),
        ({"times": [0, 2, 1], "values": [0] * 3}, ("times[2], 1 s, comes after times[1], 2 s",)),
        ({"times": [0, 1]}, ("values", "expected 2", "found 5")),
        ({"times": [], "values": []}, ("missing; expected times in s and values",)),
        ({"interpolation": "spline"}, ("interpolation", '"hold" or "line" or "cubic"')),
        ({"file": "wind.csv"}, ("expected a file, or times and values, found both",)),
        ({"column": 2}, ("only a signal from a file has a column",)),
        ({"name": "t"}, ("already has a meaning in expressions",)),
        ({"name": "energy"}, ('"energy" is reserved for a quantity of results',)),
        ({"name": "sin"}, ("already has a meaning in expressions",)),
        ({"unit": "x" * 65}, ('unit such as "N m"',)),
        ({"values": [0, 1, "k", 0, 0]}, ("values[2]", "expected a number")),
    ],
)
def test_what_a_signal_cannot_be(changes: Data, says: tuple[str, ...]) -> None:
    message = message_of(motor(signal=[wind(**changes)]))
    for part in says:
        assert part in message


@pytest.mark.parametrize(
    ("tables", "says"),
    [
        ({"signal": [wind(), wind()]}, ("is also the name of signal number 1; rename one",)),
        ({"signal": [wind()], "input": [{"name": "wind"}]}, ("also the name of an input",)),
        ({"input": [{"name": "wind"}], "constants": {"wind": 1}}, ("the name of a constant",)),
        ({"input": [{"name": "wind", "value": "wnd"}], "signal": [wind(name="wnt")]},
         ('input "wind": value: there is no signal "wnd"', 'did you mean "wnt"')),
        ({"input": [{"name": "wind", "value": "a", "rates": [0, 0]}], "signal": [wind(name="a")]},
         ("rates: the signal", "has its own rates")),
        ({"input": [{"name": "wind", "rates": [1]}]}, ("rates", "rate, second rate")),
        ({"input": [{"name": "wnd"}]}, ("'wind' is unknown", 'did you mean "wnd"')),
        ({"input": [{"name": "wind", "value": [1]}]}, ("a number or the name of a signal",)),
    ],
)  # fmt: skip
def test_what_names_cannot_be(tables: Data, says: tuple[str, ...]) -> None:
    message = message_of(motor(**tables))
    for part in says:
        assert part in message, message


def test_an_input_is_one_number() -> None:
    message = message_of(motor("wind[1]", signal=[wind()]))
    assert "'wind' is a scalar; leave out [1]" in message


def test_a_parameter_of_the_same_name_is_refused() -> None:
    data = motor(signal=[wind(name="pitch")])
    data["hinge"] = [hinge(type="sleeve", parameters={"pitch": 0.1})]
    assert '"pitch" is also the name of a signal of the scene' in message_of(data)


def test_a_drive_needs_rates() -> None:
    data = motor("0", input=[{"name": "angle", "value": 0.2}])
    data["hinge"][0]["drive"] = ["sin(angle)"]
    message = message_of(data)
    assert 'hinge "shoulder": drive' in message and "needs the rates of the input" in message
    data["input"][0]["rates"] = [0.3, 0.1]
    Scene.from_data(data)
    data["hinge"][0]["drive"] = ["sin(q)"]
    assert "expected a function of t and inputs only, found 'q'" in message_of(data)
    data["hinge"][0]["drive"] = ["2*abs(angle - 0.3) + where(t < 1, t, 1)"]
    assert "a drive cannot switch with an input, found 'abs(angle - 0.3)'" in message_of(data)
    data["hinge"][0]["drive"] = ["1/(angle - 0.2)"]
    assert "not finite at t = 0" in message_of(data)


# --- what is accepted -----------------------------------------------------------------------------


def test_inputs_and_signals_nobody_uses_are_told() -> None:
    calm = wind(name="calm")
    for tables, element in (({"input": [{"name": "brake"}]}, 'input "brake"'),
                            ({"signal": [wind(), calm]}, 'signal "calm"')):  # fmt: skip
        (risk,) = Scene.from_data(motor("wind", **{"signal": [wind()]} | tables)).risks
        assert (risk.name, risk.element, risk.invalidates) == ("unused-input", element, False)
    followed = motor("brake", signal=[wind(), calm], input=[{"name": "brake", "value": "wind"}])
    assert Scene.from_data(followed).risks == ()


def test_the_scene_is_written_as_it_is_read() -> None:
    data = motor(
        "k*brake*wind", constants={"k": 2.0}, signal=[wind(values=[0, "k", 1, 2, 3], unit="N m")],
        input=[{"name": "brake", "unit": "1", "value": "3*k"}, {"name": "gust", "value": "wind"}],
    )  # fmt: skip
    scene = Scene.from_data(data)
    text = scene.to_toml()
    assert 'value = "3*k"' in text and 'value = "wind"' in text
    assert Scene.from_data(tomllib.loads(text)) == scene
    assert scene.channels["brake"].value(1.0) == 6.0
    assert scene.channels["gust"] == scene.channels["wind"]


def test_the_schema_knows_the_tables() -> None:
    schema = Scene.model_json_schema()
    assert {"input", "signal"} <= schema["properties"].keys()
    signal = schema["$defs"]["Signal"]["properties"]
    assert signal["interpolation"]["enum"] == ["hold", "line", "cubic"]
    assert signal.keys() == Signal.model_fields.keys()
