"""Elastic bodies from matrices: files, orders of unknowns, and masses of every kind."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import sparse

from mstmm.runtime.flexible.elastic.finite_element_model import ElasticModel
from mstmm.runtime.flexible.elastic.matrices import from_arrays
from mstmm.runtime.flexible.elastic.modal_elastic import elastic_bodies, save_matrices
from mstmm.runtime.flexible.elastic.shape_moments import field_moments
from mstmm.runtime.flexible.modal_body import ModalBody
from tests.support.scenes import elastic_bar as bar

Array = NDArray[np.float64]

MOMENTS = ("first", "second", "C", "E", "F", "K")


def assert_same_body(one: ModalBody, other: ModalBody, tolerance: float) -> None:
    for key in MOMENTS:
        a, b = getattr(one, key), getattr(other, key)
        assert np.abs(a - b).max() <= tolerance * np.abs(a).max(), key
    assert np.allclose(one.ports["tip"].phi, other.ports["tip"].phi, atol=1e-9)


@pytest.mark.parametrize("scalar", [True, False])
@pytest.mark.parametrize("order", ["node", "component"])
@pytest.mark.parametrize("dense", [True, False])
def test_file(tmp_path: Path, scalar: bool, order: str, dense: bool) -> None:
    """Every kind of file gives the body that the mesh gives, and M alone what M_s gives."""
    model = bar.model(elements=5)
    mass, stiffness = model.mass, model.stiffness
    if order == "component":
        place = np.arange(mass.shape[0]).reshape(-1, 3).T.reshape(-1)
        mass, stiffness = (matrix[place][:, place] for matrix in (mass, stiffness))
    if dense:
        mass, stiffness = mass.toarray(), stiffness.toarray()
    ms = model.scalar_mass if scalar else None
    path = save_matrices(tmp_path / "bar.npz", mass, stiffness, model.nodes, ms, order)
    found = bar.body(bar.from_arrays(matrices=str(path)))
    assert_same_body(bar.body(bar.table(box=bar.short(), stiffening=False)), found, 1e-12)
    assert "all moments exact" in found.notes[-1]
    assert any("no geometric stiffening" in note for note in found.notes)


# --- masses that are not scalar -------------------------------------------------------------------


def tetrahedron() -> tuple[Array, Array]:
    """Four nodes, and a stiffness of springs between each pair: the smallest elastic body."""
    nodes = np.array([[0.0, 0, 0], [1, 0.1, 0], [0.2, 0.9, 0.1], [0.1, 0.3, 0.8]])
    stiffness = np.zeros((12, 12))
    for i in range(4):
        for j in range(i):
            along = (nodes[i] - nodes[j]) / np.linalg.norm(nodes[i] - nodes[j])
            row = np.zeros((4, 3))
            row[i], row[j] = along, -along
            stiffness += 100.0 * (1 + i + 2 * j) * np.outer(row.ravel(), row.ravel())
    return nodes, stiffness


def uneven_mass(nodes: Array) -> Array:
    """A mass matrix whose directions differ, though the body's mass does not."""
    draw = np.random.default_rng(4)
    lumps = np.kron(np.diag([1.0, 2.0, 1.5, 0.5]), np.eye(3))
    strain = draw.normal(size=(12, 12))
    strain -= strain @ np.linalg.pinv(_rigid_displacements(nodes)).T @ _rigid_displacements(nodes).T
    return np.asarray(lumps + 0.05 * strain.T @ strain)


def _rigid_displacements(nodes: Array) -> Array:
    unit = np.eye(3)
    turned = [np.cross(axis, nodes).ravel() for axis in unit]
    return np.stack([*(np.tile(axis, len(nodes)) for axis in unit), *turned], axis=1)


