"""Elastic bodies from meshes of solid elements, by scikit-fem and meshio (extra: fem)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.optional_packages import missing_package_error

from ...platform_support.safe_files import require_regular_file
from .finite_element_model import ElasticModel
from .mesh_file_references import check_referenced_files
from .surface_mesh import boundary_triangles

#: Cells of solids as meshio calls them, and the mesh that scikit-fem makes of them.
SOLIDS = ("tetra", "tetra10", "hexahedron", "hexahedron27")
#: Points of integration that are taken together.
_TOGETHER = 20_000
#: Entries of all elements' stiffness matrices: 4 GB, and about a minute.
MOST_ENTRIES = 40_000_000

LOCKING = (
    "elements of degree 1 are too stiff in bending (by 30 % in frequency with two layers); "
    "take order = 2, or check against a mesh with many layers"
)


@dataclass(frozen=True)
class Material:
    """Isotropic linear elastic material: young (Pa), poisson, density (kg/m3)."""

    young: float
    poisson: float
    density: float

    @property
    def lame(self) -> tuple[float, float]:
        """Lame's constants lambda and mu, Pa."""
        e, nu = self.young, self.poisson
        return e * nu / ((1 + nu) * (1 - 2 * nu)), e / (2 * (1 + nu))


def _library(what: str) -> Any:
    try:
        import skfem
    except ImportError as error:
        raise missing_package_error("fem", what, error) from None
    return skfem


def box_mesh(size: Sequence[float], divisions: Sequence[int], corner: Sequence[float]) -> Any:
    """Hexahedra of a block: size (m), divisions along x, y, z, corner of least x, y, z (m)."""
    skfem = _library("an elastic block")
    lines = [
        np.linspace(c, c + s, int(d) + 1) for s, d, c in zip(size, divisions, corner, strict=True)
    ]
    return skfem.MeshHex.init_tensor(*lines)


def read_mesh(path: Path, where: str, scale: float = 1.0) -> Any:
    """The solid cells of any file that meshio reads, lengths times `scale`.

    Raises SceneError for a file that is no mesh, has no solid cells or several kinds of them,
    EnvironmentFailure without the extra.
    """
    require_regular_file(path, where)
    skfem = _library("a mesh")
    try:
        import meshio
        from skfem.io.meshio import from_meshio
    except ImportError as error:
        raise missing_package_error("fem", "a mesh", error) from None
    if not path.exists():
        raise SceneError(f"{where}: there is no file {path}; give the path of a mesh")
    check_referenced_files(path, where)
    try:
        with redirect_stdout(StringIO()):  # it prints empty lines
            read = meshio.read(path)
    except (Exception, SystemExit) as error:  # dozens of formats, each fails in its own way
        why = " ".join(str(error).split()) or type(error).__name__
        raise SceneError(
            f"{where}: {path.name} is no mesh that meshio reads: {why:.300}; write it again"
        ) from None
    _refuse_lost_nodes(read, path, where)
    kinds = sorted({block.type for block in read.cells if block.dim == 3})
    if len(kinds) != 1 or kinds[0] not in SOLIDS:
        raise SceneError(
            f"{where}: {path.name}: expected solid cells of one kind out of {', '.join(SOLIDS)}, "
            f"found {', '.join(kinds) or 'none'}; write the mesh with one of them"
        )
    mesh = from_meshio(read, ignore_orientation=True)
    assert isinstance(mesh, skfem.Mesh)
    if (
        not _curved(skfem, mesh) and len(np.unique(mesh.t)) < mesh.nvertices
    ):  # such as the centres of arcs
        mesh = mesh.remove_unused_nodes()
    return mesh.scaled(scale) if scale != 1.0 else mesh


def _refuse_lost_nodes(read: Any, path: Path, where: str) -> None:
    """Cells must name nodes that are there: what works with them would read past their end."""
    for block in read.cells:
        data = np.asarray(block.data)
        odd = data.dtype == object or (
            data.size and not 0 <= data.min() <= data.max() < len(read.points)
        )
        if odd:
            raise SceneError(
                f"{where}: {path.name}: expected cells of nodes 0 to {len(read.points) - 1}, found "
                f"a {block.type} with a node that the mesh does not have; write the mesh again"
            )
    if not np.isfinite(read.points).all():
        raise SceneError(f"{where}: {path.name}: expected nodes at finite places, found nan or inf")


