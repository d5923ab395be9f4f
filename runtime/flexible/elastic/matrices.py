"""Mass and stiffness matrices of an elastic body: arrays in memory or in a file (.npz)."""

from __future__ import annotations

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
