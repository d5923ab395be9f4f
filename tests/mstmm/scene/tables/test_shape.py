"""[[shape]]: what is refused, and that nothing moves otherwise."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import SceneError
from mstmm.runtime.model.result_loading import load_netcdf
from mstmm.runtime.result.result import Result
from mstmm.runtime.result.result_record import Record
from mstmm.runtime.result.scene3d.scene_builder import build_scene_graph
from tests.support.scenes import view as scenes

TETRAHEDRON = """\
v 0 0 0
v 10 0 0
v 0 20 0
v 0 0 30
f 1 3 2
f 1 2 4
f 1 4 3
f 2 3 4
"""


def with_shape(**shape: Any) -> mstmm.Scene:
    return mstmm.Scene(**{**scenes.SCENE, "shape": [shape]})


@pytest.mark.parametrize(
    ("shape", "message"),
    [
        ({"on": "hub", "type": "box"}, "size: missing; a box needs"),
        ({"on": "hub", "type": "box", "size": [1, 0, 1]}, "size: expected three lengths above 0"),
        ({"on": "hub", "type": "sphere", "radius": 1, "length": 1}, "a sphere has no length"),
        ({"on": "hub", "type": "ball", "radius": 1}, 'type: expected "box"'),
        ({"on": "hubb", "type": "sphere", "radius": 1}, 'did you mean "hub"'),
        ({"on": "hub", "type": "sphere", "radius": 1, "color": "red"}, 'such as "#4477aa"'),
        ({"on": "hub", "type": "sphere", "radius": 1, "opacity": 2}, "opacity: expected at most"),
        ({"on": "hub", "type": "sphere", "radius": 1, "scale": 2}, "only a mesh has a scale"),
        ({"on": "hub", "type": "mesh", "file": "hub.step"}, r"ending in \.stl or \.obj"),
    ],
)
def test_refusals(shape: dict[str, Any], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        with_shape(**shape)


def test_shapes_change_no_motion() -> None:
    bare = mstmm.compile(mstmm.Scene(**{**scenes.SCENE, "shape": []}), engine="looped")
    shaped = scenes.model()
    q, u = bare.initial_state()
    assert np.array_equal(bare.accelerations(q, u), shaped.accelerations(q, u))


def test_scenes_with_shapes_are_written_and_read_again(tmp_path: Path) -> None:
    scene = mstmm.Scene(**scenes.SCENE)
    path = tmp_path / "scene.toml"
    path.write_text(scene.to_toml())
    assert mstmm.load_scene(path) == scene


def test_meshes(tmp_path: Path) -> None:
    (tmp_path / "hub.obj").write_text(TETRAHEDRON)
    file = str(tmp_path / "hub.obj")
    shape = {"on": "hub", "type": "mesh", "file": file, "scale": 0.01, "position": [0, 0, 1]}
    run = mstmm.compile(with_shape(**shape), engine="looped").simulate(0.0)
    [mesh] = [s for s in build_scene_graph(run, "mesh").solids if s.part == "shape1"]
    assert len(mesh.surface.faces) == 4
    assert mesh.surface.vertices.max(axis=0) == pytest.approx([0.1, 0.2, 1.3])


def by_file(run: Result, folder: Path) -> Record:
    first = load_netcdf(run.save(folder / "run.nc"))
    return load_netcdf(first.save(folder / "again.nc"))


def by_pickle(run: Result, folder: Path) -> Record:
    path = folder / "run.pickle"
    path.write_bytes(pickle.dumps(run))
    sent: Record = pickle.loads(path.read_bytes())
    return sent


@pytest.mark.parametrize("sent", [by_file, by_pickle])
def test_meshes_go_with_a_result(tmp_path: Path, sent: Callable[[Result, Path], Record]) -> None:
    file = tmp_path / "hub.obj"
    file.write_text(TETRAHEDRON)
    scene = with_shape(on="hub", type="mesh", file=str(file))
    run = mstmm.compile(scene, engine="looped").simulate(0.0)
    before, there = build_scene_graph(run, "mesh").solids, sent(run, tmp_path)
    file.unlink()
    for was, solid in zip(before, build_scene_graph(there, "mesh").solids, strict=True):
        assert np.array_equal(solid.surface.vertices, was.surface.vertices)
        assert np.array_equal(solid.surface.faces, was.surface.faces)


@pytest.mark.parametrize("text", [None, "", "v 1 2 3\n", "solid of no kind\n"])
def test_meshes_that_are_none(tmp_path: Path, text: str | None) -> None:
    path = tmp_path / "hub.stl"
    if text is not None:
        path.write_text(text)
    scene = with_shape(on="hub", type="mesh", file=str(path))
    run = mstmm.compile(scene, engine="looped").simulate(0.0)
    with pytest.raises(SceneError, match='shape "shape1": file'):
        build_scene_graph(run, "mesh")


@pytest.mark.parametrize("how", ["above", "absolute", "link", "missing"])
def test_a_scene_file_names_meshes_of_its_own_folder_alone(tmp_path: Path, how: str) -> None:
    folder = tmp_path / "scene"
    folder.mkdir()
    (tmp_path / "mesh.stl").write_text("solid x\nendsolid x\n")
    (folder / "link.stl").symlink_to(tmp_path / "mesh.stl")
    (folder / "own.stl").write_text("solid x\nendsolid x\n")
    names = {
        "above": "../mesh.stl", "absolute": str(tmp_path / "mesh.stl"), "link": "link.stl",
        "missing": "nowhere.stl",
    }  # fmt: skip
    for name, refused in ((names[how], True), ("own.stl", False)):
        (folder / "scene.toml").write_text(
            'gravity = [0, 0, 0]\n[[body]]\nname = "b"\nmass = 1.0\n[[hinge]]\nname = "h"\n'
            'type = "prismatic"\ninboard = "ground"\noutboard = "b"\n[[shape]]\non = "b"\n'
            f'type = "mesh"\nfile = "{name}"\n'
        )
        if refused:
            with pytest.raises(mstmm.SceneError, match=r"shape.*folder of the scene"):
                mstmm.load_scene(folder / "scene.toml")
        else:
            assert mstmm.load_scene(folder / "scene.toml").shape[0].file == str(folder / name)
