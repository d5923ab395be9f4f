"""Names of a robot's file: kept by the scene, found by results, and written back."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

import mstmm
from tests.mstmm.scene.robots.test_urdf import ARM, joint, write_robot_file


@pytest.mark.parametrize("choices", [{}, {"merge": False}, {"base": "free"}])
def test_every_link_and_joint_is_found_by_its_own_name(
    tmp_path: Path, choices: dict[str, Any]
) -> None:
    found = mstmm.import_robot(write_robot_file(tmp_path, ARM), **choices)
    scene = mstmm.load_scene(write_robot_file(tmp_path, found.to_toml(), "arm.toml"))
    assert scene == found.scene
    run = mstmm.compile(scene).simulate(0.05)
    for name, own in found.links.items():
        if own != "ground":
            assert np.array_equal(run.position(name), run.position(own))
    for name, own in found.joints.items():
        assert np.array_equal(run.coordinates(name), run.coordinates(own))
    assert run.quantity("shoulder-1.angle").name == "shoulder-1.angle"


def test_a_robot_that_is_loaded_as_a_scene_keeps_them(tmp_path: Path) -> None:
    scene = mstmm.load_scene(write_robot_file(tmp_path, ARM))
    assert scene.names.body["tool"] == "link_1st_arm.tool"
    assert scene.names.hinge == {"shoulder-1": "shoulder_1", "other jaw": "other_jaw"}


def names_of(text: str, tag: str) -> set[str]:
    return {one.attrib["name"] for one in ElementTree.fromstring(text).iter(tag)}


def test_they_are_written_back(tmp_path: Path) -> None:
    text = mstmm.export_robot(mstmm.load_scene(write_robot_file(tmp_path, ARM))).text
    assert names_of(text, "link") == names_of(ARM, "link") - {"base"}  # turned, part of the ground
    assert names_of(text, "joint") >= {"shoulder-1", "jaw", "other jaw"}
    assert '<mimic joint="jaw"' in text
    again = mstmm.load_scene(write_robot_file(tmp_path, text, "again.urdf"))
    assert again.names == mstmm.load_scene(tmp_path / "arm.urdf").names


def test_links_in_one_place_are_written_back_each(tmp_path: Path) -> None:
    text = ARM.replace("<transmission", joint("fixed", "1st arm", "skin", name="glue") + "<transm")
    text = text.replace('<transm name="t"/>', '<link name="skin"/>').replace('"1st arm"', '"arm"')
    scene = mstmm.load_scene(write_robot_file(tmp_path, text))
    assert scene.names.body["arm"] == scene.names.body["skin"] == "arm"
    back = mstmm.export_robot(scene).text
    assert names_of(back, "link") == names_of(text, "link") - {"base"}
    again = mstmm.load_scene(write_robot_file(tmp_path, back, "again.urdf"))
    assert again.names.body == scene.names.body


def test_names_that_look_like_places_of_the_scene_do_no_harm(tmp_path: Path) -> None:
    text = ARM.replace('"tool"', '"ground"').replace('"finger"', '"link_1st_arm.jaw"')
    found = mstmm.import_robot(write_robot_file(tmp_path, text))
    data = tomllib.loads(found.to_toml())
    assert mstmm.Scene.from_data(data) == found.scene
    assert "ground" not in found.scene.names.body


def test_advice_leaves_out_names_of_what_it_takes_away(tmp_path: Path) -> None:
    scene = mstmm.import_robot(write_robot_file(tmp_path, ARM), merge=False).scene
    from mstmm.runtime.experiments.model_levels import with_tables

    less = with_tables(scene, hinge=scene.hinge[:3], body=scene.body[:3])
    assert less.names.hinge == {"shoulder-1": "shoulder_1"}
    assert less.names.body == {"1st arm": "link_1st_arm"}


def chain_of(first: str) -> str:
    """Two links on pins about y, 1 m apart: `first`, then "arm"."""
    mass = '<inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1"/></inertial>'
    return (
        f'<robot name="r"><link name="base"/><link name="ground_2">{mass}</link>'
        f'<link name="{first}">{mass}</link><link name="arm">{mass}</link>'
        + joint("continuous", "base", first, inside='<axis xyz="0 1 0"/>', name="j1")
        + joint("continuous", first, "arm", inside='<axis xyz="0 1 0"/>', name="j2")
        + joint("continuous", "arm", "ground_2", name="j3")
        + "</robot>"
    )


@pytest.mark.parametrize("merge", [True, False])
def test_a_moving_link_may_be_called_as_the_ground_is(tmp_path: Path, merge: bool) -> None:
    found = mstmm.import_robot(write_robot_file(tmp_path, chain_of("ground")), merge=merge)
    own = found.links["ground"]
    inboard = {hinge.name: hinge.inboard_body for hinge in found.scene.hinge}
    assert own == "ground_3" and found.links["ground_2"] == "ground_2"
    assert inboard["j2"] == own and inboard["j3"] == "arm"
    assert any("'ground' is ground_3" in note.text for note in found.notes)
    other = mstmm.import_robot(write_robot_file(tmp_path, chain_of("upper")), merge=merge)
    mine, theirs = (mstmm.compile(one.scene).simulate(0.1) for one in (found, other))
    assert np.array_equal(mine.q, theirs.q)
    note = next(note.text for note in found.notes if note.element == "names")
    assert note == "1 allowed neither in a scene nor in its [names]: 'ground' is ground_3"


def test_names_that_are_not_kept_are_told_apart(tmp_path: Path) -> None:
    text = ARM.replace('"jaw"', f'"{"x" * 201}"')
    notes = [one.text for one in mstmm.import_robot(write_robot_file(tmp_path, text)).notes
             if one.element == "names"]  # fmt: skip
    assert len(notes) == 2
    assert notes[0].startswith("4 not allowed in a scene, kept in its [names]: '1st arm' is")
    assert notes[1].startswith("1 allowed neither in a scene nor in its [names]: 'xxxx")
    assert len(notes[1]) < 200
