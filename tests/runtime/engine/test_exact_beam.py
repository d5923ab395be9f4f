"""Sweeps over the stations of an exact beam against Lagrange's equations and dense tangents."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.random import Generator

import mstmm
from mstmm.array_validation import Array
from mstmm.runtime.engine.tangent_matrix import TangentMatrix
from mstmm.runtime.flexible import flexible_bodies
from mstmm.runtime.flexible.modal_body import ModalBody
from tests.runtime.engine.test_tangent_matrix import check_tangent_direction, check_tangent_solution
from tests.support.flexible import exact_beam


@pytest.fixture(name="body")
def _body(rng: Generator, monkeypatch: pytest.MonkeyPatch) -> ModalBody:
    body = exact_beam.random_body(rng)
    monkeypatch.setattr(flexible_bodies, "modal_bodies", lambda _: {"rod": body})
    return body


def _compile(engine: str) -> mstmm.Model:
    return mstmm.compile(mstmm.Scene(**exact_beam.SCENE), engine=engine)


def _state(model: mstmm.Model, rng: Generator) -> tuple[Array, Array, list[int]]:
    """Coordinates, speeds, and the places of pin, joint and strain coordinates among them."""
    names = model.coordinate_layout.q_names
    order = [names.index("pin.angle"), names.index("joint.angle")]
    order += [k for k in range(model.nq) if k not in order]
    return 0.4 * rng.normal(size=model.nq), 0.6 * rng.normal(size=model.nu), order


@pytest.mark.parametrize("engine", ["looped", "fused"])
def test_accelerations(body: ModalBody, engine: str, rng: Generator) -> None:
    model = _compile(engine)
    q, u, order = _state(model, rng)
    expected = exact_beam.accelerations(body, q[order], u[order])
    found = model.accelerations(q, u)[order]
    assert np.abs(found - expected).max() < 1e-8 * np.abs(expected).max()


def test_mass_matrix(body: ModalBody, rng: Generator) -> None:
    model = _compile("looped")
    q, _, order = _state(model, rng)
    expected = exact_beam.mass_matrix(body, q[order])
    found = model.mass_matrix(q)[np.ix_(order, order)]
    assert np.abs(found - expected).max() < 1e-12 * np.abs(expected).max()


@pytest.mark.parametrize("loaded", [False, True])
def test_tangent(body: ModalBody, loaded: bool, rng: Generator) -> None:
    """The tangent along a direction, factored, and with known increments."""
    load = {"on": "plate", "force": [3.0, "2 * t", 1.0], "moment": [0.1, 0.2, 0.3]}
    model = mstmm.compile(
        mstmm.Scene(**exact_beam.SCENE, load=[load] if loaded else []), engine="looped"
    )
    tangent = TangentMatrix(model.looped)
    q, u, _ = _state(model, rng)
    check_tangent_direction(tangent, q, u, rng)
    check_tangent_solution(tangent, q, u, rng)
