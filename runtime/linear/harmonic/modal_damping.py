"""Modal damping: prescribed damping ratios of the normal modes of a scene.

For modes of unit modal mass, with shapes Phi and U = M Phi, the damping matrix

    C = U diag(2 zeta omega) U^T

damps each mode by its zeta and no other mode.  The Woodbury identity adds it to the damping of the
scene through one small equation for each s, so that the sweep needs no dense matrix:

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

#: Damping ratios: one for all normal modes, or one for each of the slowest.
Ratios = float | Sequence[float]


@dataclass(frozen=True)
class ModalDamping:
    """Damping of k modes: `columns` U (n, k) and `rates` 2 zeta omega (k,), 1/s."""

    columns: Array
    rates: Array

    def damp(self, s: Complex, x: Complex, answers: Complex) -> Complex:
        """Amplitudes (m, r, n) at s (m,) with modal damping.

        They follow from the responses without it: x (m, r, n) to the right-hand sides, `answers`
        (m, k, n) to the columns U.
        """
        factor = s[:, None, None] * self.rates[:, None]
        matrix = np.eye(len(self.rates)) + factor * (answers @ self.columns).swapaxes(1, 2)
        with np.errstate(all="ignore"):
            amounts = np.linalg.solve(matrix, factor * (x @ self.columns).swapaxes(1, 2))
        return np.asarray(x - amounts.swapaxes(1, 2) @ answers)


def modal_damping(linear: LinearEquations, ratios: Ratios) -> ModalDamping:
    """Modal damping of a model at rest.

    Raises SceneError for invalid ratios, and where the undamped modes are no vibrations: a mode is
    unstable, or K does not derive from a potential.
    """
    alone = np.ndim(ratios) == 0
    zeta = one_row("modal", [ratios] if alone else ratios)
    if (zeta < 0).any():
        raise SceneError(
            f"modal = {zeta.min():g}: expected damping ratios of 0 or more, such as 0.02"
        )
    if len(zeta) > len(linear):
        raise SceneError(
            f"modal: {len(zeta)} ratios, but the scene has {len(linear)} modes; give one "
            "number for all, or fewer"
        )
    if alone:
        check_dense_size(len(linear), "the matrix of all modes")
    undamped_modes = modes(linear, None if alone else len(zeta), False)
    if not undamped_modes.is_undamped or undamped_modes.unstable.any():
        raise SceneError(
            "modal: damping ratios require undamped vibration modes, but this state is unstable or "
            "has follower loads; define damping in laws, or give structural"
        )
    rates = 2 * zeta * undamped_modes.omega
    damped = np.flatnonzero(rates)
    if (
        linear.constrained_motion is not None
    ):  # the mass matrix of the sweep is that of the spanning tree
        return ModalDamping(linear.M @ undamped_modes.shapes[:, damped], rates[damped])
    mass = [linear.operators.mass(undamped_modes.shapes[:, k]) for k in damped]
    return ModalDamping(np.array(mass).reshape(len(damped), len(linear)).T, rates[damped])
