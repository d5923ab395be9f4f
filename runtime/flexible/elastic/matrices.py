"""Mass and stiffness matrices of an elastic body: arrays in memory or in a file (.npz)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.scene.validators.validation_messages import did_you_mean

from ...platform_support.safe_files import read_arrays, replace_atomically, require_regular_file
from .finite_element_model import ElasticModel

_MATRICES = ("mass", "stiffness", "scalar_mass")
_PARTS = ("data", "indices", "indptr")
_KEYS = (*_MATRICES, *(f"{m}_{p}" for m in _MATRICES for p in _PARTS), "nodes", "order")
_ORDERS = ("node", "component")


def save_matrices(
    path: str | Path,
    mass: Any,
    stiffness: Any,
    nodes: ArrayLike,
    scalar_mass: Any = None,
    order: str = "node",
) -> Path:
    """Write a file for the key `matrices` of an [[elastic]] table, such as "link.npz".

    Args:
        mass, stiffness: (u, u) arrays or scipy.sparse matrices, kg and N/m.
        nodes: (N, 3) m; u = 3 N, or 6 N where nodes have rotations.
        scalar_mass: (N, N) kg, if mass = scalar_mass (x) 1: then every moment is exact.
        order: "node" for x1 y1 z1 x2 ..., "component" for x1 x2 ... y1 y2 ...
    """
    arrays: dict[str, Any] = {"nodes": np.asarray(nodes, dtype=float), "order": np.array(order)}
    for key, matrix in zip(_MATRICES, (mass, stiffness, scalar_mass), strict=True):
        if matrix is not None:
            arrays |= _matrix_arrays(key, matrix)
    with replace_atomically(Path(path)) as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, **arrays)
    return Path(path)


def _matrix_arrays(key: str, matrix: Any) -> dict[str, Any]:
    from scipy import sparse

    if not sparse.issparse(matrix):
        return {key: np.asarray(matrix, dtype=float)}
    rows = sparse.csr_array(matrix)
    return {f"{key}_{part}": getattr(rows, part) for part in _PARTS}


def load_matrices(path: Path, where: str) -> ElasticModel:
    """Finite-element model from a file written by `save_matrices` or with the same keys.

    Raises SceneError for a file that cannot be read, for keys that are missing or unknown, and for
    arrays of inconsistent sizes.
    """
    arrays = _read_arrays(path, where)
    for key in arrays:
        if key not in _KEYS:
            raise SceneError(
                f"{where}: {path.name} has an unknown array {key!r}{did_you_mean(key, _KEYS)}"
            )
    order = str(arrays.pop("order", "node"))
    if order not in _ORDERS:
        raise SceneError(
            f'{where}: order: expected "node" (x1 y1 z1 x2 ...) or "component" (x1 x2 ... y1 '
            f"...), found {order!r}"
        )
    return from_arrays(
        where, _matrix(arrays, "mass", where), _matrix(arrays, "stiffness", where),
        _required_array(arrays, "nodes", where), _matrix(arrays, "scalar_mass", where), order,
    )  # fmt: skip


def _read_arrays(path: Path, where: str) -> dict[str, Any]:
    remedy = "write it with mstmm.runtime.flexible.elastic.save_matrices"
    require_regular_file(path, where)
    try:
        return read_arrays(path)
    except FileNotFoundError:
        raise SceneError(f"{where}: there is no file {path}; {remedy}") from None
    except ValueError as error:
        raise SceneError(
            f"{where}: {path} is not a file of arrays (.npz): {error}; {remedy}"
        ) from None


def _required_array(arrays: dict[str, Any], key: str, where: str) -> Any:
    if key not in arrays:
        raise SceneError(f"{where}: the array {key!r} is missing; the file needs mass, stiffness "
                         "and nodes")  # fmt: skip
    return arrays[key]


def _matrix(arrays: dict[str, Any], key: str, where: str) -> Any:
    """Dense array, sparse matrix from its three parts, or None for an absent scalar mass."""
    parts = [arrays.get(f"{key}_{part}") for part in _PARTS]
    if all(part is None for part in parts):
        return arrays.get(key) if key == "scalar_mass" else _required_array(arrays, key, where)
    if any(part is None for part in parts):
        raise SceneError(
            f"{where}: a sparse {key} needs {', '.join(f'{key}_{p}' for p in _PARTS)}; add the "
            "missing array"
        )
    return _sparse_matrix(key, *(np.asarray(part) for part in parts), where=where)


def _sparse_matrix(key: str, data: Array, indices: Array, indptr: Array, *, where: str) -> Any:
    """Square sparse matrix in compressed row form.

    The parts are checked here, because SciPy's compiled loops access memory by them unchecked.
    """
    from scipy import sparse

    size = len(indptr) - 1 if indptr.ndim == 1 else -1
    problem = (
        "indptr: expected whole numbers, one more than rows" if size < 0 or not _is_integer(indptr)
        else "indices: expected whole numbers, one per entry of data"
        if not _is_integer(indices) or indices.ndim != 1 or indices.shape != data.shape
        else f"indptr: expected numbers that rise from 0 to {len(indices)}, the entries there are"
        if indptr[0] != 0 or indptr[-1] != len(indices) or (np.diff(indptr) < 0).any()
        else f"indices: expected columns from 0 to {size - 1}"
        if len(indices) and not 0 <= int(indices.min()) <= int(indices.max()) < size
        else ""
    )  # fmt: skip
    if problem:
        raise SceneError(f"{where}: {key} is not a sparse matrix in row form: {key}_{problem}")
    try:
        return sparse.csr_array((data, indices, indptr), shape=(size, size))
    except (ValueError, TypeError) as error:
        raise SceneError(f"{where}: {key} is not a sparse matrix in row form: {error}") from None


def _is_integer(numbers: Array) -> bool:
    return bool(np.issubdtype(numbers.dtype, np.integer))


def from_arrays(
    where: str, mass: Any, stiffness: Any, nodes: Any, scalar_mass: Any = None, order: str = "node"
) -> ElasticModel:
    """Finite-element model from arrays in memory, with checked sizes, sorted node by node."""
    from scipy import sparse

    points = _finite_numbers(nodes, "nodes", where)
    if points.ndim != 2 or points.shape[1] != 3 or not len(points):
        raise SceneError(
            f"{where}: nodes: expected N rows of x, y, z in m, found shape {points.shape}"
        )
    m, k = (_square_matrix(a, key, where) for a, key in ((mass, "mass"), (stiffness, "stiffness")))
    n, unknowns = len(points), m.shape[0] // len(points)
    if m.shape != k.shape:
        raise SceneError(
            f"{where}: mass and stiffness: expected the same size, found {m.shape[0]} and "
            f"{k.shape[0]} rows"
        )
    if unknowns not in (3, 6) or unknowns * n != m.shape[0]:
        raise SceneError(
            f"{where}: expected 3 or 6 unknowns for each of {n} nodes, {3 * n} or {6 * n} rows, "
            f"found {m.shape[0]}; give every node that has unknowns, and no other"
        )
    if order == "component":
        permutation = np.arange(m.shape[0]).reshape(unknowns, n).T.reshape(-1)
        m, k = m[permutation][:, permutation], k[permutation][:, permutation]
    scalar = None if scalar_mass is None else _square_matrix(scalar_mass, "scalar_mass", where)
    if scalar is not None and scalar.shape[0] != n:
        raise SceneError(
            f"{where}: scalar_mass: expected one row per node, {n}, found {scalar.shape[0]}"
        )
    return ElasticModel(where, sparse.csr_array(m), sparse.csr_array(k), points, scalar)


def _finite_numbers(value: Any, key: str, where: str) -> Array:
    try:
        numbers = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise SceneError(f"{where}: {key}: expected numbers, found something else") from None
    if not np.isfinite(numbers).all():
        raise SceneError(f"{where}: {key}: expected finite numbers, found nan or infinity")
    return numbers


def _square_matrix(value: Any, key: str, where: str) -> Any:
    from scipy import sparse

    matrix = (
        sparse.csr_array(value) if sparse.issparse(value) else _finite_numbers(value, key, where)
    )
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1]:
        raise SceneError(f"{where}: {key}: expected a square matrix, found shape {matrix.shape}")
    rows = sparse.csr_array(matrix)
    _finite_numbers(rows.data, key, where)
    return rows


# --- checks ---------------------------------------------------------------------------------------

#: Largest difference of mirrored entries, relative to the largest entry.
SYMMETRIC = 1e-9
#: Largest force in a rigid-body motion, relative to the sum of the magnitudes of its terms; files
#: with seven digits pass.
RIGID = 1e-6
#: Magnitude of negative eigenvalues, relative to the diagonal, that counts as rounding.
DEFINITE = 1e-9
#: Largest number of multiplications of a banded factorisation with reordered unknowns.  The actual
#: factorisation needs a tenth of them, about half a minute.
MAX_WORK = 5e11
#: Smallest matrix entry, squared frequency and length; the largest is its inverse.
_SMALLEST = 1e-60
_RIGID_MOTIONS = ("translation along x", "translation along y", "translation along z",
            "rotation about x", "rotation about y", "rotation about z")  # fmt: skip


def check_matrices(model: ElasticModel) -> ElasticModel:
    """Model with exactly symmetric matrices.

    Raises SceneError for matrices that are unsymmetric or indefinite, a stiffness that resists
    rigid-body motions (a model that is constrained somewhere), a mass that depends on the
    direction, and bodies in several pieces.
    """
    model = replace(
        model,
        mass=_symmetric_matrix(model, "mass", model.mass),
        stiffness=_symmetric_matrix(model, "stiffness", model.stiffness),
        scalar_mass=None
        if model.scalar_mass is None
        else _symmetric_matrix(model, "scalar_mass", model.scalar_mass),
    )
    _check_sizes(model)
    _check_connected(model)
    _check_work(model)
    _check_definite(model, "mass", model.mass, "kg")
    _check_equal_masses(model)
    _check_rigid_motions(model)
    _check_definite(model, "stiffness", model.stiffness, "N/m")
    _check_scalar_mass(model)
    return model


def _check_sizes(model: ElasticModel) -> None:
    """Raise SceneError for matrices whose products would overflow or underflow."""
    mass, stiffness = float(abs(model.mass).max()), float(abs(model.stiffness).max())
    sizes = (mass, stiffness, stiffness / mass, model.size)
    if not all(_SMALLEST < size < 1 / _SMALLEST for size in sizes):
        raise model.error(
            f"expected masses and stiffnesses of a real body, found up to {mass:.3g} kg and "
            f"{stiffness:.3g} N/m over {model.size:.3g} m, beyond the range of double precision; "
            "check the units (m, kg/m^3, N/m^2)"
        )


def _symmetric_matrix(model: ElasticModel, key: str, matrix: Any) -> Any:
    from scipy import sparse

    difference, largest = abs(matrix - matrix.T), float(abs(matrix).max())
    if largest == 0.0:
        raise model.error(f"{key}: expected a matrix of an elastic body, found only zeros")
    worst = float(difference.max())
    if worst > SYMMETRIC * largest:
        entries = difference.tocoo()
        entry = int(np.argmax(entries.data))
        i, j = int(entries.row[entry]), int(entries.col[entry])
        raise model.error(
            f"{key}: expected a symmetric matrix, found {matrix[i, j]:.6g} in row {i}, column {j} "
            f"and {matrix[j, i]:.6g} in row {j}, column {i} (counted from 0); if only one "
            "triangle is stored, add the other one"
        )
    return sparse.csr_array((matrix + matrix.T) / 2)


def _check_connected(model: ElasticModel) -> None:
    from scipy.sparse.csgraph import connected_components

    pieces, labels = connected_components(_connectivity(model), directed=False)
    if pieces > 1:
        first = int(np.flatnonzero(labels != labels[0])[0])
        raise model.error(
            f"stiffness: expected one connected body, found {pieces} pieces (node {first}, counted "
            f"from 0, is not connected to node 0); connect them, or remove nodes without elements"
        )


def _connectivity(model: ElasticModel) -> Any:
    """Sparse (N, N) matrix of the pairs of nodes that the stiffness connects."""
    from scipy.sparse import csr_array

    d, n = model.unknowns, len(model.nodes)
    entries = model.stiffness.tocoo()
    indices = (entries.row // d, entries.col // d)
    return csr_array((np.ones(entries.nnz, np.int8), indices), shape=(n, n))


def _check_work(model: ElasticModel) -> None:
    from scipy.sparse.csgraph import reverse_cuthill_mckee

    connectivity = _connectivity(model).tocoo()
    position = np.empty(len(model.nodes), np.int64)
    order = reverse_cuthill_mckee(connectivity.tocsr(), symmetric_mode=True)
    position[order] = np.arange(len(position))
    rows, columns = position[connectivity.row], position[connectivity.col]
    bandwidth = np.zeros(len(position))
    np.maximum.at(bandwidth, rows, np.maximum(rows - columns, 0).astype(float))
    work = model.unknowns**3 * float(np.sum(bandwidth**2))
    if work > MAX_WORK:
        raise model.error(
            f"stiffness: expected a body whose {model.stiffness.shape[0]} unknowns can be solved "
            f"for with {MAX_WORK:.0e} multiplications (half a minute), found {work:.1e}; use "
            "fewer divisions or a coarser mesh (a slender or thin body may have many more unknowns "
            "than a compact one), or give the matrices of a reduced model in `matrices`"
        )


def _check_definite(model: ElasticModel, key: str, matrix: Any, unit: str) -> None:
    """Raise SceneError for negative eigenvalues beyond rounding, by the pivots of `matrix`."""
    if model.definite:
        return
    diagonal = matrix.diagonal()
    row = int(np.argmin(diagonal))
    if diagonal[row] < 0:
        raise model.error(
            f"{key}: expected a positive semidefinite matrix, found {diagonal[row]:.6g} on the "
            f"diagonal in row {row} (counted from 0); check signs and the order of the unknowns"
        )
    negative = negative_pivots(matrix, DEFINITE)
    if negative:
        raise model.error(
            f"{key}: expected a positive semidefinite matrix ({unit}), found {negative} negative "
            f"eigenvalue{'s' if negative > 1 else ''}; check how it was assembled"
        )


def negative_pivots(matrix: Any, shift: float) -> int:
    """Number of eigenvalues below -shift of a symmetric matrix scaled to a unit diagonal."""
    from scipy import sparse
    from scipy.sparse.linalg import splu

    diagonal = matrix.diagonal()
    scale = 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    scaled = sparse.diags_array(scale) @ matrix @ sparse.diags_array(scale)
    shifted = sparse.csc_array(scaled + shift * sparse.eye_array(matrix.shape[0]))
    options = {"SymmetricMode": True}
    lu = splu(shifted, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    return int(np.count_nonzero(lu.U.diagonal() < 0))


def _check_equal_masses(model: ElasticModel) -> None:
    block, mass = model.inertia[:3, :3], float(np.trace(model.inertia[:3, :3]) / 3)
    worst = float(np.max(np.abs(block - mass * np.eye(3))))
    if not mass > 0 or worst > RIGID * mass:
        values = ", ".join(f"{value:.6g}" for value in np.diag(block))
        raise model.error(
            f"mass: expected the same mass in kg along x, y and z, found {values}; check the order "
            'of the unknowns ("node" or "component") and that no unknown is missing'
        )


def _check_rigid_motions(model: ElasticModel) -> None:
    stiffness, motions = model.stiffness, model.rigid_displacements
    force = np.max(np.abs(stiffness @ motions), axis=0)
    terms = np.max(abs(stiffness) @ np.abs(motions), axis=0)
    share = force / np.where(terms > 0, terms, 1.0)
    worst = int(np.argmax(share))
    if share[worst] > RIGID:
        raise model.error(
            f"stiffness: expected no force in rigid-body motions, found {share[worst]:.2g} of the "
            f"size of its terms in a {_RIGID_MOTIONS[worst]}: the model is constrained somewhere, "
            "or nodes and unknowns are in different orders; give the matrices of the free body"
        )


def _check_scalar_mass(model: ElasticModel) -> None:
    if model.scalar_mass is None:
        return
    if model.unknowns == 6:
        raise model.error(
            "scalar_mass: expected 3 unknowns per node, found 6, with rotations that have other "
            "masses; leave it out"
        )
    largest = float(abs(model.scalar_mass).max())
    along_x = model.mass[0::3][:, 0::3]
    worst = float(abs(along_x - model.scalar_mass).max())
    if worst > RIGID * largest:
        raise model.error(
            f"scalar_mass: expected the mass matrix of the unknowns along x, found entries that "
            f"differ by {worst:.3g} of {largest:.3g} kg; leave it out, or check the order of the "
            "nodes"
        )
