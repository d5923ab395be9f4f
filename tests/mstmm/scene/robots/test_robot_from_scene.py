"""Scenes as URDF: what comes back is the scene, and what URDF does not say is told or refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.numerics.rotations import from_rpy, to_rpy
from mstmm.scene import HingeRating
from tests.mstmm.scene.robots.test_urdf import ARM, write_robot_file

HINGES: tuple[dict[str, Any], ...] = (
    {"name": "mast", "type": "pin", "inboard": "ground", "position": [0.1, 0.2, 0.3],
     "orientation": [0.3, -0.4, 0.5], "axis": [1, 2, 2], "law": {"damping": 0.3}},
    {"name": "boom", "type": "prismatic", "inboard": "part0.far", "axis": [0, 1, 1],
     "orientation": [0.1, 0.2, 0.7]},
    {"name": "ball", "type": "ball", "inboard": "part1.far", "orientation": [-1, 0.2, 0.1]},
    {"name": "bolt", "type": "fixed", "inboard": "part2", "orientation": [0.2, 0, 0]},
    {"name": "wheel", "type": "pin", "inboard": "part3.far", "axis": [1, 0, 0],
     "law": {"friction": {"coulomb": 0.2},
             "limits": {"lower": -1.0, "upper": 0.5, "stiffness": 1e3}}},
    {"name": "balloon", "type": "free", "inboard": "ground", "position": [0, 3, 0]},
)  # fmt: skip


def scene(**more: Any) -> mstmm.Scene:
    """One hinge of each kind; every other body is held by an end that is turned."""
    bodies = [
        {"name": f"part{k}", "mass": 1 + k, "center_of_mass": [0.1, 0.02 * k, 0.3],
         "inertia": [0.3, 0.4, 0.5, 0.01, -0.02, 0.03],
         "ends": {"far": {"position": [0.1, 0, 0.5 + k], "orientation": [0.1 * k, 0.3, 0.2]},
                  "grip": {"position": [0.1, -0.2, 0.05], "orientation": [0.4, 0.5, 0.6 + k]}}}
        for k in range(len(HINGES))
    ]  # fmt: skip
    held = [hinge | {"outboard": f"part{k}{'.grip' if k % 2 else ''}"}
            for k, hinge in enumerate(HINGES)]  # fmt: skip
    return mstmm.Scene(**{"gravity": [0, 0, -9.81], "body": bodies, "hinge": held} | more)


def back(one: mstmm.Scene, folder: Path, **choices: Any) -> Any:
    (folder / "back.urdf").write_text(mstmm.export_robot(one).text)
    return mstmm.import_robot(folder / "back.urdf", merge=False, **choices)


def test_a_scene_comes_back_and_moves_alike(tmp_path: Path, rng: np.random.Generator) -> None:
    one = scene()
    found = back(one, tmp_path, stops=1e3)
    ours, again = mstmm.compile(one), mstmm.compile(found.scene)
    assert ours.coordinate_layout.hinges.keys() <= again.coordinate_layout.hinges.keys()
    q, u = rng.uniform(-0.7, 0.7, (40, ours.nq)), rng.uniform(-1, 1, (40, ours.nu))
    there_q, there_u = np.zeros((40, again.nq)), np.zeros((40, again.nu))
    places = list[tuple[slice, slice]]()
    for name, slots in ours.coordinate_layout.hinges.items():
        other = again.coordinate_layout.hinges[name]
        if slots.nq >= 4:
            turn = q[:, slots.q + slots.nq - 4 : slots.q + slots.nq]
            turn /= np.linalg.norm(turn, axis=1, keepdims=True)
        there_q[:, other.q_slice], there_u[:, other.u_slice] = (
            q[:, slots.q_slice],
            u[:, slots.u_slice],
        )
        places.append((slots.u_slice, other.u_slice))
    wanted, got = ours.accelerations(q, u), again.accelerations(there_q, there_u)
    for mine, other_place in places:
        assert got[:, other_place] == pytest.approx(wanted[:, mine], rel=1e-12, abs=1e-11)
    runs = (x.simulate(0.0, initial=(a[0], b[0]))
            for x, a, b in ((ours, q, u), (again, there_q, there_u)))  # fmt: skip
    mine_run, other_run = runs
    frame = other_run.position(found.links["part4_far"])
    assert frame == pytest.approx(mine_run.position("part4.far"), abs=1e-13)


def test_a_robots_file_comes_back_as_the_same_scene(tmp_path: Path) -> None:
    first = mstmm.import_robot(write_robot_file(tmp_path, ARM), stops=1e4)
    exported = mstmm.export_robot(first.scene)
    (tmp_path / "again.urdf").write_text(exported.text)
    again = mstmm.import_robot(tmp_path / "again.urdf", stops=1e4)
    assert [one.name for one in again.scene.hinge] == [one.name for one in first.scene.hinge]
    assert again.tables["coupling"] == first.tables["coupling"]
    assert again.tables["shape"] == [
        {**shape, **{key: pytest.approx(shape[key]) for key in ("position", "orientation")
                     if key in shape}} for shape in first.tables["shape"]
    ]  # fmt: skip
    ours, theirs = mstmm.compile(first.scene), mstmm.compile(again.scene)
    q, u = ours.initial_state()
    assert theirs.accelerations(q, u + 0.1) == pytest.approx(
        ours.accelerations(q, u + 0.1), rel=1e-12
    )
    told = [f"{note.element}: {note.text}" for note in exported.notes]
    assert "hinge 'shoulder_1': left out: stiffness of its stops" in told


def test_what_urdf_does_not_say_is_told() -> None:
    changed = [dict(hinge) for hinge in scene().model_dump(mode="json")["hinge"]]
    changed[0] |= {"law": {"stiffness": 4.0, "effort": "2*t", "inertia": 0.1},
                   "initial": {"q": [0.2], "u": [0.0]}}  # fmt: skip
    more = {"gravity": [0, -9.81, 0], "hinge": changed,
            "load": [{"on": "part0", "force": [1, 0, 0]}],
            "shape": [{"on": "part1.far", "type": "capsule", "radius": 0.1, "length": 1}],
            "coupling": [{"name": "cam", "expression": "mast.q^2 - boom.q", "equals": 0.04}],
            }  # fmt: skip
    told = [f"{note.element}: {note.text}" for note in mstmm.export_robot(scene(**more)).notes]
    assert told[0] == ("hinge 'mast': left out: stiffness, efforts, inertia of its drive, start")
    for part in ("coupling 'cam'", "shape on 'part1.far'", "[[load]]", "gravity"):
        assert any(line.startswith(f"{part}: left out") for line in told), part


BAR = {"name": "bar", "mass": 1.0, "ends": {"tip": [1, 0, 0]}}
PIN = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "bar"}


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ({"hinge": [PIN, PIN | {"name": "other", "outboard": "bar.tip"}]}, "closes a loop"),
        ({"hinge": [PIN | {"type": "cylindrical"}]}, "no joint like a cylindrical hinge"),
        ({"hinge": [PIN], "constraint": [
            {"type": "distance", "from": "ground", "to": "bar.tip", "length": 1.0}
        ]}, "URDF has no closed loops"),
        ({"body": [], "hinge": [PIN], "beam": [
            {"name": "bar", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 10.0}
        ]}, "only rigid bodies"),
    ],
)  # fmt: skip
def test_what_urdf_cannot_say_is_refused(tables: dict[str, Any], message: str) -> None:
    with pytest.raises(mstmm.SceneError, match=message):
        mstmm.export_robot(mstmm.Scene(**{"gravity": [0, 0, -9.81], "body": [BAR]} | tables))


def excavator(*left_out: str) -> mstmm.Scene:
    """A bucket on a stick, turned by a rocker and a link; the load hangs on the bucket."""

    def pin(name: str, inboard: str, outboard: str) -> dict[str, Any]:
        return {"name": name, "type": "pin", "inboard": inboard, "outboard": outboard}

    pins = [
        pin("boom_pin", "ground", "boom"), pin("stick_pin", "boom.far", "stick"),
        pin("bucket_link", "link.far", "bucket.far"), pin("bucket_pin", "stick.far", "bucket"),
        pin("rocker_pin", "stick", "rocker"), pin("link_pin", "rocker.far", "link"),
        pin("load_pin", "bucket.far", "load"),
    ]  # fmt: skip
    names = ("boom", "stick", "bucket", "rocker", "link", "load")
    solid = {"mass": 1.0, "inertia": [0.1, 0.1, 0.1], "ends": {"far": [1, 0, 0]}}
    bodies = [solid | {"name": name} for name in names]
    hinges = [one for one in pins if one["name"] not in left_out]
    return mstmm.Scene(gravity=[0, 0, -9.81], body=bodies, hinge=hinges)


def test_a_loop_is_refused_by_the_hinge_that_is_cut() -> None:
    """That of the product's own analysis of loops; either hinge of the bucket may be left out."""
    scene = excavator()
    (cut,) = mstmm.compile(scene, engine="looped").loops.cut_hinges
    with pytest.raises(mstmm.SceneError) as told:
        mstmm.export_robot(scene)
    assert str(told.value).startswith(f'hinge "{cut}" closes a loop')
    assert 'body "bucket" has the inboard hinges "bucket_link" and "bucket_pin"' in str(told.value)
    assert "keep the bodies" in str(told.value)
    for name in ("bucket_link", "bucket_pin"):
        assert mstmm.export_robot(excavator(name)).joints >= 6


