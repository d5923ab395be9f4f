"""The state matrix of exponential methods, from what `mstmm_implicit` offers them.

It is the exact Jacobian of the equations of motion, in the raw components of quaternions.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.random import Generator

import mstmm
from mstmm.runtime.engine.jacobian import OdeJacobian
from mstmm.runtime.run.scene_system import SceneSystem
from tests.reference.jets import Array
from tests.runtime.engine.test_tangent_matrix import (
    random_flexible_scene,
    random_rigid_scene,
    worst,
)
from tests.support.implicit_methods import motions

Scene = dict[str, Any]
TIME = 0.3


class Offer:
    """What a scene offers at one state, called as C calls it."""

    def __init__(self, model: mstmm.Model, q: Array, u: Array) -> None:
        self.system = SceneSystem(model.looped, None, with_power=False)
        self.system.offer_tangent()
        self.nq, self.nu = model.nq, model.nu
        self.y = self.system.start(TIME, q, u)
        slope = np.zeros(self.nq + self.nu)
        self._check_code(
            self.system.system.rhs(self._context, TIME, *self._pointers(self.y, slope))
        )
        self.a = slope[self.nq :]

    @property
    def _context(self) -> Any:
        return self.system.system.context

    def _pointers(self, *arrays: Array) -> list[Any]:
        return [self.system.engine.pointer(array) for array in arrays]

    def _check_code(self, code: int) -> None:
        assert code == 0

    def inverse_mass(self) -> Array:
        """(nu, nu), by a tangent that is nothing but mass."""
        implicit, state = self.system.system.implicit, self._pointers(self.y, self.a)
        null = self.system.engine.ffi.NULL
        self._check_code(implicit.tangent(self._context, TIME, *state, 2.0**200, 1.0, 0))
        columns, dq, du = np.zeros((self.nu, self.nu)), np.zeros(self.nq), np.zeros(self.nu)
        for unit, column in zip(np.eye(self.nu), columns, strict=True):
            right, *found = self._pointers(unit, dq, du, column)
            self._check_code(implicit.solve(self._context, right, null, null, *found))
        return columns.T

    def state_matrix(self) -> Array:
        """(nq + nu, nq + nu)"""
        n, inverse = self.nq + self.nu, self.inverse_mass()
        slope, state = self.system.system.implicit.slope, self._pointers(self.y, self.a)
        columns = np.zeros((n, n))
        rates, r = np.zeros(self.nq), np.zeros(self.nu)
        for unit, column in zip(np.eye(n), columns, strict=True):
            along = self._pointers(unit[: self.nq].copy(), unit[self.nq :].copy(), rates, r)
            self._check_code(slope(self._context, TIME, *state, *along))
            column[:] = np.concatenate([rates, -inverse @ r])
        return columns.T


def check(scene: Scene, q: Array, u: Array) -> None:
    model = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    offer = Offer(model, q, u)
    expected = OdeJacobian(model, False, offer.system.memory, lambda t, y: np.full_like(y, np.nan))
    assert expected.exact
    assert worst(offer.state_matrix(), expected(TIME, offer.y)) < 1e-10


@pytest.mark.parametrize("draw", range(6))
def test_rigid_trees(draw: int, rng: Generator) -> None:
    check(*random_rigid_scene(rng))


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("draw", range(3))
def test_flexible_trees(draw: int, rng: Generator) -> None:
    check(*random_flexible_scene(rng, draw % 2 == 0))


def test_a_beam_has_the_derivatives_that_users_are_told() -> None:
    """Entry by entry: accelerations of high shapes and what is slow beside them."""
    model = mstmm.compile(mstmm.Scene(**motions.beam_pendulum(5e4)), engine="looped")
    q, u = np.array([-0.4, 1e-3, 2e-4, 1e-4]), np.array([3.0, 0.2, -0.1, 0.05])
    found, known = Offer(model, q, u).state_matrix(), model.derivatives(q, u)
    expected = np.asarray(known.state_matrix)
    size = np.abs(expected).max(axis=1, keepdims=True) * np.ones_like(expected)
    assert np.all(np.abs(found - expected) < 1e-12 * size)
    assert Offer(model, q, u).inverse_mass() == pytest.approx(np.asarray(known.efforts), rel=1e-11)
