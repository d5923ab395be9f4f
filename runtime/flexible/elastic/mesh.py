"""Finite-element models from meshes of solids, by scikit-fem and meshio (extra "fem")."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import ArrayLike

from mstmm.array_validation import Array
from mstmm.display import escape_control_characters
from mstmm.errors import SceneError
from mstmm.optional_packages import missing_package_error

from ...platform_support.safe_files import require_regular_file
from .finite_element_model import ElasticModel
from .surface_mesh import boundary_triangles

#: Supported solid cells, by their names in meshio.
SOLIDS = ("tetra", "tetra10", "hexahedron", "hexahedron27")
#: Number of integration points per chunk.
_CHUNK_POINTS = 20_000
#: Largest number of entries of all element stiffness matrices: 4 GB, and about a minute.
MAX_ENTRIES = 40_000_000

LOCKING = (
    "elements of degree 1 are too stiff in bending (by 30 % in frequency with two layers); "
    "use order = 2, or compare with a mesh with many layers"
)


@dataclass(frozen=True)
class Material:
    """Isotropic linear elastic material: young (Pa), poisson, density (kg/m^3)."""

    young: float
    poisson: float
    density: float

    @property
    def lame(self) -> tuple[float, float]:
        """Lame's constants lambda and mu, Pa."""
        e, nu = self.young, self.poisson
        return e * nu / ((1 + nu) * (1 - 2 * nu)), e / (2 * (1 + nu))


def _load_skfem(what: str) -> Any:
    try:
        import skfem
    except ImportError as error:
        raise missing_package_error("fem", what, error) from None
    return skfem


def box_mesh(size: Sequence[float], divisions: Sequence[int], corner: Sequence[float]) -> Any:
    """Hexahedral mesh of a block: size (m), divisions, corner of least x, y, z (m)."""
    skfem = _load_skfem("an elastic block")
    lines = [
        np.linspace(c, c + s, int(d) + 1) for s, d, c in zip(size, divisions, corner, strict=True)
    ]
    return skfem.MeshHex.init_tensor(*lines)


def read_mesh(path: Path, where: str, scale: float = 1.0) -> Any:
    """Mesh of the solid cells of a file that meshio reads, with lengths times `scale`.

    Raises SceneError for a file that is not a mesh or has no or several kinds of solid cells,
    EnvironmentFailure without the extra.
    """
    require_regular_file(path, where)
    skfem = _load_skfem("a mesh")
    try:
        import meshio
        from skfem.io.meshio import from_meshio
    except ImportError as error:
        raise missing_package_error("fem", "a mesh", error) from None
    if not path.exists():
        raise SceneError(f"{where}: there is no file {path}; give the path of a mesh")
    check_referenced_files(path, where)
    try:
        with redirect_stdout(StringIO()):  # meshio prints empty lines
            file_mesh = meshio.read(path)
    except (Exception, SystemExit) as error:  # each format of meshio raises other errors
        reason = " ".join(str(error).split()) or type(error).__name__
        raise SceneError(
            f"{where}: {path.name} is not a mesh that meshio can read: {reason:.300}; export it "
            "again"
        ) from None
    _check_nodes(file_mesh, path, where)
    cell_types = sorted({block.type for block in file_mesh.cells if block.dim == 3})
    if len(cell_types) != 1 or cell_types[0] not in SOLIDS:
        raise SceneError(
            f"{where}: {path.name}: expected solid cells of one kind out of {', '.join(SOLIDS)}, "
            f"found {', '.join(cell_types) or 'none'}; export the mesh with one of them"
        )
    mesh = from_meshio(file_mesh, ignore_orientation=True)
    assert isinstance(mesh, skfem.Mesh)
    if not _has_midside_nodes(skfem, mesh) and len(np.unique(mesh.t)) < mesh.nvertices:
        # Unused nodes are, for example, the centres of arcs.
        mesh = mesh.remove_unused_nodes()
    return mesh.scaled(scale) if scale != 1.0 else mesh


def _check_nodes(content: Any, path: Path, where: str) -> None:
    """Raise SceneError for cells with undefined nodes, which would cause reads out of bounds."""
    for block in content.cells:
        data = np.asarray(block.data)
        is_invalid = data.dtype == object or (
            data.size and not 0 <= data.min() <= data.max() < len(content.points)
        )
        if is_invalid:
            raise SceneError(
                f"{where}: {path.name}: expected cells of nodes 0 to {len(content.points) - 1}, "
                f"found a {block.type} with an undefined node; export the mesh again"
            )
    if not np.isfinite(content.points).all():
        raise SceneError(
            f"{where}: {path.name}: expected finite coordinates of nodes, found nan or inf; "
            "export the mesh again"
        )


def _has_midside_nodes(skfem: Any, mesh: Any) -> bool:
    """Whether cells have nodes between their corners."""
    return isinstance(mesh, (skfem.MeshTet2, skfem.MeshHex2))


