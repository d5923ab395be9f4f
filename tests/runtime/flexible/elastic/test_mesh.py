"""Elastic bodies from mesh files, and the extra they need."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
import scipy.sparse.linalg
import skfem

import mstmm
from mstmm.errors import EnvironmentFailure, SceneError
from mstmm.runtime.flexible.elastic import mesh
from mstmm.runtime.flexible.elastic.modal_elastic import elastic_bodies
from tests.support.scenes import elastic_bar as bar


def bar_mesh() -> Any:
    """Tetrahedra in mm, with named surfaces, and one point that belongs to no cell."""
    lines = (np.linspace(0, 1000, 11), np.linspace(-25, 25, 2), np.linspace(-10, 10, 2))
    mesh = skfem.MeshTet.init_tensor(*lines)
    faces = [mesh.facets_satisfying(lambda x, at=at: np.isclose(x[0], at)) for at in (0, 1000)]
    triangles = np.vstack([mesh.facets[:, face].T for face in faces]) + 1
    groups = np.repeat([1, 2], [len(face) for face in faces])
    tags = [groups, np.full(mesh.nelements, 3)]
    return meshio.Mesh(
        np.vstack([[[5e3, 0, 0]], mesh.p.T]),
        [("triangle", triangles), ("tetra", mesh.t.T + 1)],
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data={"clamp": np.array([1, 2]), "free": np.array([2, 2]), "all": np.array([3, 3])},
    )


def write_mesh(path: Path, mesh: Any, **how: Any) -> Path:
    meshio.write(path, mesh, **how)
    return path


def table(path: Path, **changes: Any) -> dict[str, Any]:
    ends = {"root": {"set": "clamp"}, "tip": {"set": "free"}}
    return bar.table(**{"box": None, "mesh": str(path), "scale": 1e-3, "ends": ends} | changes)


def test_gmsh_file_with_named_surfaces(tmp_path: Path) -> None:
    path = write_mesh(tmp_path / "bar.msh", bar_mesh(), file_format="gmsh22", binary=False)
    found = bar.body(table(path))
    assert found.mass == pytest.approx(bar.MASS, rel=1e-12)
    assert np.allclose(found.first, [bar.MASS / 2, 0, 0], atol=1e-12)
    assert np.allclose(bar.frequencies(found)[:2], [103.36, 258.40], rtol=0.03)
    assert np.allclose(found.ports["tip"].position, [1.0, 0, 0], atol=1e-12)


def test_curved_cells(tmp_path: Path) -> None:
    """Cells of degree 2 bring their own degree; rotations stay free of strain."""
    curved = skfem.MeshTet2.from_mesh(
        skfem.MeshTet.init_tensor(
            *(np.linspace(0, s, n) for s, n in ((1, 7), (0.05, 2), (0.02, 2)))
        )
    )
    points = curved.doflocs.copy()
    points[1] += 0.2 * points[0] ** 2
    bent = type(curved)(points, curved.t)
    path = write_mesh(tmp_path / "bar.vtu", skfem.io.meshio.to_meshio(bent))
    ends = {"root": {"plane": [1, 0, 0, 0.0]}, "tip": {"plane": [1, 0, 0, 1.0]}}
    found = bar.body(table(path, scale=None, ends=ends))
    assert found.mass == pytest.approx(bar.MASS, rel=1e-12)
    assert found.first[1] == pytest.approx(bar.MASS * (0.025 + 0.2 / 3), rel=1e-12)
    with pytest.raises(SceneError, match="order: expected 2 on cells of degree 2, found 1"):
        bar.body(table(path, scale=None, ends=ends, order=1))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"mesh": "absent.msh"}, "there is no file"),
        ({"ends": {"root": {"set": "clmp"}}}, 'no named boundary .clmp.; did you mean "clamp"'),
        ({"ends": {"root": {"plane": [1, 0, 0, 0.5e-3]}}}, "the plane contains no node"),
        ({"ends": {"root": {"nodes": [4000]}}}, "expected numbers from 0 to"),
    ],
)
def test_refused(tmp_path: Path, changes: dict[str, Any], words: str) -> None:
    path = write_mesh(tmp_path / "bar.msh", bar_mesh(), file_format="gmsh22", binary=False)
    elastic = table(path, **changes)
    with pytest.raises(SceneError, match=words) as caught:
        elastic_bodies(mstmm.Scene(
            gravity=[0, 0, 0], elastic=[elastic],
            hinge=[{"name": "h", "type": "fixed", "inboard": "ground", "outboard": "bar.root"}],
        ))  # fmt: skip
    assert str(caught.value).startswith('elastic "bar"')


def test_files_that_are_no_solid_meshes(tmp_path: Path) -> None:
    text = tmp_path / "text.msh"
    text.write_text("nothing")
    with pytest.raises(
        SceneError, match=r'elastic "bar": text.msh is not a mesh that meshio can read'
    ):
        bar.body(table(text))
    flat = meshio.Mesh(np.eye(3), [("triangle", [[0, 1, 2]])])
    with pytest.raises(SceneError, match=r"expected solid cells of one kind .* found none"):
        bar.body(table(write_mesh(tmp_path / "flat.vtu", flat)))


@pytest.mark.parametrize("ending", ["vtu", "msh", "xdmf", "inp"])
@pytest.mark.parametrize("node", [10**9, 999, -3])
def test_cells_with_nodes_that_are_not_there(tmp_path: Path, ending: str, node: int) -> None:
    cells = np.array([[0, 1, 2, 3], [1, 2, 3, 4]])
    points = np.vstack([np.zeros(3), np.eye(3), np.ones(3)])
    cells[1, 2] = node
    path = write_mesh(tmp_path / f"bar.{ending}", meshio.Mesh(points, [("tetra", cells)]))
    with pytest.raises(
        SceneError, match=r'elastic "bar": bar.*: expected cells of nodes|not a mesh'
    ):
        bar.body(table(path))


def test_ends_are_looked_at_before_anything_long(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr("mstmm.runtime.flexible.elastic.mesh._stiffness")
    wrong = bar.table(ends={"root": {"plane": [1, 0, 0, 0.0]}, "tip": {"plane": [1, 0, 0, 7.0]}})
    with pytest.raises(SceneError, match=r"ends.tip: the plane contains no node"):
        bar.body(wrong)


def test_a_mesh_too_large_is_refused_unmade(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr("mstmm.runtime.flexible.elastic.modal_elastic.box_mesh")
    fine = bar.table()["box"] | {"divisions": [384, 384, 384]}
    with pytest.raises(SceneError, match=r"6096 hexahedra of degree 2 or fewer, found 56623104"):
        bar.body(bar.table(box=fine))
    with pytest.raises(SceneError, match=r"69444 hexahedra of degree 1 or fewer"):
        bar.body(bar.table(box=fine, order=1))


def test_a_factorisation_too_long_is_refused_unbegun(monkeypatch: pytest.MonkeyPatch) -> None:
    """A cube of as many cells as a plate needs far more."""
    for name in ("scipy.sparse.linalg.splu", "scipy.sparse.linalg.eigsh"):
        monkeypatch.delattr(name)
    monkeypatch.setattr("mstmm.runtime.flexible.elastic.matrices.MAX_WORK", 1e8)
    cube = bar.table()["box"] | {"divisions": [4, 4, 4]}
    with pytest.raises(SceneError, match=r"2187 unknowns .* 1e\+08 multiplications .*, found 4"):
        bar.body(bar.table(box=cube))


def test_meshes_are_factorised_sparsely_and_no_oftener_than_held(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A plate whose unknowns are taken as they come fills six times more than the matrix holds."""
    fills, known = [], scipy.sparse.linalg.splu

    def factorise_and_record(matrix: Any, *given: Any, **how: Any) -> Any:
        found = known(matrix, *given, **how)
        fills.append((found.L.nnz + found.U.nnz) / matrix.nnz)
        return found

    monkeypatch.setattr(scipy.sparse.linalg, "splu", factorise_and_record)
    box = {"size": [1.0, 0.05, 0.4], "divisions": [8, 1, 16]}
    bar.body(bar.table(box=box, modes=2))
    assert len(fills) == 2 and max(fills) < 3  # with both its sections held, then with one