def _curved(skfem: Any, mesh: Any) -> bool:
    """Cells with nodes between their corners."""
    return isinstance(mesh, (skfem.MeshTet2, skfem.MeshHex2))


def check_element_count(elements: int, hexahedra: bool, order: int, where: str) -> None:
    """SceneError for meshes whose matrices would take minutes and many gigabytes to assemble."""
    entries = {(False, 1): 12, (False, 2): 30, (True, 1): 24, (True, 2): 81}[hexahedra, order] ** 2
    most = MOST_ENTRIES // entries
    if elements > most:
        raise SceneError(
            f"{where}: expected {most} {'hexahedra' if hexahedra else 'tetrahedra'} of degree "
            f"{order} or fewer, found {elements}; take fewer divisions or a coarser mesh, or name "
            "the matrices of a reduced model in `matrices`"
        )


def mesh_model(
    mesh: Any,
    material: Material,
    order: int,
    where: str,
    look: Callable[[ElasticModel], None] = lambda outline: None,
) -> ElasticModel:
    """Matrices of a mesh of solid elements with displacements of degree `order` (1 or 2).

    `look` sees nodes and sets, in a model with empty matrices, before anything long is begun.
    Raises SceneError for elements without volume, for more of them than can be assembled, and for
    degree 1 on cells of degree 2, where rotations of the body would strain it.
    """
    skfem = _library("an elastic mesh")
    if order == 1 and _curved(skfem, mesh):
        raise SceneError(
            f"{where}: order: expected 2 on cells of degree 2, found 1; leave order out"
        )
    check_element_count(mesh.nelements, isinstance(mesh, skfem.MeshHex), order, where)
    element = _element(skfem, mesh, order)
    look(_outline(skfem, mesh, element, where))
    vector = _basis(skfem, mesh, skfem.ElementVector(element), order, where)
    scalar = vector.with_element(element)
    _refuse_inverted(scalar, where)
    density = material.density
    mass = skfem.BilinearForm(lambda u, v, w: density * u * v).assemble(scalar)
    return ElasticModel(
        where=where,
        mass=_each_direction(mass),
        stiffness=_stiffness(scalar, material),
        nodes=np.ascontiguousarray(scalar.doflocs.T),
        scalar_mass=mass.tocsr(),
        sets=_sets(mesh, scalar),
        stress=MeshStress(vector, material),
        faces=boundary_triangles(mesh, scalar),
        definite=True,  # sums of squares with positive weights
        notes=(f"{mesh.nelements} elements of degree {order}, {vector.N} unknowns",),
        warnings=(f"{where}: {LOCKING}",) if order == 1 else (),
    )


def _outline(skfem: Any, mesh: Any, element: Any, where: str) -> ElasticModel:
    """Nodes and sets alone."""
    from scipy import sparse

    scalar = _basis(skfem, mesh, element, 1, where)
    nodes = np.ascontiguousarray(scalar.doflocs.T)
    empty = sparse.csr_array((3 * len(nodes), 3 * len(nodes)))
    return ElasticModel(where, empty, empty, nodes, sets=_sets(mesh, scalar))


def _element(skfem: Any, mesh: Any, order: int) -> Any:
    hexahedra = isinstance(mesh, skfem.MeshHex)
    if order == 1:
        return skfem.ElementHex1() if hexahedra else skfem.ElementTetP1()
    return skfem.ElementHex2() if hexahedra else skfem.ElementTetP2()


def _basis(skfem: Any, mesh: Any, element: Any, order: int, where: str) -> Any:
    try:
        return skfem.Basis(mesh, element, intorder=2 * order)
    except Exception as error:  # the library raises this very class for cells that are folded
        if "Jacobian" not in str(error):
            raise
        raise SceneError(
            f"{where}: expected cells that are not folded, found one whose map has no inverse "
            f"({error}); check the order of the nodes in the cells of the mesh"
        ) from None