def test_arguments_that_are_none(tmp_path: Path) -> None:
    scene = mstmm.Scene(gravity=[0, 0, -9.81], body=[BAR], hinge=[PIN])
    for wrong in ("arm.toml", None):
        with pytest.raises(mstmm.SceneError, match="expected a Scene; mstmm"):
            mstmm.export_robot(wrong)  # type: ignore[arg-type]
    for name in ("a\x01b", 5):
        with pytest.raises(mstmm.SceneError, match="expected printable text"):
            mstmm.export_robot(scene, name)  # type: ignore[arg-type]
    path = tmp_path / "odd.urdf"
    path.write_text(mstmm.export_robot(scene, 'Ü "<&').text, "utf-8")
    assert mstmm.import_robot(path).scene.body[0].mass == BAR["mass"]


def test_three_angles_give_the_rotation_again(rng: np.random.Generator) -> None:
    quarter = np.pi / 2
    near = [[a, quarter + 10.0**-k, b] for a in (0.3, -2.0) for b in (1.0, 3.0) for k in range(17)]
    for angles in (*rng.uniform(-4, 4, (200, 3)), *near):
        matrix = from_rpy(angles.tolist() if hasattr(angles, "tolist") else angles)
        assert np.array(from_rpy(to_rpy(matrix))) == pytest.approx(np.array(matrix), abs=1e-15)
    for whole in np.ndindex(4, 4, 4):
        matrix = from_rpy([quarter * k for k in whole])
        assert from_rpy(to_rpy(matrix)) == matrix


