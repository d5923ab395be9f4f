"""A scene with closed loops beside a state at rest: its tree along the motions that loops leave.

Torn open, the scene is a tree with R(q, u, a) the efforts that it needs; the loads of its loops,
with multipliers lambda, make R + J^T lambda = 0.  Of independent motions x, dq = N x, and
N^T J^T = 0 wherever the loops are closed, so that the equations are N^T R = 0 and their slopes

    M = N^T R_a N,   C = N^T R_u N,   K = N^T (R_q + d(J^T lambda)/dq) N

with lambda as it stands there: what turning loads add is K of the closed scene, whose tangent has
the loads of its loops in it, less that of the tree.

Where a drive goes by d, all else goes along: dq = N x + n d, x being zero in n, and what it asks
for are the same slopes along n.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import SceneError

from ...engine.compiled import Compiled
from ...engine.engine import Engine
from ...pack.loops.variants import torn
from ...pack.pack import packed_system
from ..channels import Channel, columns
from ..drives import Columns, Moves, coordinate, slopes_along
from ..matrices import Matrices, State, matrices


@dataclass(frozen=True, eq=False)
class Mechanism:
    """The motions of a mechanism beside one state.

    Attributes:
        tree: the scene with its loops open.
        free: places of the speeds of the tree that nobody imposes.
        places: those of the n independent ones, which x are.
        ways: (nu, n) all speeds for a unit of each.
        turned: (n, n) stiffness of the loads that the loops carry.
        model: whose mechanism it is.
    """

    model: Compiled = field(repr=False)
    tree: Engine
    free: tuple[int, ...]
    places: tuple[int, ...]
    ways: Array
    turned: Array = field(repr=False)

    def matrices(self, engine: Engine, state: State) -> Matrices:
        """Those of the tree, or of it with other elements, along x."""
        found = _along(engine, state, self.free, self.ways, self.ways)
        return Matrices(found.M, found.C, found.K + self.turned)

    def pushed(self, state: State, channels: Sequence[Channel]) -> Array:
        """(n, channels): what a unit of each push does along x, of drives their accelerations."""
        every, found = list(range(len(self.ways))), np.zeros((len(self.places), len(channels)))
        still = [k for k, one in enumerate(channels) if one.drive < 0]
        pushes = [channels[k] for k in still]
        found[:, still] = self.ways.T @ columns(self.tree, state, pushes, every)
        for k, one in enumerate(channels):
            if one.drive >= 0:
                found[:, k] = -self.driven(state, one.moves).inertia
        return found

    def driven(self, state: State, moves: Moves) -> Columns:
        """Along x (n,): what drives that go along with one motion ask for."""
        along = np.sum([factor * self._driving(state, speed) for speed, factor in moves], axis=0)
        closed, tree = self.model.looped, self.tree
        rows = _with_own_still(self.model, self.ways)
        return Columns(
            rows.T @ slopes_along(closed, state, along).stiffness,
            self.ways.T @ slopes_along(tree, state, along).damping,
            self.ways.T @ slopes_along(tree, state, along).inertia,
        )

    def _driving(self, state: State, speed: int) -> Array:
        """n (nu,): all speeds for a unit of one that is imposed.  SceneError where loops do not let
        it move."""
        freedom = self.model.freedom
        assert freedom is not None
        along = freedom.driving(state.q, speed)
        if not np.isfinite(along).all():
            raise SceneError(
                f'"{coordinate(self.model, speed)}": the loops do not let this drive move at this '
                "state; take a state beside it, or another input"
            )
        return np.asarray(along - self.ways @ along[list(self.places)])

    def rows(self, state: State, wide: Array, drives: Collection[int]) -> Array:
        """Rows (k, nu) of what goes with all speeds, as rows of x and of drives in the places of
        these."""
        found = np.zeros_like(wide)
        found[:, self.places] = wide @ self.ways
        for speed in drives:
            found[:, speed] = wide @ self._driving(state, speed)
        return found


def mechanism_at(model: Compiled, state: State) -> Mechanism | None:
    """The mechanism at a state at rest; None for a tree.

    Raises SceneError for a state that moves, NumericalFailure where loops leave no one set of
    motions.
    """
    if model.freedom is None:
        return None
    _refuse_moving(model, state)
    packed, places = model.packed, model.freedom.chosen(state.q)
    ways, free = model.freedom.following(state.q, places), model.free_speeds
    tree = Engine(packed_system(torn(packed.system), packed))
    carried = _along(model.looped, state, free, ways, _with_own_still(model, ways)).K
    alone = _along(tree, state, free, ways, ways).K
    return Mechanism(model, tree, free, places, ways, carried - alone)


def _refuse_moving(model: Compiled, state: State) -> None:
    free = set(model.free_speeds)
    moving = [k for k in np.flatnonzero(state.u).tolist() if k in free]
    if not moving:
        return
    driving = [k for k in np.flatnonzero(state.u).tolist() if k not in free]
    if driving:
        name = model.layout.u_name(driving[0]).rpartition(".")[0]
        cause, way = f'the drive of "{name}" moves it', "let the drive stand still there"
    else:
        cause = f"{model.layout.u_name(moving[0])} = {state.u[moving[0]]:.4g}"
        way = "take u = 0, or leave u out"
    raise SceneError(
        "a linear model of closed loops is that of a state at rest, and this one moves "
        f"({cause} at t = {state.t:g} s); {way}"
    )


def _along(
    engine: Engine, state: State, free: tuple[int, ...], ways: Array, rows: Array
) -> Matrices:
    found, n, left = matrices(engine, state, list(free)), ways[list(free)], rows[list(free)]
    return Matrices(*(left.T @ matrix @ n for matrix in (found.M, found.C, found.K)))


def _with_own_still(model: Compiled, ways: Array) -> Array:
    """`ways` (nu, n) of the tree alone: what hinges that close loops do is load on their bodies."""
    system, rows = model.packed.system, ways.copy()
    for one in system.closures:
        first = int(system.places["u"][one.frame])
        rows[first : first + system.body(one.frame).nu] = 0.0
    return rows
