"""The files of MJCF: what is looked at before MuJoCo opens any of them."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

import mstmm
from mstmm.scene.robots.mjcf_includes import check_included_files

ENTITY = '<!DOCTYPE mujoco [<!ENTITY a SYSTEM "/etc/hostname">]><mujoco model="&a;"/>'


def include(file: str) -> str:
    return f'<mujoco>\n<include file="{file}"/></mujoco>'


def test_document_types_and_entities_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "robot.xml"
    path.write_text(ENTITY)
    with pytest.raises(mstmm.SceneError, match=r"robot\.xml: line 1: document types and entities"):
        mstmm.import_robot(path)
    (tmp_path / "part.xml").write_text(ENTITY)
    path.write_text(include("part.xml"))
    with pytest.raises(mstmm.SceneError, match=r"^part\.xml: line 1: document types and entities"):
        mstmm.load_scene(path)


@pytest.mark.parametrize("tag", ["include", "model"])
def test_files_from_elsewhere_are_refused(tmp_path: Path, tag: str) -> None:
    folder = tmp_path / "robot"
    folder.mkdir()
    (tmp_path / "other.xml").write_text("<mujoco/>")
    (folder / "link.xml").symlink_to(tmp_path / "other.xml")
    path = folder / "robot.xml"
    for name in ("../other.xml", str(tmp_path / "other.xml"), "link.xml", "none/../../other.xml"):
        path.write_text(include(name).replace("include", tag))
        with pytest.raises(mstmm.SceneError) as raised:
            mstmm.import_robot(path)
        assert f"robot.xml: line 2: <{tag}> file '" in str(raised.value)
        assert "expected a file in the folder of the model or below it" in str(raised.value)


def test_files_below_are_looked_through_once_each(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "a.xml").write_text(
        '<mujocoinclude>\n<body name="arm"/><include file="b.xml"/></mujocoinclude>'
    )
    (tmp_path / "parts" / "b.xml").write_text(include("parts/a.xml").replace("<incl", "\n<incl"))
    content = (
        include("parts/a.xml")
        .replace(
            "</mujoco>", '<equality><joint name="arm"/></equality><joint name="arm"/></mujoco>'
        )
        .encode()
    )
    places = check_included_files(content, tmp_path / "robot.xml", "robot.xml")
    assert places == {
        ("body", "arm"): "parts/a.xml: line 2", ("equality", "arm"): "robot.xml: line 2",
        ("joint", "arm"): "robot.xml: line 2",
    }  # fmt: skip


def test_an_include_of_what_is_no_xml_is_refused(tmp_path: Path) -> None:
    (tmp_path / "part.xml").write_text("<mujoco>")
    (tmp_path / "robot.xml").write_text(include("part.xml"))
    with pytest.raises(mstmm.SceneError, match=r"^part\.xml: line 1: not valid XML"):
        mstmm.import_robot(tmp_path / "robot.xml")


@pytest.mark.parametrize(
    ("file", "message"),
    [
        ("..\\other.xml", "expected a file in the folder of the model or below it"),
        ("parts", "this is not a regular file"),
        ("pipe.xml", "this is not a regular file"),
        ("ring.xml", "cannot be read"),
        ("empty.xml", "the file is empty"),
        ("", "expected the name of a file"),
        ("x" * 5000, "cannot be read: File name too long"),
    ],
)
def test_includes_of_what_is_no_file_are_refused(tmp_path: Path, file: str, message: str) -> None:
    folder = tmp_path / "robot"
    (folder / "parts").mkdir(parents=True)
    (tmp_path / "other.xml").write_text("<mujoco/>")
    (folder / "empty.xml").write_text(" ")
    (folder / "ring.xml").symlink_to(folder / "ring.xml")
    os.mkfifo(folder / "pipe.xml")
    (folder / "robot.xml").write_text(include(file))
    with pytest.raises(mstmm.SceneError, match=message) as raised:
        mstmm.import_robot(folder / "robot.xml")
    assert "robot.xml: line 2: <include> file '" in str(raised.value)
    assert len(str(raised.value)) < 200 + len(str(folder))


def test_a_backslash_is_looked_through_as_a_slash(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "a.xml").write_text(ENTITY)
    (tmp_path / "robot.xml").write_text(include("parts\\a.xml"))
    with pytest.raises(mstmm.SceneError, match=r"a\.xml: line 1: document types and entities"):
        mstmm.import_robot(tmp_path / "robot.xml")


# --- what MuJoCo would be asked for ---------------------------------------------------------------


@pytest.mark.parametrize(
    ("inside", "message"),
    [
        ('<worldbody><INCLUDE file="pipe.xml"/></worldbody>', "unknown element <INCLUDE>"),
        ('<asset><mesh name="x" file="pipe.stl"/></asset>', "<mesh> file 'pipe.stl': this is not"),
        ('<asset><texture fileright="pipe.stl"/></asset>', "<texture> fileright 'pipe.stl': this"),
        ('<asset><hfield name="x" file="../x.png"/></asset>', "expected a file in the folder of"),
        ('<compiler meshdir=".."/><asset><mesh file="x.png"/></asset>', "expected a file in the"),
        ('<compiler meshdir="in"/><asset><mesh file="p.stl"/></asset>', "this is not a regular"),
        ('<compiler strippath="true"/><asset><mesh file="no/pipe.stl"/></asset>', "not a regular"),
        ('<asset><hfield nrow="12000" ncol="12000"/></asset>', "<hfield>: expected at most"),
        ('<asset><texture width="9000" height="9000"/></asset>', "<texture>: expected at most"),
        ('<worldbody><replicate count="1000"><replicate count="1000"><geom size="1"/></replicate>'
         "</replicate></worldbody>", "more than 200000 elements including copies"),
        ('<worldbody><replicate count="190000"><include file="few.xml"/></replicate></worldbody>',
         "more than 200000 elements including copies"),
        ('<worldbody><flexcomp count="1000 1000 1000"/></worldbody>', "more than 200000 elements"),
    ],
)  # fmt: skip
def test_what_no_robot_needs_is_refused(tmp_path: Path, inside: str, message: str) -> None:
    folder = tmp_path / "robot"
    (folder / "in").mkdir(parents=True)
    (tmp_path / "x.png").write_text("x")
    (folder / "few.xml").write_text("<mujocoinclude><geom/><geom/></mujocoinclude>")
    for name in ("pipe.xml", "pipe.stl", "in/p.stl"):
        os.mkfifo(folder / name)
    (folder / "robot.xml").write_text(f"<mujoco>\n{inside}</mujoco>")
    with pytest.raises(mstmm.SceneError) as raised:
        mstmm.import_robot(folder / "robot.xml")
    assert message in str(raised.value)
    assert ".xml: line " in str(raised.value)


def test_assets_of_the_own_folder_pass(tmp_path: Path) -> None:
    (tmp_path / "assets").mkdir()
    (tmp_path / "assets" / "a.stl").write_text("x")
    text = (
        '<mujoco><compiler meshdir="assets"/><asset><mesh file="a.stl"/>'
        '<hfield nrow="100" ncol="100"/><texture width="512" height="512"/></asset>'
        '<worldbody><replicate count="50"><geom size="1"/></replicate></worldbody></mujoco>'
    )
    assert check_included_files(text.encode(), tmp_path / "robot.xml", "robot.xml") == {}