@pytest.mark.parametrize("stops", [None, 1e4])
def test_what_joints_are_rated_for_comes_back(tmp_path: Path, stops: float | None) -> None:
    first = mstmm.import_robot(write_robot_file(tmp_path, ARM), stops=stops)
    shoulder, jaw, other = first.scene.hinge
    assert shoulder.rated == HingeRating(lower=-1.0, upper=2.0, effort=30.0, velocity=5.0)
    assert jaw.rated == HingeRating(lower=0.0, upper=0.04) and other.rated is None
    text = mstmm.export_robot(first.scene).text
    assert '<limit lower="-1.0" upper="2.0" effort="30.0" velocity="5.0" />' in text
    again = mstmm.load_scene(write_robot_file(tmp_path, text, "again.urdf"))
    assert [hinge.rated for hinge in again.hinge[:2]] == [shoulder.rated, jaw.rated]
    assert mstmm.load_scene(write_robot_file(tmp_path, first.to_toml(), "arm.toml")) == first.scene


def test_a_wheel_is_rated_without_a_range(tmp_path: Path) -> None:
    wheel = ARM.replace('"revolute"', '"continuous"').replace('"30"', '"-1"')
    found = mstmm.import_robot(write_robot_file(tmp_path, wheel))
    assert found.scene.hinge[0].rated == HingeRating(velocity=5.0)
    assert "limits of effort or velocity below 0 left out" in [note.text for note in found.notes]
    text = mstmm.export_robot(found.scene).text
    assert 'type="continuous"' in text and '<limit effort="1000000000.0" velocity="5.0" />' in text


