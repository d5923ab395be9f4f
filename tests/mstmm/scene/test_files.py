"""Scene files: TOML and JSON, and every way in which a file can be no scene."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest

from mstmm.errors import SceneError
from mstmm.scene import Scene, load_scene
from tests.support.scenes.minimal import arm, body, hinge

TOML = """
schema_version = 1
gravity = [0, -9.81, 0]             # always stated
[[body]]
name = "rod1"
mass = 1.0
center_of_mass = [0.5, 0, 0]
inertia = [0.001, 0.084, 0.084]
ends = { tip = [1, 0, 0] }
[[hinge]]
name = "shoulder"
type = "pin"
inboard = "ground"
outboard = "rod1"
orientation = [0, 0, 0]
axis = [0, 0, 1]
initial = { q = [0.3], u = [0.0] }
law = { stiffness = 10.0, rest = 0.0, damping = 0.1, effort = "2*sin(t)", inertia = 0.2 }
[[load]]
on = "rod1.tip"
force = [0, "10*cos(t)", 0]
[[event]]
when = "rod1.x < 0.1"
do = "stop"
[[spring]]
from = "ground"
to = "rod1.tip"
law = { stiffness = 100.0, rest = 0.2, damping = 1.0 }
"""


def write(folder: Path, content: str | bytes, name: str = "arm.toml") -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def refusal(path: Any) -> str:
    with pytest.raises(SceneError) as caught:
        load_scene(path)
    message = str(caught.value)
    assert "\n" not in message and message.isprintable()
    return message


def test_toml_as_the_format_is_described(tmp_path: Path) -> None:
    scene = load_scene(write(tmp_path, TOML))
    assert scene.gravity == (0.0, -9.81, 0.0)
    rod, joint = scene.body[0], scene.hinge[0]
    assert (rod.name, rod.mass, rod.inertia) == ("rod1", 1.0, (0.001, 0.084, 0.084, 0.0, 0.0, 0.0))
    assert rod.ends["tip"].position == (1.0, 0.0, 0.0)
    assert joint.initial is not None and joint.initial.q == (0.3,)
    law = joint.law.entry(0)
    assert (law.stiffness, law.damping, law.inertia, law.effort.text) == (
        10.0,
        0.1,
        0.2,
        "2*sin(t)",
    )
    assert [f.text for f in scene.load[0].force] == ["0.0", "10*cos(t)", "0.0"]
    assert scene.event[0].when.comparison is not None
    assert (scene.spring[0].from_, scene.spring[0].to) == ("ground", "rod1.tip")


def test_the_same_scene_from_json_and_from_python(tmp_path: Path) -> None:
    from_json = load_scene(write(tmp_path, json.dumps(arm()), "arm.JSON"))
    assert from_json == Scene(**arm())
    assert load_scene(str(tmp_path / "arm.JSON")) == from_json


def test_byte_order_mark_and_line_ends_are_no_matter(tmp_path: Path) -> None:
    windows = b"\xef\xbb\xbf" + TOML.replace("\n", "\r\n").encode()
    assert load_scene(write(tmp_path, windows)) == load_scene(write(tmp_path, TOML, "b.toml"))


@pytest.mark.parametrize(
    ("content", "fragment"),
    [
        ("", "the file is empty; begin with gravity"),
        (" \n\t\n", "the file is empty"),
        (b"\x7fELF\x00\x01\x02", "expected text (TOML or JSON), found a binary file"),
        (bytes(range(256)), "expected text (TOML or JSON), found a binary file"),
        (b"gravity = [0, 0, 0]\n# caf\xe9\n", "line 2 is not UTF-8 text; save the file as UTF-8"),
        ("gravity = [0, -9.81, 0", "not valid TOML"),
        ("gravity = [0, 0, 0]\ngravity = [0, 0, 0]\n", "not valid TOML: Cannot overwrite a value"),
        ("gravity == 3", "not valid TOML"),
        ("{}", "not valid TOML"),
        ("x = " + "[" * 20000, "nested too deeply"),
        ("x = " + "{a=" * 20000, "nested too deeply"),
        ("gravity = [0, 0, 1" + "0" * 5000 + "]", "not valid TOML"),
        ("gravity = [0, 0, 1e999]", "gravity[2]: expected a number in m/s^2, found inf"),
        ("gravity = [0, nan, 0]", "gravity[1]: expected a number in m/s^2, found nan"),
        ("gravity = [0, -inf, 0]", "gravity[1]: expected a number in m/s^2, found -inf"),
        ("gravity = 1979-05-27", "gravity: expected three numbers in m/s^2"),
        ("# nothing but a comment", "gravity: missing"),
        (
            "gravity = [0, 0, 0]\n[body]\nname = 'a'",
            "body: expected a list of tables; write [[body]]",
        ),
    ],
)
def test_bad_toml(tmp_path: Path, content: str | bytes, fragment: str) -> None:
    path = write(tmp_path, content)
    message = refusal(path)
    assert message.startswith(f"{path}: ")
    assert fragment in message


@pytest.mark.parametrize(
    ("content", "fragment"),
    [
        ("", "the file is empty"),
        ("{", "not valid JSON"),
        ("[1, 2]", "expected one table"),
        ("null", "expected one table"),
        ('"gravity"', "expected one table"),
        ('{"gravity": [0, NaN, 0]}', "gravity[1]: expected a number in m/s^2, found nan"),
        ('{"gravity": [0, -Infinity, 0]}', "gravity[1]: expected a number in m/s^2, found -inf"),
        ('{"gravity": [0, 1e999, 0]}', "gravity[1]: expected a number in m/s^2, found inf"),
        ('{"gravity": 1, "gravity": 2}', "the key 'gravity' appears twice"),
        ('{"gravity": [0, 0, ' + "1" * 5000 + "]}", "not valid JSON"),
        ('{"gravity": ' + "[" * 400 + "]" * 400 + "}", "gravity: expected three numbers"),
        ('{"gravity": ' + '[{"a":' * 200 + "1" + "}]" * 200 + "}", "found 1 entry"),
        ('{"a": ' + "[" * 200000, "nested too deeply"),
        ('{"gravity": [0, 0, 0], "\\u0000": 1}', "unknown key"),
    ],
)
def test_bad_json(tmp_path: Path, content: str, fragment: str) -> None:
    assert fragment in refusal(write(tmp_path, content, "arm.json"))


def test_paths_that_are_no_scene_file(tmp_path: Path) -> None:
    write(tmp_path, TOML, "arm.toml")
    (tmp_path / "folder.toml").mkdir()
    fifo = tmp_path / "pipe.toml"
    os.mkfifo(fifo)
    assert "this is a folder" in refusal(tmp_path / "folder.toml")
    assert "this is not a regular file" in refusal(fifo)
    assert 'there is no such file; did you mean "arm.toml"?' in refusal(tmp_path / "arn.toml")
    assert "there is no such file" in refusal(tmp_path / "no" / "folder" / "x.toml")
    assert "ending in .toml or .json" in refusal(write(tmp_path, TOML, "arm.txt"))
    assert "ending in .toml or .json" in refusal("")
    assert "ending in .toml or .json" in refusal(tmp_path)
    assert "cannot be read" in refusal("a\0b.toml")
    assert "cannot be read" in refusal("x" * 5000 + ".toml")
    assert "expected the path of a scene file" in refusal(3)
    assert "expected the path of a scene file" in refusal(None)
    assert "there is no such file" in refusal(b"arm.toml")
    assert "'two\\nlines.toml'" in refusal("two\nlines.toml")


def test_a_huge_file_is_refused_unread(tmp_path: Path) -> None:
    path = write(tmp_path, TOML)
    os.truncate(path, 9 * 2**20)
    assert "the file has 9 MB, the limit is 8 MB; build large scenes in Python" in refusal(path)
    path = write(tmp_path, "{}", "arm.json")
    os.truncate(path, 65 * 2**20)
    assert "the file has 65 MB, the limit is 64 MB" in refusal(path)


@pytest.mark.parametrize("form", ["{} = 1", "[{}]", "x = {{ {} = 1 }}", "[[ {} ]]"])
@pytest.mark.parametrize("part", ["a", '"a b"', "'a.b' "])
def test_a_key_of_thousands_of_parts_is_refused_unread(
    tmp_path: Path, form: str, part: str
) -> None:
    """TOML's reader takes the square of their number in memory."""
    path = write(tmp_path, "gravity = [0, 0, 0]\n" + form.format(".".join([part] * 50000)))
    assert "line 2: a key has more than 64 parts" in refusal(path)


def test_long_words_and_texts_are_no_keys(tmp_path: Path) -> None:
    text = "# " + "a" * 500000 + " ... " + "1.5, " * 1000 + "\n" + TOML
    load_scene(write(tmp_path, text))


def test_the_environment_cannot_be_reached(tmp_path: Path) -> None:
    """Names and expressions that are code stay text and are refused."""
    target = tmp_path / "made_by_code"
    code = f"__import__('pathlib').Path({str(target)!r}).touch()"
    for data in (
        arm(body=[body(code), body("rod2")]),
        arm(hinge=[hinge(drive=code), hinge("elbow", inboard="rod1.tip", outboard="rod2")]),
        arm(load=[{"on": "rod1", "force": [0, 0, code]}]),
        arm(event=[{"when": f"{code} > 1", "do": "stop"}]),
        arm(hinge=[hinge(type=code), hinge("elbow", inboard="rod1.tip", outboard="rod2")]),
    ):
        refusal(write(tmp_path, json.dumps(data), "code.json"))
    assert not target.exists()
