"""The engine's equations of an elastic body against those of its nodes, without any reduction of
the inertia: every moment of the fields enters."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import mstmm
from mstmm.runtime.flexible.elastic.craig_bampton import Release, reduce
from mstmm.runtime.flexible.elastic.interface_nodes import select_port
from mstmm.runtime.flexible.elastic.modal_elastic import elastic_model
from tests.support.scenes import elastic_bar as bar

Array = NDArray[np.float64]

ENDS = {"root": {"plane": [1, 0, 0, 0.0], "position": [0, 0, 0]}, "tip": {"plane": [1, 0, 0, 0.8]}}
GRAVITY = np.array([1.0, -2.0, 3.0])


def turning(places: Array) -> Array:
    """(N, 3, 3): omega -> omega x r at each place."""
    return np.stack([np.cross(axis, places) for axis in np.eye(3)], axis=2)


class Nodes:
    """A body as its nodes move: body axes, velocities v + omega x r + Phi etad."""

    def __init__(self, elastic: dict[str, Any]) -> None:
        table = bar.scene(elastic).elastic[0]
        self.model = elastic_model(table)
        ports = [select_port(self.model, name, end, True) for name, end in table.ends.items()]
        free = Release(np.eye(6), np.zeros((6, 0)))
        reduction = reduce(self.model, ports, ports[0], table.modes or 0, "tangent", release=free)
        self.shapes = reduction.shapes
        self.K = np.diag(self.model.inertia[0, 0] * reduction.frequencies**2)

    def places(self, eta: Array) -> Array:
        return np.asarray(self.model.nodes + (self.shapes @ eta).reshape(-1, 3))

    def jacobian(self, eta: Array) -> Array:
        """(3 N, 6 + n) of the velocities by v, omega, etad."""
        n = len(self.model.nodes)
        linear = np.broadcast_to(np.eye(3), (n, 3, 3))
        frame = np.concatenate([linear, turning(self.places(eta))], axis=2).reshape(3 * n, 6)
        return np.hstack([frame, self.shapes])

    def mass_matrix(self, eta: Array) -> Array:
        j = self.jacobian(eta)
        return np.asarray(j.T @ (self.model.mass @ j))

    def accelerations(self, eta: Array, u: Array, gravity: Array) -> Array:
        v, w, rates = u[:3], u[3:6], (self.shapes @ u[6:]).reshape(-1, 3)
        bias = np.cross(w, v) + np.cross(w, np.cross(w, self.places(eta))) + 2 * np.cross(w, rates)
        load = -(self.model.mass @ (bias - gravity).reshape(-1))
        force = self.jacobian(eta).T @ load
        force[6:] -= self.K @ eta
        return np.asarray(np.linalg.solve(self.mass_matrix(eta), force))


@pytest.fixture(scope="module")
def pair() -> tuple[Nodes, mstmm.Model]:
    """A lopsided block, free in space, held (as a tree counts) at one face."""
    box = {"size": [0.8, 0.5, 0.3], "divisions": [2, 1, 1], "corner": [0, -0.1, -0.2]}
    elastic = bar.table(box=box, ends=ENDS, young=1e5, stiffening=False, frame="tangent", modes=2)
    scene = bar.scene(elastic, "free", load=[{"on": "bar.tip", "force": [0, 0, 0]}])
    scene = scene.model_copy(update={"gravity": tuple(GRAVITY)})
    return Nodes(elastic), mstmm.compile(scene, "looped")


def state(pair: tuple[Nodes, mstmm.Model]) -> tuple[Array, Array]:
    draw = np.random.default_rng(11)
    q, u = pair[1].initial_state()
    turned = draw.normal(size=4)
    q[:7] = [0.1, 0.2, -0.3, *(turned / np.linalg.norm(turned))]
    q[7:], u[:] = 0.02 * draw.normal(size=len(q) - 7), draw.normal(size=len(u))
    return q, u


def test_mass_matrix(pair: tuple[Nodes, mstmm.Model]) -> None:
    nodes, model = pair
    q, _ = state(pair)
    found, expected = model.mass_matrix(q), nodes.mass_matrix(q[7:])
    assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()


def test_accelerations(pair: tuple[Nodes, mstmm.Model]) -> None:
    nodes, model = pair
    q, u = state(pair)
    w, x, y, z = q[3:7]
    turn = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip
    expected = nodes.accelerations(q[7:], u, turn.T @ GRAVITY)
    found = model.accelerations(q, u)
    assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()
