"""Flexible bodies that start in the static shape under the loads at t = 0."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure

from ...engine.statics.rest import Rest, Undetermined, Unsettled, find_determined_equilibrium
from ...flexible.modal_body import ModalBody
from ...flexible.modal_scales import modal_sizes
from ...packing.coordinate_layout import HingeSlots
from .closed_states import ClosedStates

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene
    from ...engine.loops.independent_speeds import IndependentSpeeds

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
    at_q = _places(slots[name].q_slice for name in bodies)
    at_u = _places(slots[name].u_slice for name in bodies)
    u, rest = u.copy(), np.zeros(len(u))
    u[at_u] = 0.0

    def moved(q: Array, increment: Array) -> Array:
        result = q.copy()
        result[at_q] += increment
        return result

    sizes = np.concatenate([modal_sizes(body) for body in bodies.values()])
    problem = Rest(lambda q: needed(q, u, rest)[at_u], moved, sizes)
    return _settled(problem, q, bodies, slots)


def settle_among_loops(
    model: CompiledScene,
    freedom: IndependentSpeeds,
    q: Array,
    u: Array,
    bodies: Mapping[str, ModalBody],
) -> tuple[Array, Array]:
    """(q, u) near a closed state with the modal coordinates of `bodies` at rest, as in `settle`.

    As many hinges stay at their places and keep their speeds as the mechanism has freedoms with
    its shapes held, with the shapes of other bodies; the other hinges follow.
    """
    slots, closed = model.layout.modal, ClosedStates(model, freedom, 0.0)
    shapes = _places(slots[name].u_slice for name in bodies).tolist()
    held, own = freedom.settling(q, shapes, *_staying(model, u, bodies))
    places, count = (*held, *own), len(held)
    kept = np.append(u[list(held)], np.zeros(len(own)))

    def motion(q: Array) -> tuple[Array, Array, Array]:
        """All speeds, and accelerations, where those that stay have none; and how all follow."""
        follows, slipless = freedom.following(q, places), closed.state(q, u)[1]
        speeds = slipless + follows @ (kept - slipless[list(places)])
        speeds[list(places)] = kept
        return speeds, closed.accelerations(q, speeds, places, follows), follows

    def needed(q: Array) -> Array:
        speeds, rates, follows = motion(q)
        efforts = closed.engine.inverse_dynamics(0.0, q, speeds, rates, closed.memory)
        return np.asarray(follows[:, count:].T @ efforts)

    def moved(q: Array, increment: Array) -> Array:
        return closed.moved_beside(q, places, np.append(np.zeros(count), increment), count)

    found = _settled(Rest(needed, moved, closed.sizes[list(own)], own), q, bodies, slots)
    return found, motion(found)[0]


def _staying(
    model: CompiledScene, u: Array, bodies: Mapping[str, ModalBody]
) -> tuple[list[int], ...]:
    """Speeds that are to stay where the shapes of `bodies` settle: of hinges that the scene holds
    and of the shapes of other bodies; and those that stay rather than others, being given."""
    layout, free = model.layout, set(model.free_speeds)
    tables = [one for one in model.packed.described.hinge if one.hold]
    kept = [slots.u_slice for name, slots in layout.modal.items() if name not in bodies]
    kept += [layout.hinges[one.name].u_slice for one in tables]
    fast = [] if model.closed is None else model.closed.fast
    wished = [layout.hinges[name].u_slice for name in fast]
    chosen = [k for k in _places(kept).tolist() if k in free]
    return chosen, [k for k in _places(wished).tolist() if k in free - {*chosen} and u[k]]


def _places(slices: Iterable[slice]) -> NDArray[np.int64]:
    return np.concatenate([np.zeros(0, np.int64), *(np.arange(s.start, s.stop) for s in slices)])


def _settled(
    problem: Rest, q: Array, bodies: Mapping[str, ModalBody], slots: Mapping[str, HingeSlots]
) -> Array:
    try:
        found = find_determined_equilibrium(problem, q, _ACCURACY)
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