@pytest.mark.parametrize("element", ["ElementTetP1", "ElementTetP2"])
def test_stiffness_is_that_of_the_form_of_vectors(element: str) -> None:
    from skfem.helpers import ddot, sym_grad, trace

    vector = skfem.Basis(
        skfem.MeshTet().refined(1), skfem.ElementVector(getattr(skfem, element)()), intorder=4
    )
    material = mesh.Material(young=3.0, poisson=0.3, density=1.0)
    first, second = material.lame

    def energy(u: Any, v: Any, w: Any) -> Any:
        strain, virtual = sym_grad(u), sym_grad(v)
        return first * trace(strain) * trace(virtual) + 2 * second * ddot(strain, virtual)

    expected = skfem.BilinearForm(energy).assemble(vector).toarray()
    found = mesh._stiffness(vector.with_element(getattr(skfem, element)()), material).toarray()
    np.testing.assert_allclose(found, expected, atol=1e-13 * np.abs(expected).max())


@pytest.mark.parametrize("package", ["skfem", "meshio"])
def test_missing_extra_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, package: str
) -> None:
    path = write_mesh(tmp_path / "bar.vtu", bar_mesh())
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(EnvironmentFailure, match=rf"needs the package {package}.*mstmm\[fem\]"):
        bar.body(table(path))
