"""A scene with closed loops beside a state at rest: its tree along the motions that loops leave.

Torn open, the scene is a tree with R(q, u, a) the efforts that it needs; the loads lambda of its
loops make R + J^T lambda = 0.  Of independent motions x, dq = N x, and N^T J^T = 0 wherever the
loops are closed, so that the equations are N^T R = 0 and their slopes

    M = N^T R_a N,   C = N^T R_u N,   K = N^T (R_q + d(J^T lambda)/dq) N

with lambda as it stands there: two opposite loads at one point, whose slopes are those of any loads
with fixed components on the two bodies.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import SceneError

from ...engine.compiled import Compiled
from ...engine.engine import Engine
from ...pack.loops.variants import torn
from ...pack.pack import packed_system
from ...pack.system import LoadNumbers, System
from ...pack.values import constant_kernel
from ..channels import Channel, columns
from ..matrices import Matrices, State, matrices
from ..standing import INERTIAL


@dataclass(frozen=True, eq=False)
class Mechanism:
    """The motions of a mechanism beside one state.

    Attributes:
        tree: the scene with its loops open.
        free: places of the speeds of the tree that nobody imposes.
        places: those of the n independent ones, which x are.
        ways: (nu, n) all speeds for a unit of each.
        turned: (n, n) stiffness of the loads that the loops carry.
    """

    tree: Engine
    free: tuple[int, ...]
    places: tuple[int, ...]
    ways: Array
    turned: Array = field(repr=False)

    def matrices(self, engine: Engine, state: State) -> Matrices:
        """Those of the tree, or of it with other elements, along x."""
        found = _along(engine, state, self.free, self.ways)
        return Matrices(found.M, found.C, found.K + self.turned)

    def pushed(self, state: State, channels: Sequence[Channel]) -> Array:
        """(n, channels): what a unit of each push does along x."""
        every = list(range(len(self.ways)))
        return np.asarray(self.ways.T @ columns(self.tree, state, channels, every))

    def rows(self, wide: Array) -> Array:
        """Rows (k, nu) of what goes with all speeds, as rows of x in the places of these."""
        found = np.zeros_like(wide)
        found[:, self.places] = wide @ self.ways
        return found


def refuse_motions(channels: Sequence[Channel]) -> None:
    """SceneError for motions of drives, which loops pass on."""
    for one in channels:
        if one.drive >= 0:
            raise SceneError(
                f'"{one.name}": motions of drives are no inputs of linear models with closed loops '
                "yet; push by an effort or a force at an end"
            )


def mechanism_at(model: Compiled, state: State) -> Mechanism | None:
    """The mechanism at a state at rest; None for a tree.

    Raises SceneError for a state that moves, NumericalFailure where loops leave no one set of
    motions.
    """
    if model.freedom is None:
        return None
    if state.u[list(model.free_speeds)].any():
        raise SceneError(
            "a linear model of closed loops is that of a state at rest, and this one moves; leave "
            "u out"
        )
    packed, places = model.packed, model.freedom.chosen(state.q)
    ways, free = model.freedom.following(state.q, places), model.free_speeds
    alone = _under_loads(model.looped, state)
    still = State(state.t, state.q, 0 * state.u, 0 * state.a)
    turned = _along(alone, still, free, ways).K
    return Mechanism(Engine(packed_system(torn(packed.system), packed)), free, places, ways, turned)


def _along(engine: Engine, state: State, free: tuple[int, ...], ways: Array) -> Matrices:
    found, n = matrices(engine, state, list(free)), ways[list(free)]
    return Matrices(*(n.T @ matrix @ n for matrix in (found.M, found.C, found.K)))


def _under_loads(engine: Engine, state: State) -> Engine:
    """The tree under what its loops carry alone, in fixed directions."""
    packed = engine.packed
    seen = engine.observe(
        np.array([state.t]), state.q[None], state.u[None], engine.start_memory()[None],
        parts=("loads",),
    )  # fmt: skip
    system, numbers = torn(packed.system), list[float]()
    loads = tuple(_pairs(packed.system, seen.loads[0], numbers))
    system = replace(
        system, gravity=(0.0, 0.0, 0.0), laws=(), forces=(), loads=loads,
        values=constant_kernel("values", system, numbers), drives=None, driven=(), moving={},
    )  # fmt: skip
    return Engine(packed_system(system, packed))


def _pairs(system: System, carried: Array, numbers: list[float]) -> Iterator[LoadNumbers]:
    """What every hinge that closes a loop does to its outboard body, and the reaction; their
    components join the numbers."""
    for one in system.closures:
        about = (0.0, 0.0, -system.body(one.frame).height)
        there = np.reshape(one.turn, (3, 3)) @ about + one.end
        for body, place, sign in ((one.outboard, there, 1.0), (one.frame, about, -1.0)):
            first = len(numbers)
            if body >= 0:
                numbers += (sign * carried[one.frame]).tolist()
                force, moment = range(first, first + 3), range(first + 3, first + 6)
                yield LoadNumbers(body, -1, INERTIAL, tuple(place), tuple(force), tuple(moment))
