"""Mass and stiffness matrices of an elastic body, from and to a file of arrays (.npz)."""

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
    """Write the file that `matrices = "link.npz"` of an [[elastic]] table names.

    Args:
        mass, stiffness: (u, u) arrays or scipy.sparse matrices, kg and N/m.
        nodes: (N, 3) m; u = 3 N, or 6 N where nodes have rotations.
        scalar_mass: (N, N) kg, if mass = scalar_mass (x) 1: then every moment is exact.
        order: "node" for x1 y1 z1 x2 ..., "component" for x1 x2 ... y1 y2 ...
    """
    arrays: dict[str, Any] = {"nodes": np.asarray(nodes, dtype=float), "order": np.array(order)}
    for key, matrix in zip(_MATRICES, (mass, stiffness, scalar_mass), strict=True):
        if matrix is not None:
            arrays |= _written(key, matrix)
    with replace_atomically(Path(path)) as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, **arrays)
    return Path(path)


def _written(key: str, matrix: Any) -> dict[str, Any]:
    from scipy import sparse

    if not sparse.issparse(matrix):
        return {key: np.asarray(matrix, dtype=float)}
    rows = sparse.csr_array(matrix)
    return {f"{key}_{part}": getattr(rows, part) for part in _PARTS}


def load_matrices(path: Path, where: str) -> ElasticModel:
    """The model in a file written by `save_matrices` or with the same keys.

    Raises SceneError for a file that cannot be read, for keys that are missing or unknown, and for
    arrays whose sizes do not belong together.
    """
    arrays = _arrays(path, where)
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
        _needed(arrays, "nodes", where), _matrix(arrays, "scalar_mass", where), order,
    )  # fmt: skip


def _arrays(path: Path, where: str) -> dict[str, Any]:
    way_out = "write it with mstmm.runtime.flexible.elastic.save_matrices"
    require_regular_file(path, where)
    try:
        return read_arrays(path)
    except FileNotFoundError:
        raise SceneError(f"{where}: there is no file {path}; {way_out}") from None
    except ValueError as error:
        raise SceneError(
            f"{where}: {path} is no file of arrays (.npz): {error}; {way_out}"
        ) from None


def _needed(arrays: dict[str, Any], key: str, where: str) -> Any:
    if key not in arrays:
        raise SceneError(f"{where}: the array {key!r} is missing; the file needs mass, stiffness "
                         "and nodes")  # fmt: skip
    return arrays[key]


def _matrix(arrays: dict[str, Any], key: str, where: str) -> Any:
    """A dense array, a sparse one of its three parts, or None for a scalar mass left out."""
    parts = [arrays.get(f"{key}_{part}") for part in _PARTS]
    if all(part is None for part in parts):
        return arrays.get(key) if key == "scalar_mass" else _needed(arrays, key, where)
    if any(part is None for part in parts):
        raise SceneError(
            f"{where}: a sparse {key} needs {', '.join(f'{key}_{p}' for p in _PARTS)}, found one "
            "missing"
        )
    return _sparse(key, *(np.asarray(part) for part in parts), where=where)


def _sparse(key: str, data: Array, indices: Array, indptr: Array, *, where: str) -> Any:
    """A square matrix in row form; its parts are checked here, because SciPy's compiled loops
    read and write wherever they point."""
    from scipy import sparse

    size = len(indptr) - 1 if indptr.ndim == 1 else -1
    wrong = (
        "indptr: expected whole numbers, one more than rows" if size < 0 or not _whole(indptr)
        else "indices: expected whole numbers, one per entry of data"
        if not _whole(indices) or indices.ndim != 1 or indices.shape != data.shape
        else f"indptr: expected numbers that rise from 0 to {len(indices)}, the entries there are"
        if indptr[0] != 0 or indptr[-1] != len(indices) or (np.diff(indptr) < 0).any()
        else f"indices: expected columns from 0 to {size - 1}"
        if len(indices) and not 0 <= int(indices.min()) <= int(indices.max()) < size
        else ""
    )  # fmt: skip
    if wrong:
        raise SceneError(f"{where}: {key} is no sparse matrix in row form: {key}_{wrong}")
    try:
        return sparse.csr_array((data, indices, indptr), shape=(size, size))
    except (ValueError, TypeError) as error:
        raise SceneError(f"{where}: {key} is no sparse matrix in row form: {error}") from None


def _whole(numbers: Array) -> bool:
    return bool(np.issubdtype(numbers.dtype, np.integer))


def from_arrays(
    where: str, mass: Any, stiffness: Any, nodes: Any, scalar_mass: Any = None, order: str = "node"
) -> ElasticModel:
    """The model of arrays in memory, sizes checked, sorted node by node."""
    from scipy import sparse

    points = _numbers(nodes, "nodes", where)
    if points.ndim != 2 or points.shape[1] != 3 or not len(points):
        raise SceneError(
            f"{where}: nodes: expected N rows of x, y, z in m, found shape {points.shape}"
        )
    m, k = (_square(a, key, where) for a, key in ((mass, "mass"), (stiffness, "stiffness")))
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
        place = np.arange(m.shape[0]).reshape(unknowns, n).T.reshape(-1)
        m, k = m[place][:, place], k[place][:, place]
    scalar = None if scalar_mass is None else _square(scalar_mass, "scalar_mass", where)
    if scalar is not None and scalar.shape[0] != n:
        raise SceneError(
            f"{where}: scalar_mass: expected one row per node, {n}, found {scalar.shape[0]}"
        )
    return ElasticModel(where, sparse.csr_array(m), sparse.csr_array(k), points, scalar)


def _numbers(value: Any, key: str, where: str) -> Array:
    try:
        found = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise SceneError(f"{where}: {key}: expected numbers, found something else") from None
    if not np.isfinite(found).all():
        raise SceneError(f"{where}: {key}: expected finite numbers, found nan or infinity")
    return found


def _square(value: Any, key: str, where: str) -> Any:
    from scipy import sparse

    matrix = sparse.csr_array(value) if sparse.issparse(value) else _numbers(value, key, where)
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1]:
        raise SceneError(f"{where}: {key}: expected a square matrix, found shape {matrix.shape}")
    rows = sparse.csr_array(matrix)
    _numbers(rows.data, key, where)
    return rows
