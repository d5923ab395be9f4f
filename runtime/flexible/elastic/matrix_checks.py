"""Checks that matrices describe one free elastic body."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from .finite_element_model import ElasticModel

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
