"""`mstmm import` and `mstmm export`: what they write, and what they tell."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import pytest

from tests.mstmm.scene.robots.test_urdf import ARM
from tests.support.commands import Command


def test_a_robot_becomes_a_scene_that_runs(mstmm: Command) -> None:
    Path("arm.urdf").write_text(ARM)
    done = mstmm("import", "arm.urdf", "--stops", "1e4")
    assert done.code == 0
    assert "joint 'other jaw' (line 36): mimics 'jaw', by a coupling" in done.out
    assert "link 'base' (line 5): part of the ground" in done.out
    assert "arm.toml: 3 bodies, 3 hinges" in done.out.splitlines()[-1]
    assert mstmm("check", "arm.toml").code == 0
    assert mstmm("check", "arm.urdf").code == 0


def test_names_and_notes_for_programs(mstmm: Command) -> None:
    Path("arm.urdf").write_text(ARM)
    done = mstmm("import", "arm.urdf", "-o", "robot.toml", "--keep-fixed", "--json")
    told = json.loads(done.out)
    assert told["scene"] == "robot.toml" and told["names"]["1st arm"] == "link_1st_arm"
    assert ("<transmission>", "left out") in {(n["element"], n["text"]) for n in told["notes"]}


def test_bad_input(mstmm: Command) -> None:
    assert mstmm("import", "none.urdf").code == 2
    Path("arm.urdf").write_text("<robot>")
    done = mstmm("import", "arm.urdf")
    assert done.code == 2 and "not valid XML" in done.err
    done = mstmm("import", "arm.urdf", "--base", "flying")
    assert done.code == 2 and 'expected "fixed" or "free"' in done.err


def test_a_scene_becomes_a_robot_again(mstmm: Command) -> None:
    Path("arm.urdf").write_text(ARM)
    assert mstmm("import", "arm.urdf").code == 0
    done = mstmm("export", "arm.toml", "-o", "again.urdf")
    assert done.code == 0 and done.out.splitlines()[-1].startswith("again.urdf: 5 links")
    assert mstmm("check", "again.urdf").code == 0
    told = json.loads(mstmm("export", "arm.toml", "-o", "arm.urdf", "--json").out)
    assert told["robot"] == "arm.urdf" and isinstance(told["notes"], list)
    done = mstmm("export", "arm.toml", "-o", "arm.xml")
    assert done.code == 2 and ".urdf" in done.err


def test_nothing_is_written_over_without_being_named(mstmm: Command) -> None:
    Path("arm.urdf").write_text(ARM)
    assert mstmm("import", "arm.urdf").code == 0
    scene = Path("arm.toml").read_text() + "# by hand\n"
    Path("arm.toml").write_text(scene)
    for command, source, target in (
        ("import", "arm.urdf", "arm.toml"), ("export", "arm.toml", "arm.urdf")
    ):  # fmt: skip
        done = mstmm(command, source)
        assert done.code == 2 and f"{target} exists already; give another name" in done.err
    assert Path("arm.toml").read_text() == scene and Path("arm.urdf").read_text() == ARM
    assert mstmm("import", "arm.urdf", "--output", "arm.toml").code == 0
    assert Path("arm.toml").read_text() != scene


def test_lengths_and_masses_in_other_units(mstmm: Command) -> None:
    Path("arm.urdf").write_text(ARM)
    assert mstmm("import", "arm.urdf", "--length", "mm", "--mass", "g").code == 0
    (body, *_) = tomllib.loads(Path("arm.toml").read_text())["body"]
    assert body["mass"] == pytest.approx(0.0025)  # 2 and 0.5 g, on a flange 0.6 mm off
    assert body["ends"]["tool"]["position"][0] == pytest.approx(0.0006)
    done = mstmm("import", "arm.urdf", "-o", "b.toml", "--length", "furlong")
    assert done.code == 2 and "expected one of m, cm, mm, in" in done.err


def test_runs_show_quantities_by_the_names_of_the_file(mstmm: Command) -> None:
    Path("arm.urdf").write_text(ARM)
    assert mstmm("import", "arm.urdf").code == 0
    asked = ("--t-end", "0.05", "-q", "shoulder-1.angle", "-q", "1st arm.z", "-q", "tool.x")
    done = mstmm("simulate", "arm.toml", *asked)
    assert done.code == 0
    (head,) = (line for line in done.out.splitlines() if "tool.x" in line)
    assert "shoulder-1.angle" in head and "1st arm.z" in head


def test_a_dangling_link_of_the_scene_name_is_not_written_through(
    mstmm: Command, folder: Path
) -> None:
    (folder / "arm.urdf").write_text(
        '<robot name="arm"><link name="a"><inertial><mass value="1"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>'
    )
    (folder / "arm.toml").symlink_to(folder / "elsewhere.toml")
    done = mstmm("import", "arm.urdf")
    assert done.code == 2 and "exists already" in done.err
    assert not (folder / "elsewhere.toml").exists()


def test_meshes_from_elsewhere_are_copied_beside_the_scene(mstmm: Command, folder: Path) -> None:
    meshes, work = folder / "meshes", folder / "work"
    meshes.mkdir()
    work.mkdir()
    (meshes / "plate.stl").write_text("solid plate\nendsolid plate\n")
    (folder / "arm.urdf").write_text(
        '<robot name="arm"><link name="a"><inertial><mass value="1"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
        '<visual><geometry><mesh filename="meshes/plate.stl"/></geometry></visual></link>'
        '<link name="b"><inertial><mass value="1"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        '<joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint></robot>'
    )
    assert mstmm("import", "arm.urdf", "-o", "work/arm.toml").code == 0
    assert (work / "arm_meshes" / "0_plate.stl").is_file()
    assert 'file = "arm_meshes/0_plate.stl"' in (work / "arm.toml").read_text()
    assert mstmm("check", "work/arm.toml").code == 0
    assert mstmm("import", "arm.urdf", "-o", "here.toml").code == 0
    assert 'file = "meshes/plate.stl"' in (folder / "here.toml").read_text()
