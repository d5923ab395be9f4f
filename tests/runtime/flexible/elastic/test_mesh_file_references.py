"""A mesh reads no file outside its own folder, by whatever way its format has."""

from __future__ import annotations

from pathlib import Path

import h5py
import meshio
import numpy as np
import pytest

from mstmm.errors import SceneError
from mstmm.runtime.flexible.elastic.mesh import read_mesh

POINTS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
MESH = meshio.Mesh(POINTS, [("tetra", [[0, 1, 2, 3]])])


@pytest.fixture
def folders(tmp_path: Path) -> tuple[Path, Path]:
    """The folder of the scene and one outside."""
    found = tmp_path / "scene", tmp_path / "outside"
    for each in found:
        each.mkdir()
    return found


def check_refusal(path: Path) -> None:
    with pytest.raises(SceneError, match="not in its own folder; put that file next to the mesh"):
        read_mesh(path, "body")


def test_abaqus(folders: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    folder, outside = folders
    meshio.write(outside / "part.inp", MESH)
    mesh = folder / "mesh.inp"
    for name in ("../outside/part.inp", str(outside / "part.inp")):
        mesh.write_text(f"*Include, input={name}\n")
        check_refusal(mesh)
    meshio.write(folder / "part.inp", MESH)
    mesh.write_text("*INCLUDE, INPUT=part.inp\n")
    assert read_mesh(mesh, "body").nelements == 1
    monkeypatch.chdir(outside)  # where meshio would find another file of that name
    check_refusal(mesh)
    mesh.write_text("*INCLUDE, INPUT=inner.inp\n")
    (folder / "inner.inp").write_text("*INCLUDE, INPUT=../outside/part.inp\n")
    check_refusal(mesh)
    for again in ("mesh.inp", "inner.inp"):
        (folder / "inner.inp").write_text(f"*INCLUDE, INPUT={again}\n")
        with pytest.raises(SceneError, match="includes itself"):
            read_mesh(mesh, "body")


@pytest.mark.parametrize("form", ["HDF", "Binary"])
def test_xdmf(folders: tuple[Path, Path], form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    folder, _ = folders
    monkeypatch.chdir(folder)
    meshio.write("mesh.xdmf", MESH, data_format=form)
    assert read_mesh(folder / "mesh.xdmf", "body").nelements == 1
    text = (folder / "mesh.xdmf").read_text()
    for name in ("mesh.h5", "mesh0.bin"):
        text = text.replace(name, f"../outside/{name}")
    (folder / "mesh.xdmf").write_text(text)
    check_refusal(folder / "mesh.xdmf")


def test_hdf5(folders: tuple[Path, Path]) -> None:
    folder, outside = folders
    for link in ("external", "virtual"):
        meshio.write(folder / "mesh.xdmf", MESH, data_format="HDF")
        (folder / "mesh.h5").replace(outside / "mesh.h5")
        with h5py.File(outside / "mesh.h5") as true, h5py.File(folder / "mesh.h5", "w") as false:
            for name, data in true.items():
                if link == "external":
                    false[name] = h5py.ExternalLink("../outside/mesh.h5", name)
                else:
                    layout = h5py.VirtualLayout(data.shape, data.dtype)
                    layout[...] = h5py.VirtualSource(outside / "mesh.h5", name, data.shape)
                    false.create_virtual_dataset(name, layout)
        check_refusal(folder / "mesh.xdmf")