def check_element_count(elements: int, hexahedra: bool, order: int, where: str) -> None:
    """Raise SceneError for meshes that would take minutes and many gigabytes to assemble."""
    entries = {(False, 1): 12, (False, 2): 30, (True, 1): 24, (True, 2): 81}[hexahedra, order] ** 2
    max_count = MAX_ENTRIES // entries
    if elements > max_count:
        raise SceneError(
            f"{where}: expected {max_count} {'hexahedra' if hexahedra else 'tetrahedra'} of degree "
            f"{order} or fewer, found {elements}; use fewer divisions or a coarser mesh, or give "
            "the matrices of a reduced model in `matrices`"
        )


def mesh_model(
    mesh: Any,
    material: Material,
    order: int,
    where: str,
    look: Callable[[ElasticModel], None] = lambda outline: None,
) -> ElasticModel:
    """Finite-element model of a mesh of solids with displacements of degree `order` (1 or 2).

    `look` is called with nodes and sets, in a model with empty matrices, before the assembly, to
    find errors early.  Raises SceneError for elements without volume, for too many elements, and
    for degree 1 on cells of degree 2, where rotations of the body would cause strain.
    """
    skfem = _load_skfem("an elastic mesh")
    if order == 1 and _has_midside_nodes(skfem, mesh):
        raise SceneError(
            f"{where}: order: expected 2 on cells of degree 2, found 1; leave order out"
        )
    check_element_count(mesh.nelements, isinstance(mesh, skfem.MeshHex), order, where)
    element = _element(skfem, mesh, order)
    look(_outline(skfem, mesh, element, where))
    vector = _basis(skfem, mesh, skfem.ElementVector(element), order, where)
    scalar = vector.with_element(element)
    _check_volumes(scalar, where)
    density = material.density
    mass = skfem.BilinearForm(lambda u, v, w: density * u * v).assemble(scalar)
    return ElasticModel(
        where=where,
        mass=_expand_to_directions(mass),
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
    """Model with nodes and sets, and empty matrices."""
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
    except Exception as error:  # scikit-fem raises plain Exception for folded cells
        if "Jacobian" not in str(error):
            raise
        raise SceneError(
            f"{where}: expected cells that are not folded, found one with a singular mapping "
            f"({error}); check the order of the nodes in the cells of the mesh"
        ) from None


def _check_volumes(scalar: Any, where: str) -> None:
    volumes = scalar.dx.sum(axis=1)
    flat = np.flatnonzero(~(volumes > 0))
    if len(flat):
        raise SceneError(
            f"{where}: expected elements with a volume, found {len(flat)} without (the first is "
            f"element {flat[0]}, counted from 0); repair the mesh"
        )


def _expand_to_directions(scalar: Any) -> Any:
    """Matrix scalar (x) 1_3 over the three directions, node by node."""
    from scipy import sparse

    return sparse.csr_array(sparse.kron(sparse.csr_array(scalar), sparse.eye_array(3)))


def _stiffness(scalar: Any, material: Material) -> Any:
    """Stiffness matrix, node by node: the weak form of (8.25) to (8.32) of Rui, Wang, Zhang.

    Assembled for all elements at once; a vector form of scikit-fem would loop over pairs of shapes.
    """
    from scipy import sparse

    lame_lambda, lame_mu = material.lame
    shapes, cells = scalar.element_dofs.shape
    # Axes of the array: shape, axis, cell, point.
    gradients = np.stack([np.asarray(field[0].grad) for field in scalar.basis])
    flat = gradients.transpose(2, 0, 1, 3).reshape(cells, 3 * shapes, -1)
    weighted = flat * np.asarray(scalar.dx)[:, None, :]
    pairs = (weighted @ flat.transpose(0, 2, 1)).reshape(cells, shapes, 3, shapes, 3)
    diagonal = np.trace(pairs, axis1=2, axis2=4)[:, :, None, :, None] * np.eye(3)[:, None, :]
    local = lame_lambda * pairs + lame_mu * (pairs.swapaxes(2, 4) + diagonal)
    dofs = (3 * scalar.element_dofs.T[:, :, None] + np.arange(3)).reshape(cells, 3 * shapes)
    rows = np.repeat(dofs, 3 * shapes, axis=1).ravel()
    columns = np.tile(dofs, (1, 3 * shapes)).ravel()
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
    """Geometric stiffness of a mesh under stress: int sigma_ij u_c,i u_c,j."""

    basis: Any
    material: Material

    def __call__(self, static: ArrayLike, shapes: ArrayLike) -> Array:
        """Geometric stiffness (loads, n, n), N/m; arguments as in `StressStiffness`."""
        states, modes = self.gradients(np.asarray(static)), self.gradients(np.asarray(shapes))
        weights = np.asarray(self.basis.dx).reshape(-1)
        n = modes.shape[0]
        stiffness = np.zeros((states.shape[0], n, n))
        for start in range(0, len(weights), _CHUNK_POINTS):
            chunk = slice(start, start + _CHUNK_POINTS)
            mode_gradients = modes[..., chunk]
            for load, gradient in enumerate(states[..., chunk]):
                stress = self._stress(gradient) * weights[chunk]
                traction = np.einsum("ijp,ncjp->ncip", stress, mode_gradients)
                stiffness[load] += mode_gradients.reshape(n, -1) @ traction.reshape(n, -1).T
        return stiffness

    def _stress(self, gradient: Array) -> Array:
        lame_lambda, lame_mu = self.material.lame
        strain = (gradient + gradient.transpose(1, 0, 2)) / 2
        volume = np.einsum("iip->p", strain)
        return np.asarray(2 * lame_mu * strain + lame_lambda * np.eye(3)[:, :, None] * volume)

    def gradients(self, fields: Array) -> Array:
        """Gradients (k, 3, 3, points) of component c along i at the integration points."""
        return np.stack([
            np.asarray(self.basis.interpolate(field).grad).reshape(3, 3, -1) for field in fields.T
        ])  # fmt: skip


# --- files to which a mesh file refers ------------------------------------------------------------
#
# Formats that refer to other files: Abaqus (*INCLUDE), XDMF (DataItem), and HDF5 (external links,
# external storage, virtual data).  meshio follows them to any folder.

#: Suffixes of HDF5 files.
_HDF5 = (".h5", ".hdf5", ".hdf", ".h5m", ".med", ".cgns", ".hmf")


def check_referenced_files(path: Path, where: str) -> None:
    """Raise SceneError if `path` refers to files outside its folder, directly or not."""
    _check_references(path, path.parent.resolve(), where, ())


def _check_references(path: Path, folder: Path, where: str, parents: tuple[Path, ...]) -> None:
    chain = (*parents, path.resolve())
    for name, target in _references(path):
        if not target.resolve().is_relative_to(folder):
            raise SceneError(
                f"{where}: {escape_control_characters(path.name)} refers to "
                f"{escape_control_characters(name)}, which is not in "
                "its own folder; put that file next to the mesh"
            )
        if target.resolve() in chain:
            raise SceneError(
                f"{where}: {escape_control_characters(path.name)} includes itself; remove that line"
            )
        if target.is_file():
            _check_references(target, folder, where, chain)


def _references(path: Path) -> Iterator[tuple[str, Path]]:
    """References of a file, each with the path that meshio would open."""
    kind = path.suffix.lower()
    if kind == ".inp":
        yield from _abaqus_references(path)
    elif kind in (".xdmf", ".xmf"):
        yield from _xdmf_references(path)
    elif kind in _HDF5:
        yield from _hdf5_references(path)


def _abaqus_references(path: Path) -> Iterator[tuple[str, Path]]:
    with path.open(encoding="utf-8", errors="replace") as file:
        for line in file:
            if line.startswith("*") and line[1:].split(",")[0].strip().upper() == "INCLUDE":
                name = line.split("=")[-1].strip()
                target = Path(name)  # meshio looks in the current folder first
                yield name, target if target.exists() else path.parent / name


def _xdmf_references(path: Path) -> Iterator[tuple[str, Path]]:
    try:
        items = list(ElementTree.parse(path).iter("DataItem"))
    except (ElementTree.ParseError, ValueError):  # meshio reports the error
        return
    for item in items:
        text, form = (item.text or "").strip(), item.get("Format", "XML").upper()
        if form == "HDF":
            name = text.split(":")[0]
            yield name, path.resolve().parent / name
        elif form == "BINARY":
            yield text, Path(text)  # meshio reads it from the current folder


def _hdf5_references(path: Path) -> Iterator[tuple[str, Path]]:
    try:
        import h5py
    except ImportError:  # meshio cannot read it either
        return
    try:
        with h5py.File(path, "r") as file:
            names = list(_hdf5_links(h5py, file))
    except (OSError, RuntimeError, KeyError, ValueError):  # meshio reports the error
        return
    for name in names:
        yield name, path.parent / name


def _hdf5_links(h5py: Any, group: Any) -> Iterator[str]:
    for key in group:
        link = group.get(key, getlink=True)
        if isinstance(link, h5py.ExternalLink):
            yield str(link.filename)
        elif isinstance(link, h5py.HardLink):
            item = group[key]
            if isinstance(item, h5py.Group):
                yield from _hdf5_links(h5py, item)
            elif isinstance(item, h5py.Dataset):
                yield from (str(name) for name, _, _ in item.external or ())
                if item.is_virtual:
                    sources = (str(source.file_name) for source in item.virtual_sources())
                    yield from (name for name in sources if name != ".")