def test_moments_of_a_mass_that_is_not_scalar() -> None:
    """What the rigid-body columns and the modal mass say is exact, whatever the rest is."""
    nodes, stiffness = tetrahedron()
    mass = uneven_mass(nodes)
    model = from_arrays("here", mass, stiffness, nodes)
    shapes = np.random.default_rng(5).normal(size=(12, 3))
    found = field_moments(model, shapes)
    assert "not scalar" in found.how
    rigid = _rigid_displacements(nodes)
    inertia, carried = rigid.T @ mass @ rigid, rigid.T @ mass @ shapes
    c = found.first
    cross = np.array([[0, -c[2], c[1]], [c[2], 0, -c[0]], [-c[1], c[0], 0]])
    assert np.allclose(inertia[3:, :3], cross, atol=1e-12)
    assert np.allclose(inertia[3:, 3:], np.trace(found.second) * np.eye(3) - found.second)
    assert np.allclose(found.C, carried[:3])
    turning = [found.E[a, b] - found.E[b, a] for a, b in ((1, 2), (2, 0), (0, 1))]
    assert np.allclose(turning, carried[3:])
    assert np.allclose(np.einsum("aakl->kl", found.F), shapes.T @ mass @ shapes)


def test_nodes_with_rotations() -> None:
    """A frame of beam elements (6 unknowns per node): a single node is an end."""
    model = beam_model(elements=8)
    ends = {"root": {"nodes": [0]}, "tip": {"nodes": [8]}}
    arrays = {
        "mass": model.mass.toarray(), "stiffness": model.stiffness.toarray(),
        "nodes": model.nodes,
    }  # fmt: skip
    found = elastic_bodies(bar.scene(bar.from_arrays(arrays=arrays, ends=ends, modes=4)))["bar"]
    assert np.allclose(bar.frequencies(found)[:4], [103.36, 258.40, 647.75, 1619.4], rtol=5e-3)
    tip = found.ports["tip"]
    assert abs(tip.theta[1, 0] / tip.phi[2, 0]) == pytest.approx(1.3765, rel=1e-3)
    assert found.mass == pytest.approx(bar.MASS)


def test_masses_in_nodes_with_rotations() -> None:
    """Where rotations of nodes carry no mass, sums over the nodes are all moments."""
    free = beam_model(elements=4)
    lumps = np.array([0.5, 1, 2, 1, 0.5])
    mass = sparse.csr_array(np.kron(np.diag(lumps), np.diag([1.0, 1, 1, 0, 0, 0])))
    shapes = np.random.default_rng(6).normal(size=(30, 2))
    found = field_moments(replace(free, mass=mass), shapes)
    assert "all moments exact" in found.how and "not scalar" in field_moments(free, shapes).how
    moved = shapes.reshape(5, 6, 2)[:, :3]
    assert np.allclose(found.E, np.einsum("i,ia,ibk->abk", lumps, free.nodes, moved))
    assert np.allclose(found.F, np.einsum("i,iak,ibl->abkl", lumps, moved, moved))


def beam_model(elements: int) -> ElasticModel:
    """Hermite beam elements along x, with axial and twist unknowns, by their textbook matrices."""
    h = bar.LENGTH / elements
    size = 6 * (elements + 1)
    mass, stiffness = np.zeros((size, size)), np.zeros((size, size))
    m = np.array([[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h],
                  [54, 13 * h, 156, -22 * h],
                  [-13 * h, -3 * h * h, -22 * h, 4 * h * h]])  # fmt: skip
    k = np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h],
                  [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]])  # fmt: skip
    rod, bond = np.array([[2.0, 1], [1, 2]]) * h / 6, np.array([[1.0, -1], [-1, 1]]) / h
    line = bar.MASS / bar.LENGTH
    polar = line * (bar.WIDTH**2 + bar.HEIGHT**2) / 12
    flip = np.diag([1.0, -1, 1, -1])  # w' = -theta_y
    for e in range(elements):
        at = 6 * e
        parts: list[tuple[list[int], Any, Any]] = [
            ([0, 6], line * rod, bar.YOUNG * bar.WIDTH * bar.HEIGHT * bond),
            ([3, 9], polar * rod, 2e4 * bond),
            ([1, 5, 7, 11], line * h / 420 * m, bar.EI_Y / h**3 * k),
            ([2, 4, 8, 10], line * h / 420 * flip @ m @ flip, bar.EI_Z / h**3 * flip @ k @ flip),
        ]
        for places, inertia, spring in parts:
            where = np.ix_([at + p for p in places], [at + p for p in places])
            mass[where] += inertia
            stiffness[where] += spring
    nodes = np.column_stack(
        [np.linspace(0, bar.LENGTH, elements + 1), *np.zeros((2, elements + 1))]
    )
    return ElasticModel("beam", sparse.csr_array(mass), sparse.csr_array(stiffness), nodes)
