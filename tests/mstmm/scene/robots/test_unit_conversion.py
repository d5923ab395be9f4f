"""Robots in mm and g, doubtful sizes, dust, several trees, and what is left of mimics."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import mstmm
from mstmm.scene.robots.robot_model import Joint, Link, Mimic, Robot
from mstmm.scene.robots.scene_from_robot import ImportedRobot, ImportOptions, scene_from_robot
from tests.mstmm.scene.robots.test_scene_from_robot import chain, pin
from tests.mstmm.scene.robots.test_urdf import ARM, joint, robot, write_robot_file

IN_M = """<robot><link name="base"/>
  <joint name="rail" type="prismatic"><parent link="base"/><child link="cart"/>
    <origin xyz="0.1 0 {l3}"/><axis xyz="1 0 0.5"/>
    <limit lower="-0.5" upper="0.5" effort="7" velocity="2"/>
    <dynamics damping="0.3" friction="0.2"/></joint>
  <link name="cart"><inertial><mass value="2"/><inertia ixx="0.02" iyy="0.02" izz="0.02"/>
    </inertial><visual><geometry><box size="0.3 0.2 0.1"/></geometry></visual></link>
  <joint name="swing" type="continuous"><parent link="cart"/><child link="bob"/>
    <origin xyz="0 0.2 0"/><axis xyz="0 1 0"/><dynamics damping="0.05" friction="0.01"/>
    <limit effort="3" velocity="4"/></joint>
  <link name="bob"><inertial><origin xyz="0 0 -0.4"/><mass value="0.7"/>
    <inertia ixx="0.01" iyy="0.01" izz="0.001"/></inertial></link>
  <joint name="jaw" type="prismatic"><parent link="bob"/><child link="tip"/>
    <origin xyz="0 0 -0.8"/><axis xyz="0 0 1"/>
    <mimic joint="swing" multiplier="0.1" offset="0.02"/></joint>
  <link name="tip"><inertial><mass value="0.1"/><inertia ixx="1e-4" iyy="1e-4" izz="1e-4"/>
    </inertial></link>
</robot>""".replace("{l3}", "0.3")

#: The same in mm and g, by hand: forces in g mm/s^2, moments in g mm^2/s^2.
IN_MM = """<robot><link name="base"/>
  <joint name="rail" type="prismatic"><parent link="base"/><child link="cart"/>
    <origin xyz="100 0 300"/><axis xyz="1 0 0.5"/>
    <limit lower="-500" upper="500" effort="7e6" velocity="2000"/>
    <dynamics damping="300" friction="200000"/></joint>
  <link name="cart"><inertial><mass value="2000"/><inertia ixx="2e7" iyy="2e7" izz="2e7"/>
    </inertial><visual><geometry><box size="300 200 100"/></geometry></visual></link>
  <joint name="swing" type="continuous"><parent link="cart"/><child link="bob"/>
    <origin xyz="0 200 0"/><axis xyz="0 1 0"/><dynamics damping="5e7" friction="1e7"/>
    <limit effort="3e9" velocity="4"/></joint>
  <link name="bob"><inertial><origin xyz="0 0 -400"/><mass value="700"/>
    <inertia ixx="1e7" iyy="1e7" izz="1e6"/></inertial></link>
  <joint name="jaw" type="prismatic"><parent link="bob"/><child link="tip"/>
    <origin xyz="0 0 -800"/><axis xyz="0 0 1"/>
    <mimic joint="swing" multiplier="100" offset="20"/></joint>
  <link name="tip"><inertial><mass value="100"/><inertia ixx="1e5" iyy="1e5" izz="1e5"/>
    </inertial></link>