@pytest.mark.parametrize("value", ["inf", "nan", "", "many"])
def test_ratings_that_are_no_numbers_are_left_out(tmp_path: Path, value: str) -> None:
    found = mstmm.import_robot(write_robot_file(tmp_path, ARM.replace('"30"', f'"{value}"')))
    assert found.scene.hinge[0].rated == HingeRating(lower=-1.0, upper=2.0, velocity=5.0)
    told = f"limits that are not finite numbers left out: effort '{value}'"
    assert told in [note.text for note in found.notes]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"rated": {"lower": 1.0, "upper": 1.0}}, "must be below upper \\(1\\)$"),
        ({"rated": {"lower": 1.0, "upper": 0.0}}, "rated.lower: lower \\(1\\) must be below upper"),
        ({"rated": {"effort": -1.0}}, "rated.effort: expected a number in N or N m, 0 or more"),
        ({"type": "ball", "rated": {"effort": 1.0}}, "rated: only hinges of one coordinate are"),
    ],
)
def test_ratings_that_are_none_are_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(mstmm.SceneError, match=message):
        mstmm.Scene(gravity=[0, 0, -9.81], body=[BAR], hinge=[PIN | changes])


@pytest.mark.parametrize(
    ("stops", "rated", "written_"),
    [
        ({"lower": 2.0}, {"upper": 1.0}, None),
        ({"lower": 2.0}, {"lower": -1.0, "upper": 1.0}, ("-1.0", "1.0")),
        ({"lower": 2.0, "upper": 3.0}, {"lower": -1.0, "upper": 1.0}, ("2.0", "3.0")),
        ({"lower": -0.5}, {"lower": -1.0, "upper": 1.0}, ("-0.5", "1.0")),
    ],
)
def test_a_range_is_never_upside_down(
    stops: dict[str, float], rated: dict[str, float], written_: tuple[str, str] | None
) -> None:
    pin = {**HINGES[0], "outboard": "rod", "law": {"limits": stops | {"stiffness": 10.0}}}
    rod = {"name": "rod", "mass": 1, "inertia": [1, 1, 1]}
    found = mstmm.export_robot(
        mstmm.Scene(gravity=[0, 0, -9.81], body=[rod], hinge=[pin | {"rated": rated}])
    )
    range_ = None if written_ is None else '<limit lower="{}" upper="{}"'.format(*written_)
    assert ("<limit" in found.text) == (range_ is not None) and (range_ or "") in found.text
    told = any("stops that its rated range contradicts" in note.text for note in found.notes)
    assert told == (stops == {"lower": 2.0})


def test_links_of_ends_have_names_of_their_own() -> None:
    bodies = [{"name": name, "mass": 1, "inertia": [1, 1, 1], "ends": {"tip": [0, 0, 1]}}
              for name in ("a", "b", "a_tip")]  # fmt: skip
    hinges = [{"name": f"to_{one['name']}", "type": "pin", "inboard": "ground",
               "outboard": one["name"]} for one in bodies]  # fmt: skip
    names = {"body": {"b_tip": "a_tip"}}
    for more in ({}, {"names": names}):
        text = mstmm.export_robot(
            mstmm.Scene(gravity=[0, 0, -9.81], body=bodies, hinge=hinges, **more)
        ).text
        links = [line for line in text.splitlines() if "<link" in line]
        assert len(links) == len(set(links)) == 7
