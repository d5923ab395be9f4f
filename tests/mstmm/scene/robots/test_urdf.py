"""URDF: a robot's file against numbers worked out by hand, and against itself in another form."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import mstmm

ARM = """\
<?xml version="1.0"?>
<robot name="arm">
  <material name="steel"><color rgba="0.2 0.4 0.6 1"/></material>
  <link name="world"/>
  <joint name="mount" type="fixed">
    <parent link="world"/><child link="base"/><origin xyz="0 0 1" rpy="0 0 0.5"/>
  </joint>
  <link name="base"><inertial><mass value="9"/><inertia ixx="1" iyy="1" izz="1"/></inertial></link>
  <joint name="shoulder-1" type="revolute">
    <parent link="base"/><child link="1st arm"/>
    <origin xyz="0.1 0 0.2" rpy="0.3 -0.2 0.1"/><axis xyz="0 2 0"/>
    <limit lower="-1" upper="2" effort="30" velocity="5"/>
    <dynamics damping="0.4" friction="0.1"/>
  </joint>
  <link name="1st arm">
    <inertial>
      <origin xyz="0.3 0.02 0" rpy="0.4 0.5 -0.6"/><mass value="2"/>
      <inertia ixx="0.02" iyy="0.1" izz="0.11" ixy="0.003" ixz="0.001" iyz="-0.002"/>
    </inertial>
    <visual><geometry><box size="0.6 0.1 0.1"/></geometry><material name="steel"/></visual>
  </link>
  <joint name="flange" type="fixed">
    <parent link="1st arm"/><child link="tool"/><origin xyz="0.6 0 0" rpy="0 1 0"/>
  </joint>
  <link name="tool">
    <inertial><origin xyz="0 0 0.1"/><mass value="0.5"/>
      <inertia ixx="0.002" iyy="0.003" izz="0.001"/></inertial>
    <visual><geometry><mesh filename="package://arm/tool.dae"/></geometry></visual>
  </link>
  <joint name="jaw" type="prismatic">
    <parent link="tool"/><child link="finger"/><origin xyz="0 0.05 0.1"/><axis xyz="0 1 0"/>
    <limit lower="0" upper="0.04"/>
  </joint>
  <link name="finger"><inertial><mass value="0.1"/>
    <inertia ixx="1e-4" iyy="1e-4" izz="1e-4"/></inertial></link>
  <joint name="other jaw" type="prismatic">
    <parent link="tool"/><child link="other finger"/><origin xyz="0 -0.05 0.1"/>
    <axis xyz="0 -1 0"/><mimic joint="jaw" multiplier="2" offset="0.01"/>
  </joint>
  <link name="other finger"><inertial><mass value="0.1"/>
    <inertia ixx="1e-4" iyy="1e-4" izz="1e-4"/></inertial></link>
  <transmission name="t"/>
