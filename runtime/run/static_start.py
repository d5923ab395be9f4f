"""Flexible bodies that start in the static shape under the loads at t = 0."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import NumericalFailure

from ..engine.rest import Rest, Undetermined, Unsettled, at_rest
from ..flexible.modal_body import ModalBody
from ..flexible.sizes import modal_sizes
from ..pack.layout import HingeSlots

#: (q, u, udot) -> efforts (nu,) that these accelerations need.
InverseDynamics = Callable[[Array, Array, Array], Array]

_ACCURACY = 1e-10

#: Rotation of a section, rad, that the kernels refuse.
_LARGEST_TURN = 1.5


def settle(
    needed: InverseDynamics,
    q: Array,
    u: Array,
    bodies: Mapping[str, ModalBody],
    slots: Mapping[str, HingeSlots],
) -> Array:
    """q with the modal coordinates of `bodies` at rest: no modal speed, no modal acceleration.

    Hinges stay at their places and keep their speeds without acceleration (a spinning blade starts
    stretched out); so the shape is that of bodies whose hinges are held.  Raises NumericalFailure
    if there is no such shape nearby.
    """
    own = [slots[name] for name in bodies]
    at_q = np.concatenate([np.arange(s.q, s.q + s.nq) for s in own])
    at_u = np.concatenate([np.arange(s.u, s.u + s.nu) for s in own])
    u, rest = u.copy(), np.zeros(len(u))
    u[at_u] = 0.0

    def moved(q: Array, increment: Array) -> Array:
        result = q.copy()
        result[at_q] += increment
        return result

    sizes = np.concatenate([modal_sizes(body) for body in bodies.values()])
    problem = Rest(lambda q: needed(q, u, rest)[at_u], moved, sizes)
    try:
        found = at_rest(problem, q, _ACCURACY)
    except (Unsettled, Undetermined) as failure:
        names = ", ".join(f'"{name}"' for name in bodies)
        where = "are at the edge of" if isinstance(failure, Undetermined) else "may be beyond"
        raise NumericalFailure(
            f"no static shape of {names} found under the loads at t = 0; they {where} buckling; "
            "start undeformed or give eta"
        ) from None
    for name, body in bodies.items():
        _refuse_turned(body, found[slots[name].q_slice])
    return found


def _refuse_turned(body: ModalBody, eta: Array) -> None:
    """NumericalFailure for a shape in which an end turns further than the model knows."""
    turned = max(float(np.linalg.norm(port.theta @ eta)) for port in body.ports.values())
    if turned > _LARGEST_TURN:
        raise NumericalFailure(
            f'the static shape of "{body.name}" under the loads at t = 0 turns an end by '
            f"{turned:.2g} rad against its frame, far beyond small deflections; check the "
            "stiffness, split the body into several that are welded together, or start undeformed"
        )
