"""The closed loops of a model: assembled, their rows judged, and told of."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import SceneError

from ...pack.start import start_values
from .assembly import Assembly
from .calls import LoopCalls
from .rank import rank_at

if TYPE_CHECKING:
    from ..compiled import Compiled

#: Directions of a hinge that closes a loop, as its rows are called.
_DIRECTIONS = ("x", "y", "z", "mx", "my", "mz")
#: Gap of a row that repeats others, in parts of the length of the scene: not worth a word, and too
#: much for a rigid mechanism.
_SILENT, _LOCKED = 1e-6, 1e-3


@dataclass(frozen=True)
class Loops:
    """What closes in a scene.

    Attributes:
        cut: hinges that close loops; which of a loop's hinges does changes nothing but the work.
        rows: (hinge, direction) of every row, in the order in which they are closed: "x" to "mz"
            along and about the outboard axes of the hinge, "u1", ... for its own speeds.
        rank: how many rows say something of their own.
        redundant: rows that repeat others, so that the loads along them are not determined.
        mobility: speeds that are left free.
        width: most rows that are open across one hinge at a time.
        singular: whether the start is a singular pose, where fewer rows count than nearby.
    """

    cut: tuple[str, ...] = ()
    rows: tuple[tuple[str, str], ...] = ()
    rank: int = 0
    redundant: tuple[tuple[str, str], ...] = ()
    mobility: int = 0
    width: int = 0
    singular: bool = False


class Closed:
    """The start of a scene with its loops closed, and what is known of them."""

    def __init__(self, compiled: Compiled) -> None:
        self.compiled = compiled
        packed, engine = compiled.packed, compiled.looped
        hinges = [hinge for hinge in packed.described.hinge if not hinge.is_weld]
        self._holds = [hinge.name for hinge in hinges if hinge.hold]
        self._fast = [
            hinge.name for hinge in hinges
            if hinge.drive is None and hinge.initial is not None and any(hinge.initial.u or ())
        ]  # fmt: skip
        q, u = start_values(packed.scene, packed.layout)
        calls = LoopCalls(engine, q)
        q, u = calls.driven(q, u)
        self.start = self.assembled(q, u, self._holds, self._fast)
        self.loops = self._judged(calls)

    def assembled(
        self, q: Array, u: Array, holds: Collection[str], fast: Collection[str]
    ) -> tuple[Array, Array]:
        """The nearest (q, u) with loops closed; positions of `holds` and speeds of `fast` stay.

        Raises SceneError where there is none.
        """
        engine = self.compiled.looped
        q = Assembly(engine, q, holds).positions(q)
        return q, Assembly(engine, q, fast).speeds(q, u)

    def _judged(self, calls: LoopCalls) -> Loops:
        q, _ = self.start
        engine, model = self.compiled.looped, calls.model
        rank = rank_at(engine, q)
        calls = LoopCalls(engine, q)
        names = self._names(calls)
        missing = np.abs(calls.correction(calls.gap, q, np.zeros(engine.nu))[1])
        for row in sorted(rank.always):
            if missing[row] > _LOCKED:
                raise SceneError(
                    f'scene: direction {names[row][1]} of hinge "{names[row][0]}" repeats what '
                    f"other hinges do, but for a gap of {missing[row]:.3g}: as a rigid mechanism "
                    "it would lock; make axes parallel and points meet, or use a ball or "
                    "cylindrical hinge"
                )
            model.rows[row].softness = np.inf
        rows = calls.count
        soft = sum(1 for row in range(rows) if 0 < model.rows[row].softness < np.inf)
        frames = {one.frame for one in engine.packed.system.closures}
        own = sum(engine.packed.system.body(place).nu for place in frames)
        free = len(self.compiled.free_speeds) - own
        width = max((int(model.looped[k].n_pending) for k in range(model.n_bodies)), default=0)
        rank_here = rows - soft - len(rank.here)
        driven_own = sum(
            sum(engine.packed.system.body(place).imposed) for place in frames
        )
        return Loops(
            tuple(cut.hinge for cut in engine.packed.expanded.cuts),
            tuple(names), rank_here, tuple(names[row] for row in sorted(rank.here)),
            free + driven_own - rank_here, width, rank.singular,
        )  # fmt: skip

    def _names(self, calls: LoopCalls) -> list[tuple[str, str]]:
        """(hinge, direction) of every row."""
        names = [("", "")] * calls.count
        for place, record, rows in calls.closures():
            hinge = calls.engine.hinge_name(place)
            speeds = int(calls.model.bodies[place].nu)
            directions = calls.numbers_of(record, "W", 36)
            for direction, row in rows.items():
                along = int(np.abs(directions[direction]).argmax())
                word = f"u{direction + 1}" if direction < speeds else _DIRECTIONS[along]
                names[row] = (hinge, word)
        return names