</robot>
"""


def write_robot_file(folder: Path, text: str, name: str = "arm.urdf") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def robot(links: str, joints: str = "") -> str:
    names = "".join(f'<link name="{name}"/>' for name in links.split())
    return f"<robot>\n{names}\n{joints}</robot>"


def joint(kind: str, parent: str, child: str, inside: str = "", name: str = "j") -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{kind}">{ends}{inside}</joint>\n'


def test_a_pendulum_swings_as_its_formula_says(tmp_path: Path) -> None:
    turned = joint("continuous", "base", "bob", '<origin rpy="1.2 0 0"/><axis xyz="0 0 1"/>')
    bob = (
        '<link name="bob"><inertial><origin xyz="0.5 0 0" rpy="0 0 1.5707963267948966"/>'
        '<mass value="2"/><inertia ixx="0.3" iyy="0.01" izz="0.3"/></inertial></link>'
    )
    text = f'<robot><link name="base"/>{turned}{bob}</robot>'
    model = mstmm.compile(mstmm.load_scene(write_robot_file(tmp_path, text)))
    q, lean = 0.4, np.sin(1.2)  # gravity along -z, of which the axis leaves sin(1.2) across
    expected = -2 * 9.81 * 0.5 * lean * np.cos(q) / (0.3 + 2 * 0.5**2)
    assert model.accelerations([q], [0.0])[0] == pytest.approx(expected, rel=1e-14)


def test_welded_links_move_as_bodies_of_their_own_do(tmp_path: Path) -> None:
    path = write_robot_file(tmp_path, ARM)
    one, many = (mstmm.import_robot(path, merge=merge) for merge in (True, False))
    assert [body.name for body in one.scene.body] == ["link_1st_arm", "finger", "other_finger"]
    assert one.names["tool"] == "link_1st_arm.tool" and one.names["base"] == "ground"
    assert many.names["tool"] == "tool" and many.names["base"] == "base"
    q, u = [0.3, 0.02, 0.05], [0.5, -0.2, -0.4]
    found = [mstmm.compile(each.scene).accelerations(q, u) for each in (one, many)]
    assert found[0] == pytest.approx(found[1], rel=1e-12)
    results = [mstmm.compile(each.scene).simulate(0.2, rtol=1e-10) for each in (one, many)]
    assert results[0].position(one.names["tool"])[-1] == pytest.approx(
        results[1].position("tool")[-1], abs=1e-8
    )


def test_what_joints_say_becomes_laws_couplings_and_notes(tmp_path: Path) -> None:
    found = mstmm.import_robot(write_robot_file(tmp_path, ARM), stops=1e4)
    shoulder, _, other = found.scene.hinge
    assert shoulder.name == "shoulder_1" and shoulder.axis == (0.0, 2.0, 0.0)
    assert shoulder.law.damping == (0.4,) and shoulder.law.friction[0].coulomb == 0.1
    assert (shoulder.law.limits[0].upper, shoulder.law.limits[0].stiffness) == (2.0, 1e4)
    assert other.initial is not None and other.initial.q == (0.01,)
    notes = [str(note).split(": ", 1)[1] for note in found.notes]
    assert "line 36: joint 'other jaw': mimics 'jaw', by a coupling" in notes
    assert "line 9: joint 'shoulder-1': its axis is normalised to length 1" in notes
    assert "line 25: link 'tool': not all of it is drawn" in notes
    assert "line 2: <transmission>: left out" in notes
    (shape,) = found.scene.shape
    assert (shape.on, shape.color) == ("link_1st_arm", "#336699")
    result = mstmm.compile(found.scene).simulate(0.3)
    assert result.q[:, 2] == pytest.approx(2 * result.q[:, 1] + 0.01, abs=1e-10)


def test_limits_are_no_stops_unless_they_get_a_stiffness(tmp_path: Path) -> None:
    found = mstmm.import_robot(write_robot_file(tmp_path, ARM))
    assert not any(entry.limits[0].acts for entry in (h.law for h in found.scene.hinge))
    assert (
        sum(note.text == "its limits are not stops; they are kept as rated" for note in found.notes)
        == 2
    )


def test_what_is_there_twice_or_unknown_is_noted(tmp_path: Path) -> None:
    """The first counts, as for urdfdom; nothing disappears without a note."""
    twice = """<robot><link name="base"/>
