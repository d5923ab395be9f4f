"""Flexible bodies that start in the static shape under the loads at t = 0."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from mstmm.errors import NumericalFailure

from ..layout import HingeSlots

Array = NDArray[np.float64]

#: (q, u, udot) -> efforts (nu,) that these accelerations need.
InverseDynamics = Callable[[Array, Array, Array], Array]

_ITERATIONS, _STEP, _ACCURACY = 50, 1e-6, 1e-12


def settle(needed: InverseDynamics, q: Array, u: Array, bodies: Iterable[HingeSlots]) -> Array:
    """q with the modal coordinates of `bodies` at rest: no modal speed, no modal acceleration.

    Hinges stay at their places and keep their speeds without acceleration (a spinning blade starts
    stretched out); so the shape is that of bodies whose hinges are held.  Newton on the modal
    efforts with a differenced tangent.  Raises NumericalFailure if there is no such shape nearby.
    """
    slots = list(bodies)
    at_q = np.concatenate([np.arange(s.q, s.q + s.nq) for s in slots])
    at_u = np.concatenate([np.arange(s.u, s.u + s.nu) for s in slots])
    q, u, rest = q.copy(), u.copy(), np.zeros(len(u))
    u[at_u] = 0.0

    def residual(eta: Array) -> Array:
        q[at_q] = eta
        return needed(q, u, rest)[at_u]

    eta = q[at_q].copy()
    for _ in range(_ITERATIONS):
        here = residual(eta)
        scale = _STEP * max(1e-3, float(np.abs(eta).max()))
        columns = [
            (residual(eta + scale * unit) - residual(eta - scale * unit)) / (2 * scale)
            for unit in np.eye(len(eta))
        ]
        step = np.linalg.solve(np.array(columns).T, -here)
        eta = eta + step
        if float(np.abs(step).max()) <= _ACCURACY * max(1e-3, float(np.abs(eta).max())):
            residual(eta)
            return q
    names = ", ".join(f'"{s.name}"' for s in slots)
    raise NumericalFailure(
        f"no static shape of {names} found under the loads at t = 0; they may be beyond buckling; "
        "start undeformed or give eta"
    )