def _refuse_inverted(scalar: Any, where: str) -> None:
    volumes = scalar.dx.sum(axis=1)
    flat = np.flatnonzero(~(volumes > 0))
    if len(flat):
        raise SceneError(
            f"{where}: expected elements with a volume, found {len(flat)} without (the first is "
            f"element {flat[0]}, counted from 0); mend the mesh"
        )


def _each_direction(scalar: Any) -> Any:
    """scalar (x) 1_3, node by node."""
    from scipy import sparse

    return sparse.csr_array(sparse.kron(sparse.csr_array(scalar), sparse.eye_array(3)))


def _stiffness(scalar: Any, material: Material) -> Any:
    """Stiffness of (8.25) to (8.32) of Rui, Wang, Zhang in their weak form, node by node.

    For all elements at once: as a form of vectors every pair of shapes would be taken by itself.
    """
    from scipy import sparse

    first, second = material.lame
    shapes, cells = scalar.element_dofs.shape
    along = np.stack([np.asarray(one[0].grad) for one in scalar.basis])  # shape, axis, cell, point
    points = along.transpose(2, 0, 1, 3).reshape(cells, 3 * shapes, -1)
    weighted = points * np.asarray(scalar.dx)[:, None, :]
    pairs = (weighted @ points.transpose(0, 2, 1)).reshape(cells, shapes, 3, shapes, 3)
    alike = np.trace(pairs, axis1=2, axis2=4)[:, :, None, :, None] * np.eye(3)[:, None, :]
    local = first * pairs + second * (pairs.swapaxes(2, 4) + alike)
    places = (3 * scalar.element_dofs.T[:, :, None] + np.arange(3)).reshape(cells, 3 * shapes)
    rows = np.repeat(places, 3 * shapes, axis=1).ravel()
    columns = np.tile(places, (1, 3 * shapes)).ravel()
    size = 3 * scalar.N
    return sparse.csr_array(sparse.coo_array((local.ravel(), (rows, columns)), shape=(size, size)))


def _sets(mesh: Any, scalar: Any) -> Mapping[str, Any]:
    boundaries = mesh.boundaries or {}
    return {
        name: np.unique(scalar.get_dofs(np.asarray(facets)).flatten())
        for name, facets in boundaries.items()
    }


@dataclass(frozen=True)
class MeshStress:
    """Stiffness under stress of a mesh: int sigma_ij u_c,i u_c,j."""

    basis: Any
    material: Material

    def __call__(self, static: ArrayLike, shapes: ArrayLike) -> Array:
        """(loads, n, n) N/m of shapes (u, n) under the stresses of `static` (u, loads)."""
        states, modes = self.gradients(np.asarray(static)), self.gradients(np.asarray(shapes))
        weights = np.asarray(self.basis.dx).reshape(-1)
        n = modes.shape[0]
        found = np.zeros((states.shape[0], n, n))
        for begin in range(0, len(weights), _TOGETHER):
            some = slice(begin, begin + _TOGETHER)
            part = modes[..., some]
            for load, gradient in enumerate(states[..., some]):
                stress = self._stress(gradient) * weights[some]
                turned = np.einsum("ijp,ncjp->ncip", stress, part)
                found[load] += part.reshape(n, -1) @ turned.reshape(n, -1).T
        return found

    def _stress(self, gradient: Array) -> Array:
        first, second = self.material.lame
        strain = (gradient + gradient.transpose(1, 0, 2)) / 2
        volume = np.einsum("iip->p", strain)
        return np.asarray(2 * second * strain + first * np.eye(3)[:, :, None] * volume)

    def gradients(self, fields: Array) -> Array:
        """(k, 3, 3, points): derivative of component c along i at the points of integration."""
        return np.stack([
            np.asarray(self.basis.interpolate(field).grad).reshape(3, 3, -1) for field in fields.T
        ])  # fmt: skip