<link name="b"><inertial><mass value="1"/><inertia ixx=".1" iyy=".1" izz=".1"/></inertial>
<inertial><mass value="3" unit="kg"/><inertia ixx=".3" iyy=".3" izz=".3"/></inertial></link>
<joint name="j" type="revolute"><parent link="base"/><child link="b"/>
<axis xyz="0 1 0"/><axis xyz="1 0 0"/><origin xyz="0 0 1" quat_xyzw="0 0 1 0"/>
<limit lower="-1" upper="1"/><limit lower="-2" upper="2"/>
<dynamics damping="1" spring_stiffness="10" spring_reference="0.3"/>
<joint_properties damping="0.2"/></joint></robot>"""
    found = mstmm.import_robot(write_robot_file(tmp_path, twice))
    (body,), (hinge,) = found.scene.body, found.scene.hinge
    assert body.mass == 1.0 and hinge.axis == (0.0, 1.0, 0.0) and hinge.law.damping == (1.0,)
    notes = {str(note).split(": ", 1)[1] for note in found.notes}
    is_twice = "is given 2 times; the first applies, the others are left out"
    assert notes >= {
        f"line 2: link 'b': <inertial> {is_twice}",
        "line 3: link 'b': unknown attributes of <mass> left out: unit",
        f"line 4: joint 'j': <axis> {is_twice}",
        f"line 4: joint 'j': <limit> {is_twice}",
        "line 5: joint 'j': unknown attributes of <origin> left out: quat_xyzw",
        "line 7: joint 'j': unknown attributes of <dynamics> left out: "
        "spring_stiffness, spring_reference",
        "line 4: joint 'j': <joint_properties> in <joint> left out",
    }
    known = mstmm.import_robot(write_robot_file(tmp_path, ARM))
    assert not any("left out" in one.text for one in known.notes if "<transm" not in one.element)


def test_a_free_base_falls(tmp_path: Path) -> None:
    found = mstmm.import_robot(write_robot_file(tmp_path, ARM), base="free")
    assert found.names["base"] == "world.base" and found.scene.hinge[0].type == "free"
    result = mstmm.compile(found.scene).simulate(0.5, rtol=1e-9)
    place = result.position("world")[-1]
    momentum = result.momentum()[-1]
    total = 9 + 2 + 0.5 + 0.2
    assert momentum[2] == pytest.approx(-total * 9.81 * 0.5, rel=1e-9)
    assert np.isfinite(place).all()


def test_the_file_written_reads_back(tmp_path: Path) -> None:
    found = mstmm.import_robot(write_robot_file(tmp_path, ARM))
    again = mstmm.load_scene(write_robot_file(tmp_path, found.to_toml(), "arm.toml"))
    assert again == found.scene == mstmm.load_scene(tmp_path / "arm.urdf")


def test_a_joint_that_carries_no_mass_is_held(tmp_path: Path) -> None:
    text = ARM.replace("<transmission", joint("continuous", "tool", "sensor") + "<transmission")
    text = text.replace("</robot>", '<link name="sensor"/></robot>')
    found = mstmm.import_robot(write_robot_file(tmp_path, text))
    assert "j" not in found.names
    held = [note for note in found.notes if note.element == "joint 'j'"]
    assert "fixed, because" in held[0].text


def test_an_inertia_that_no_body_has_is_taken_and_told(tmp_path: Path) -> None:
    text = ARM.replace('ixx="0.002" iyy="0.003" izz="0.001"', 'ixx="0.2" iyy="3" izz="0.1"')
    found = mstmm.import_robot(write_robot_file(tmp_path, text), merge=False)
    assert any("violate the triangle inequality" in note.text for note in found.notes)
    assert mstmm.compile(found.scene).nu == 3


@pytest.mark.parametrize(
    ("izz", "taken"), [("-5e-20", 0.0), ("-1e-4", -1e-4)], ids=["rounding", "no rounding"]
)
def test_moments_below_0_by_rounding_are_0(tmp_path: Path, izz: str, taken: float) -> None:
    text = ARM.replace('iyy="0.003" izz="0.001"', f'iyy="0.002" izz="{izz}"')
    found = mstmm.import_robot(write_robot_file(tmp_path, text), merge=False)
    tool = next(body for body in found.scene.body if body.name == "tool")
    assert tool.inertia[:3] == (0.002, 0.002, taken)
    told = [note.text for note in found.notes if note.element == "link 'tool'"]
    dust = "moments of inertia below 0 by rounding set to 0"
    assert (dust in told) == (taken == 0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "not valid XML: no element found"),
        ("<robot>", "line 1: not valid XML: no element found"),
        ("<sdf/>", "expected <robot>, found <sdf>"),
        ("<robot/>", "the robot has no link"),
        ("\n<robot>\n<link/></robot>", "line 3: <link> has no name"),
        ('<robot><xacro:macro name="m"/></robot>', "this is a xacro file; expand it with"),
        (robot("a a"), "link 'a' is defined twice"),
        (robot("a b", joint("revolute", "a", "c")), "there is no link 'c'"),
        (robot("a b", joint("revolut", "a", "b")), 'did you mean "revolute"?'),
        (robot("a b", '<joint name="j" type="fixed"/>'), "joint 'j' has no <parent link=...>"),
        (robot("a b c", joint("fixed", "a", "c") + joint("fixed", "b", "c", name="k")),
         "link 'c' is the child of joint 'j' and of 'k'"),
        (robot("a b", joint("fixed", "a", "b") + joint("fixed", "b", "a", name="k")),
         "the joints around link 'a' form a cycle"),
        (robot("a b", joint("revolute", "a", "b", '<axis xyz="0 0 0"/>')), "expected an axis"),
        (robot("a b", joint("fixed", "a", "b", '<origin xyz="1 2"/>')),
         "<origin> xyz: expected 3 numbers in m, found '1 2'"),
        (robot("a b", joint("fixed", "a", "b", '<origin rpy="1 2 nan"/>')), "found '1 2 nan'"),
        (robot("a"), 'no link moves or has mass; try base = "free"'),
        ('<!DOCTYPE robot [<!ENTITY a "b">]><robot/>', "document types and entities are not"),
        ('<?xml version="1.0" encoding="nobody\'s"?><robot/>', "not valid XML: "),
        ('<?xml version="1.0" encoding="klingon"?><robot/>', "unknown encoding: klingon"),
        ("<robot>" + "<a>" * 200, "nested more than 100 deep"),
        ('<robot><link name="a"><inertial><mass value="-1"/></inertial></link></robot>',
         "link 'a': expected a mass of 0 kg or more, found -1"),
    ],
)  # fmt: skip
def test_files_that_are_no_robots(text: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(mstmm.SceneError) as raised:
        mstmm.import_robot(write_robot_file(tmp_path, text))
    assert message in str(raised.value)
    assert str(raised.value).startswith(str(tmp_path / "arm.urdf"))


def test_choices_that_are_none(tmp_path: Path) -> None:
    path = write_robot_file(tmp_path, ARM)
    with pytest.raises(mstmm.SceneError, match='base: expected "fixed" or "free", found'):
        mstmm.import_robot(path, base="flying")
    with pytest.raises(mstmm.SceneError, match="stops: expected a stiffness above 0"):
        mstmm.import_robot(path, stops=-1.0)
    with pytest.raises(mstmm.SceneError, match="stops: expected a stiffness above 0"):
        mstmm.import_robot(path, stops="1e4")  # type: ignore[arg-type]
    with pytest.raises(mstmm.SceneError, match="expected a robot's file ending in"):
        mstmm.import_robot(tmp_path / "arm.toml")


def test_meshes_lie_in_packages_above_and_collision_shapes_stand_in(tmp_path: Path) -> None:
    folder = tmp_path / "my robots" / "arm" / "urdf"
    folder.mkdir(parents=True)
    for name in ("plate.stl", "tool.dae", "hull.obj"):
        (folder.parent / name).write_text("o")
    mesh = '<geometry><mesh filename="package://{}"/></geometry>'
    text = ARM.replace('<box size="0.6 0.1 0.1"/>', '<mesh filename="package://arm/plate.stl"/>')
    text = text.replace(
        f"<visual>{mesh.format('arm/tool.dae')}</visual>",
        f"<visual>{mesh.format('arm/tool.dae')}</visual>"
        f"<collision>{mesh.format('my%20robots/arm/hull.obj')}</collision>"
        f"<collision>{mesh.format('other/none.stl')}</collision>",
    )
    found = mstmm.import_robot(write_robot_file(folder, text))
    drawn = [Path(shape.file or "").name for shape in found.scene.shape]
    assert drawn == ["plate.stl", "hull.obj"]
    told = [f"{note.element}: {note.text}" for note in found.notes]
    assert "link 'tool': drawn by its collision shapes" in told
    assert "link 'tool': not drawn: there is no mesh 'package://other/none.stl'" in told


def test_names_that_a_scene_takes_stay_and_others_are_told(tmp_path: Path) -> None:
    inertia = '<inertia ixx="1" iyy="1" izz="1"/>'
    links = "".join(
        f'<link name="{name}"><inertial><mass value="{mass}"/>{inertia}</inertial></link>'
        for name, mass in (("c-1", 1), ("c_1", 2))
    )
    joints = "".join(
        f'<joint name="{name}" type="continuous"><parent link="{on}"/><child link="{link}"/>'
        '<axis xyz="0 0 1"/></joint>'
        for name, on, link in (("j-1", "base", "c-1"), ("j_1", "c-1", "c_1"))
    )
    text = f'<robot><link name="base"/>{links}{joints}</robot>'
    found = mstmm.import_robot(write_robot_file(tmp_path, text))
    assert found.names["c_1"] == "c_1" and found.names["j_1"] == "j_1"
    assert found.names["c-1"] == "c_1_2" and found.names["j-1"] == "j_1_2"
    assert {body.name: body.mass for body in found.scene.body} == {"c_1_2": 1.0, "c_1": 2.0}
    (note,) = (str(note) for note in found.notes)
    assert "'c-1' is c_1_2, 'j-1' is j_1_2" in note


def test_what_says_too_little_is_told(tmp_path: Path) -> None:
    turned = joint("revolute", "base", "bob", '<limit lower="1" upper="-1" effort="9"/>')
    slid = joint("prismatic", "bob", "dot", '<limit lower="0" upper="0.5"/>', "slide")
    links = (
        '<link name="base"/><link name="bob"><inertial><mass value="2"/></inertial></link>'
        '<link name="dot"><inertial><inertia ixx="1" iyy="1" izz="1"/></inertial></link>'
    )
    path = write_robot_file(tmp_path, f"<robot>{links}{turned}{slid}</robot>")
    told = {note.element: note.text for note in mstmm.import_robot(path, stops=1e4).notes}
    assert told["link 'bob'"] == "a mass without <inertia>: a point mass"
    assert told["link 'dot'"] == "moments of inertia without a mass"
    notes = [note.text for note in mstmm.import_robot(path, stops=1e4).notes]
    assert "limits from 1 to -1 leave no range and are left out" in notes
    assert not any("from 0 to 0.5" in text for text in notes)


def test_links_that_are_no_bodies_and_those_without_mass_are_told_by_line(tmp_path: Path) -> None:
    text = ARM.replace('<link name="1st arm">', '<link name="swivel"/><link name="1st arm">')
    text = text.replace('<child link="1st arm"/>', '<child link="swivel"/>', 1)
    text = text.replace("<transmission", joint("continuous", "swivel", "1st arm") + "<transmission")
    path = write_robot_file(tmp_path, text)
    told = [str(note).split(": ", 1)[1] for note in mstmm.import_robot(path).notes]
    assert "line 5: link 'base': part of the ground" in told
    found = "part of its inboard body; its name refers to its frame there"
    assert f"line 22: link 'tool': {found}" in told
    assert "line 15: link 'swivel': moves without mass" in told
    kept = [note.text for note in mstmm.import_robot(path, merge=False).notes]
    assert found not in kept and "part of the ground" not in kept
