"""Modal damping: ratios that are prescribed for the natural motions of a whole scene.

Of motions with unit modal mass, their shapes the columns of Phi, U = M Phi, a damping matrix

    C = U diag(2 zeta omega) U^T

damps each by its zeta and leaves all others alone.  It is added to what the scene has by one small
equation for each s (Woodbury), so that the sweep stays a sweep and no matrix of the scene is made:

    (Z + s U R U^T)^-1 r = x - Y c,    x = Z^-1 r,  Y = Z^-1 U,  (1 + s R U^T Y) c = s R U^T x
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array, one_row
from mstmm.errors import SceneError

from ...packing.coordinate_layout import check_dense_size
from ..mode_solvers import modes
from ..modes import Complex

if TYPE_CHECKING:
    from ..linear_equations import LinearEquations

#: Ratios of the critical damping: one for all natural motions, or those of the slowest ones.
Ratios = float | Sequence[float]


@dataclass(frozen=True)
class ModalDamping:
    """What k motions are damped by: `columns` U (n, k) and `rates` 2 zeta omega (k,) in 1/s."""

    columns: Array
    rates: Array

    def damp(self, s: Complex, x: Complex, answers: Complex) -> Complex:
        """Amplitudes (m, r, n) at s (m,) with the damping, from those without it: x (m, r, n) of
        the right-hand sides and `answers` (m, k, n) of the columns."""
        factor = s[:, None, None] * self.rates[:, None]
        matrix = np.eye(len(self.rates)) + factor * (answers @ self.columns).swapaxes(1, 2)
        with np.errstate(all="ignore"):
            amounts = np.linalg.solve(matrix, factor * (x @ self.columns).swapaxes(1, 2))
        return np.asarray(x - amounts.swapaxes(1, 2) @ answers)


def modal_damping(linear: LinearEquations, ratios: Ratios) -> ModalDamping:
    """The damping of a model at rest.

    Raises SceneError for ratios that make no sense, and for a model whose motions without damping
    are no vibrations: one grows, or K has no potential.
    """
    alone = np.ndim(ratios) == 0
    zeta = one_row("modal", [ratios] if alone else ratios)
    if (zeta < 0).any():
        raise SceneError(
            f"modal = {zeta.min():g}: expected parts of the critical damping, 0 or more, such as "
            "0.02"
        )
    if len(zeta) > len(linear):
        raise SceneError(
            f"modal: {len(zeta)} ratios, but the scene has {len(linear)} natural motions; give one "
            "number for all, or fewer"
        )
    if alone:
        check_dense_size(len(linear), "the matrix of all motions")
    found = modes(linear, None if alone else len(zeta), False)
    if not found.undamped or found.growing.any():
        raise SceneError(
            "modal: near this state a motion grows, or loads follow the scene, so that its motions "
            "are no vibrations to damp; damp laws, or give structural"
        )
    rates = 2 * zeta * found.omega
    damped = np.flatnonzero(rates)
    if linear.mechanism is not None:  # the sweep's own mass is that of the tree, torn open
        return ModalDamping(linear.M @ found.shapes[:, damped], rates[damped])
    mass = [linear.pencil.mass(found.shapes[:, k]) for k in damped]
    return ModalDamping(np.array(mass).reshape(len(damped), len(linear)).T, rates[damped])