</robot>"""


def note_texts(found: ImportedRobot) -> list[str]:
    return [f"{note.element}: {note.text}" for note in found.notes]


def test_mm_and_g_move_as_m_and_kg_do(tmp_path: Path) -> None:
    plain = mstmm.import_robot(write_robot_file(tmp_path, IN_M, "a.urdf"), stops=1e4)
    path = write_robot_file(tmp_path, IN_MM, "b.urdf")
    found = mstmm.import_robot(path, stops=1e4, units={"length": "mm", "mass": "g"})
    assert not any(note.element == "units" for note in (*plain.notes, *found.notes))
    runs = [mstmm.compile(each.scene).simulate(0.3, rtol=1e-10) for each in (plain, found)]
    np.testing.assert_allclose(runs[0].q[-1], runs[1].q[-1], rtol=1e-7, atol=1e-9)
    rails = [each.scene.hinges[0].law.limits[0] for each in (plain, found)]
    assert rails[1].upper == pytest.approx(rails[0].upper) and rails[1].stiffness == 1e4
    sizes = [each.scene.shape[0].size for each in (plain, found)]
    assert sizes[1] == pytest.approx(sizes[0])
    for mine, other in zip(found.scene.hinge[:2], plain.scene.hinge[:2], strict=True):
        assert mine.rated is not None and other.rated is not None
        ratings = other.rated.model_dump(exclude_none=True)
        assert mine.rated.model_dump(exclude_none=True) == pytest.approx(ratings, rel=1e-12)


def test_units_that_are_none(tmp_path: Path) -> None:
    path = write_robot_file(tmp_path, ARM)
    with pytest.raises(mstmm.SceneError, match="units: length: expected one of m, cm, mm, in"):
        mstmm.import_robot(path, units={"length": "furlong"})
    with pytest.raises(mstmm.SceneError, match=r'units: expected ."length": ...'):
        mstmm.import_robot(path, units={"time": "ms"})


def test_loading_takes_units_too(tmp_path: Path) -> None:
    path, units = write_robot_file(tmp_path, IN_MM), {"length": "mm", "mass": "g"}
    assert mstmm.load_scene(path, units=units) == mstmm.import_robot(path, units=units).scene
    with pytest.raises(mstmm.SceneError, match="units: mass: expected one of kg, g, t, lb"):
        mstmm.load_scene(path, units={"mass": "stone"})


def test_scene_files_have_no_units(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    path.write_text(mstmm.import_robot(write_robot_file(tmp_path, IN_M)).to_toml())
    with pytest.raises(
        mstmm.SceneError, match=r"arm\.toml: units: expected none for a scene file, .* m and kg"
    ):
        mstmm.load_scene(path, units={"length": "mm"})


@pytest.mark.parametrize(
    ("text", "sign"),
    [
        (IN_MM, "a reach of 1.32e+03 m"),
        (IN_M.replace('izz="0.001"', 'izz="1000"').replace('ixx="0.0', 'ixx="90000')
         .replace('ixx="1e-4"', 'ixx="1e3"'), "radii of gyration of"),
        (IN_M.replace('mass value="', 'mass value="1000'), "mass over radius of gyration cubed"),
    ],
    ids=["mm", "kg mm^2", "g"],
)  # fmt: skip
def test_sizes_that_do_not_look_like_m_and_kg_are_told(
    text: str, sign: str, tmp_path: Path
) -> None:
    (note,) = [
        note for note in mstmm.import_robot(write_robot_file(tmp_path, text)).notes
        if note.element == "units"
    ]  # fmt: skip
    assert sign in note.text and "probably not m and kg" in note.text


@pytest.mark.parametrize(("entry", "dust"), [("1e-17", True), ("1e-6", False)])
def test_links_with_dust_of_inertia_and_no_mass_have_none(
    entry: str, dust: bool, tmp_path: Path
) -> None:
    speck = f'<link name="speck"><inertial><mass value="0"/><inertia ixx="{entry}"/></inertial>'
    extra = joint("continuous", "tool", "speck") + speck + "</link></robot>"
    found = mstmm.import_robot(write_robot_file(tmp_path, ARM.replace("</robot>", extra)))
    assert (
        "link 'speck': no mass, and an inertia that is rounding; both are treated as zero"
        in note_texts(found)
    ) == dust
    assert ("j" not in found.joints) == dust


def test_several_trees_stand_side_by_side() -> None:
    """Two pendulums on bases of their own, in one file."""
    links, joints = list[Link](), list[Joint]()
    unit = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    for name, out in (("a", 0.3), ("b", 0.6)):
        links += [Link(f"{name}0"), Link(f"{name}1", 1.0, (out, 0.0, 0.0), unit)]
        keys = {"axis": (0.0, 1.0, 0.0)}
        joints.append(Joint(name, "pin", f"{name}0", f"{name}1", keys=keys))
    found = scene_from_robot(Robot("two", "two.urdf", tuple(links), tuple(joints)), ImportOptions())
    assert [hinge.inboard for hinge in found.scene.hinge] == ["ground", "ground"]
    swings = mstmm.compile(found.scene).accelerations([0.0, 0.0], [0.0, 0.0])
    assert swings == pytest.approx([9.81 * out / (1 + out**2) for out in (0.3, 0.6)], rel=1e-14)
    assert "trees: 2 of them: 'a0', 'b0'; each has its own base" in note_texts(found)


def test_of_two_mimics_of_a_joint_the_last_one_counts() -> None:
    mimics = (
        Mimic("j2", "j0", 2.0, 0.0), Mimic("j2", "j1", 3.0, 0.0), Mimic("j2", "none", 1.0, 0.0)
    )  # fmt: skip
    found = scene_from_robot(chain(pin(0), pin(1), pin(2), mimics=mimics), ImportOptions())
    assert "joint 'j2': several <mimic>: the last one applies, not 'j0'" in note_texts(found)
    (coupling,) = found.scene.coupling
    assert [name.text for name in coupling.names] == ["j2.q", "j1.q"]


def test_a_mimic_of_several_coordinates_is_told(tmp_path: Path) -> None:
    body = '<link name="c"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/>'
    mimic = joint("planar", "a", "c", '<mimic joint="k"/>')
    text = robot("a", mimic).replace("</robot>", body + "</inertial></link></robot>")
    found = mstmm.import_robot(write_robot_file(tmp_path, text))
    assert "joint 'j': its <mimic> is left out: a planar joint" in note_texts(found)
