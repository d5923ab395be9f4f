"""Static equilibrium of a model: no effort needed at rest in the free coordinates."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mstmm.arrays import Array
from mstmm.errors import NumericalFailure
from mstmm.printable import abbreviate
from mstmm.risk import Assessed, DeferredRisks, Risk

from ..engine.loops.freedom import Freedom
from ..engine.rest import Rest, Undetermined, Unsettled, approached, leaving
from ..engine.rest_by_sweep import Loose, RestBySweep
from ..engine.sizes import speed_sizes
from ..engine.tangent import Tangent
from ..guard.answers import find_state_risks
from ..run.at_rest.mechanism import Mechanism
from ..run.system import SceneSystem
from .turns import without_turns

if TYPE_CHECKING:
    from ..engine.compiled import Compiled


#: Coordinates that a message lists.
_LISTED = 3
#: More free speeds than this come to rest by the sweep; of more than the second number no stiffness
#: matrix is made.
_SWEPT, _DENSE = 20, 600
#: Efforts along motions of loops that are rounding, in parts of the work of all that cancel.
_CANCELLED = 1e-14


class Equilibrium(Assessed, np.ndarray[Any, np.dtype[np.float64]]):
    """q (nq,) of an equilibrium, an array like any other, and how far it can be trusted.

    `residuals` are the efforts in N or N*m (of modal coordinates N, or N*m for twist) still missing
    there, by the names of the free speeds, and `unstable` those of these speeds with which it is
    left once it is disturbed, where efforts have a potential (a saddle, or the top of a hill);
    arrays computed from this one have neither, and no findings.
    """

    residuals: dict[str, float]
    unstable: tuple[str, ...]

    def __array_finalize__(self, source: object) -> None:
        self.residuals, self.unstable, self.findings = {}, (), ()


def equilibrium(model: Compiled, q: Array, t: float, tolerance: float) -> Equilibrium:
    """q at which the free coordinates need no effort at rest; see `Model.equilibrium`."""
    begun, name = q, model.layout.u_name
    if model.freedom is not None:
        begun = q = SceneSystem(model.looped).start(t, q, np.zeros(model.nu))[: model.nq]
        problem = _of_mechanism(model, model.freedom, q, t)
    else:
        problem = _problem(model, t, list(model.free_speeds))
    try:
        found, left = _found(model, problem, q, t, tolerance)
    except Undetermined as failure:
        names = abbreviate([name(failure.problem.places[k]) for k in failure.places])
        raise NumericalFailure(
            f"the equilibrium is undetermined along {names}: nothing pushes these coordinates "
            "back; fix them, drive them or add a stiffness"
        ) from None
    except Unsettled as failure:
        largest = _largest(model, failure.problem or problem, failure.residual)
        raise NumericalFailure(
            f"no equilibrium found near the start ({failure}); efforts left: {largest}; give "
            "another start, q = ..."
        ) from None
    found = without_turns(model, begun, _with_drives(model, found, t), t)
    result, problem = found.view(Equilibrium), problem.at(found)
    efforts = dict(zip(problem.places, problem.needed(found).tolist(), strict=True))
    result.residuals = {name(j): effort for j, effort in efforts.items()}
    result.unstable = tuple(map(name, left))
    result.findings = DeferredRisks(lambda: _find_risks(model, t, result))
    return result


def _find_risks(model: Compiled, t: float, found: Equilibrium) -> Iterator[Risk]:
    """Risks of the state, and coordinates with which it is left once it is disturbed."""
    yield from find_state_risks(model, t, np.asarray(found), np.zeros(model.nu))
    if found.unstable:
        names = abbreviate(found.unstable)
        yield Risk(
            "unstable", names, f"unstable: once disturbed the state is left along {names}",
            "take another start, q=..., if a stable equilibrium is meant", doubt=False,
        )  # fmt: skip


def _found(
    model: Compiled, problem: Rest, q: Array, t: float, tolerance: float
) -> tuple[Array, tuple[int, ...]]:
    """q at rest and the speeds that leave it: of trees with some bodies by their sweep, which goes
    to rest that lasts, and where it finds none, or that is in doubt, by a stiffness matrix."""
    count = len(problem.sizes)
    if model.freedom is None and count > _SWEPT:
        try:
            return _by_sweep(model, q, t, tolerance), ()
        except Loose as failure:
            if count > _DENSE:
                places = map(problem.places.index, failure.speeds)
                raise Undetermined(tuple(places), problem) from None
        except NumericalFailure:
            if count > _DENSE:
                raise
    found = approached(problem, q, tolerance)
    problem = problem.at(found)
    return found, tuple(problem.places[k] for k in leaving(problem, found))


def _by_sweep(model: Compiled, q: Array, t: float, tolerance: float) -> Array:
    """Rest of many bodies; `Unsettled` has the efforts of all free speeds."""
    engine, still = model.looped, np.zeros((1, model.nu))
    memory, free = engine.start_memory(), list(model.free_speeds)
    times, scene = np.array([t]), SceneSystem(engine)

    def acceleration(q: Array) -> Array:
        return engine.accelerations(times, q[None], still, memory[None])[1][0]

    def settled(q: Array) -> Array:
        return scene.start(t, q, still[0])[: model.nq]

    rest = RestBySweep(Tangent(engine), t, speed_sizes(model), free, acceleration, settled)
    try:
        return rest.find(q, tolerance)
    except Unsettled as failure:
        raise Unsettled(str(failure), failure.residual[free]) from None


def _problem(model: Compiled, t: float, free: list[int]) -> Rest:
    engine, still = model.looped, np.zeros(model.nu)
    memory, quaternions = engine.start_memory(), model.layout.quaternions
    straight = _straight_places(model, free)

    def needed(q: Array) -> Array:
        return np.asarray(engine.inverse_dynamics(t, q, still, still, memory)[free])

    def moved(q: Array, increment: Array) -> Array:
        if straight is not None:
            result = q.copy()
            result[straight] += increment
            return result
        speeds = np.zeros(model.nu)
        speeds[free] = increment
        result = q + engine.rates(t, q, speeds, memory)
        for first in quaternions:
            unit = result[first : first + 4]
            result[first : first + 4] = unit / np.linalg.norm(unit)
        return np.asarray(result)

    return Rest(needed, moved, speed_sizes(model)[free], tuple(free))


def _of_mechanism(model: Compiled, freedom: Freedom, q: Array, t: float) -> Rest:
    """The way of a closed q to rest along the independent speeds there: what the tree needs along
    the motions that the loops leave, which the loads of loops do not see."""
    engine, still, closed = model.looped, np.zeros(model.nu), Mechanism(model, freedom, t)

    def along(places: tuple[int, ...]) -> Rest:
        sizes = closed.sizes[list(places)]

        def needed(q: Array) -> Array:
            efforts = engine.inverse_dynamics(t, q, still, still, closed.memory)
            found = np.asarray(freedom.following(q, places).T @ efforts)
            # What nothing pushes must not go by rounding of what cancels.
            whole = float(np.abs(efforts) @ freedom.sizes)
            return np.where(np.abs(found) * sizes > _CANCELLED * whole, found, 0.0)

        def moved(q: Array, increment: Array) -> Array:
            return closed.moved(q, places, increment)

        problem = Rest(needed, moved, sizes, places, lambda q: there(places, problem, q))
        return problem

    def there(places: tuple[int, ...], problem: Rest, q: Array) -> Rest:
        chosen = freedom.chosen(q)
        return problem if chosen == places else along(chosen)

    return along(freedom.chosen(q))


def _straight_places(model: Compiled, free: list[int]) -> NDArray[np.int64] | None:
    """Places in q whose rates are the free speeds; None where a hinge has others."""
    places = np.zeros(model.nu, dtype=np.int64)
    for slots in model.layout.hinges.values():
        if slots.nu and not slots.straight:
            return None
        places[slots.u_slice] = np.arange(slots.q, slots.q + slots.nq)
    for slots in model.layout.modal.values():
        places[slots.u_slice] = np.arange(slots.q, slots.q + slots.nq)
    return np.asarray(places[free])


def _with_drives(model: Compiled, q: Array, t: float) -> Array:
    """q with driven coordinates where their drives have them."""
    return SceneSystem(model.looped).start(t, q, np.zeros(model.nu))[: model.nq]


def _largest(model: Compiled, problem: Rest, residual: Array) -> str:
    """The largest efforts by name, counted by their work over a motion of order one."""
    order = np.argsort(-np.abs(residual * problem.sizes))[:_LISTED]
    names = [model.layout.u_name(problem.places[k]) for k in order]
    listed = [f"{residual[k]:.3g} along {name}" for k, name in zip(order, names, strict=True)]
    more = len(residual) - len(listed)
    return ", ".join(listed) + " (N or N*m)" + (f" and {more} smaller" if more > 0 else "")
