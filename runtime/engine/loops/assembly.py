"""Assembly: the nearest state in which the loops are closed.

Positions by steps that let the rows give way (Levenberg, Quart. Appl. Math. 2 (1944) 164-168):
with mu times their mobility on the diagonal of L a step is the change of least inertia that closes
the gaps as far as mu allows, and far from where a loop closes it does not run wild.  Speeds by one
correction, as slips are linear in them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import NumericalFailure, OpenLoop, SceneError

from ...pack.loops.variants import LOCKED, held, length_of, stiff
from ...pack.pack import packed_system
from ..engine import Engine
from .calls import LoopCalls
from .parallel import COUNTING, skewed, skewed_by_gap

#: Longest step of a coordinate (rad, m), and most steps.
_LONGEST, _STEPS = 0.5, 300
#: Compliance of the rows: the first, and where there is no use in more or in less.
_FIRST, _MOST, _LEAST = 1e-2, 1e8, 1e-12
#: Ways along which misfits close are so many times longer than these.
_LONG = 50.0
#: Gap (m, rad) that is closed where hinges are up to 1 m apart, and change (rad, m) at which
#: nothing moves any more.
_CLOSED, _STILL = 1e-10, 1e-9
#: Other starts where one leads to an open loop, and how far they are from it (rad, m).
_TRIES, _SHAKEN = 4, 0.1
#: So often at most rows are chosen anew.
_CHOICES = 4
#: So many hinges are named.
_NAMED = 8
#: Distance of a mass centre in sizes of the scene from which on its body hardly moves.
_FAR = 1e5
#: Speeds by which rows may slip, in parts of the largest; pivots that still tell a row from others,
#: in parts of its mobility.
_SLIP, _TOLD = 1e-8, 1e-15
#: So much that the own coordinates of closing hinges alone follow.
_ALONE = 1e14


def with_held(engine: Engine, hinges: Collection[str]) -> Engine:
    """The engine of the same scene with all speeds of some hinges imposed, in which flexible bodies
    resist a change of their shape as they do at rest."""
    packed = engine.packed
    places = {packed.hinge_position[name] for name in hinges}
    if not places and not packed.flexible:
        return engine
    found = Engine(packed_system(stiff(held(packed.system, places)), packed))
    known, own = packed.written.loops, found.packed.written.loops
    assert known is not None and own is not None
    own.judge_as(known)
    return found


class Assembly:
    """Assembly of one packed scene at `t` (s) with some hinges held; `q` (nq,) is near what is
    asked.

    `behind` says, as words that end a message, what is behind loops that do not close near a q.
    """

    def __init__(
        self, engine: Engine, q: Array, hinges: Collection[str] = (),
        behind: Callable[[Array], str] = lambda q: "", t: float = 0.0,
    ) -> None:  # fmt: skip
        self.held, self._behind = tuple(hinges), behind
        self.calls = LoopCalls(with_held(engine, hinges), q, t=t)
        if self.calls.engine is not engine:
            self.calls.judge_by([q])
        self._weights = self._weighted()
        #: 1 for speeds that nobody holds.
        self.free = self._free_speeds()

    def positions(self, q: Array, much: float = 0.0, rough: bool = True) -> Array:
        """q (nq,) with loops closed, or with gaps that no change closes of up to `much` (m, rad);
        a `rough` one leaves gaps as small open that only long ways close.

        Raises OpenLoop with the least gap, its pose and what was held where there is none near.
        """
        draw, start = np.random.default_rng(0), q
        rough = rough and much > 0.0
        nearest, missing = self._nearest(start, rough)
        for _ in range(_TRIES):
            if self._closes(missing, much):
                return nearest
            # Where all is in line nothing tells which way to bend.
            shaken = draw.uniform(-_SHAKEN, _SHAKEN, len(self._still)) * self.free
            trial, after = self._nearest(self.calls.moved(start, shaken), rough)
            if self._largest(after) < self._largest(missing):
                nearest, missing = trial, after
        if self._closes(missing, much):
            return nearest
        gap = self._largest(missing)
        raise OpenLoop(self._open(nearest, missing), gap, self.by_names(nearest))

    def nearest_closed(self, q: Array, much: float = 0.0) -> Array | None:
        """q (nq,) where steps from q lead, if loops are closed there but for gaps up to `much`."""
        try:
            found, missing = self._nearest(q, much > 0.0)
        except NumericalFailure:
            return None
        return found if self._closes(missing, much) else None

    def _nearest(self, q: Array, rough: bool = False) -> tuple[Array, Array]:
        """q of the least gap that steps from q lead to, and what the rows lack there; a `rough` one
        leaves misfits open that only long ways along a motion close."""
        self.calls.choose(q)
        for _ in range(_CHOICES):
            q, missing = self._stepped(q, rough)
            if not self.calls.choose(q):
                break
        return q, missing

    def _stepped(self, q: Array, rough: bool) -> tuple[Array, Array]:
        """The same for the rows that are chosen."""
        q, give, left = self._own(q), _FIRST, np.inf
        rest = self._rest(q)
        for _ in range(_STEPS):
            change, missing = self._correction(q, give)
            if self._closes(missing):
                q = self.calls.moved(q, change)
                break
            length = float(np.abs(change).max(initial=0.0))
            if rough and self._largest(missing) < self._locks:
                left = _LONG * self._largest(missing) if left == np.inf else left
                left -= length
                if left < 0.0:
                    break
            trial = self._own(self.calls.moved(q, change * min(1.0, _LONGEST / (length or 1.0))))
            after = self._rest(trial)
            if after < rest:
                whole = 3.0 if length < _LONGEST else 1.0
                give = max(give / (10.0 if after < rest / 2.0 else whole), _LEAST)
                q, rest = trial, after
            elif give > _MOST or length < _STILL:
                break
            else:
                give *= 10.0
        return q, self._lacking(q, self._still, self.calls.gap, _MOST)[1]

    def _lacking(self, q: Array, u: Array, level: int, give: float = 0.0) -> tuple[Array, Array]:
        """A correction and what the rows lack, but for misfits of those that are not met now."""
        change, missing = self.calls.correction(level, q, u, give)
        most = self._locks * max(1.0, float(np.abs(u).max(initial=0.0)))
        misfits = self.calls.resting() & (np.abs(missing) <= most)
        return change, np.where(misfits, 0.0, missing)

    def speeds(self, q: Array, u: Array) -> Array:
        """u (nu,) without slips at the closed q.  SceneError where those held do not allow it."""
        self.calls.choose(q)
        u, missing = self._without_slips(q, u)
        counting = self.calls.inverses() > 0
        if self._slipping(u, missing) is not None and not counting.all():
            # Beside a singular pose rows are still told apart by rounding's leave.
            floors = [self.calls.records.floor(row) for row in range(self.calls.count)]
            for k, mobility in enumerate(self.calls.mobility.tolist()):
                self.calls.records.judge(k, _TOLD * mobility)
            u, missing = self._without_slips(q, u)
            for k, floor in enumerate(floors):
                self.calls.records.judge(k, floor)
        row = self._slipping(u, missing)
        if row is not None:
            known = self._behind(q) or skewed(self.calls.engine.packed, COUNTING)
            raise SceneError(
                f"scene: the speeds given for {self._names()} contradict each other by "
                f"{self._amount(row, missing, '.3g', '/s')} {self._where(row)}; "
                f"{known or 'give fewer of them, or others'}"
            )
        return u

    def _without_slips(self, q: Array, u: Array) -> tuple[Array, Array]:
        """u with its slips corrected, and what is left of them."""
        change, missing = self._lacking(q, u, self.calls.slip)
        largest = self._largest(missing)
        while True:  # once, but for digits lost behind heavy bodies
            trial = u + self.free * change
            change, after = self._lacking(q, trial, self.calls.slip)
            if not self._largest(after) < largest:
                return u, missing
            u, missing, largest = trial, after, self._largest(after)

    def _slipping(self, u: Array, missing: Array) -> int | None:
        """The row that slips most, where that is more than rounding."""
        much = _SLIP * max(1.0, float(np.abs(u).max(initial=0.0)))
        slips = np.abs(missing) / self._sizes
        return int(slips.argmax()) if slips.max(initial=0.0) > much else None

    def _free_speeds(self) -> Array:
        engine, packed = self.calls.engine, self.calls.engine.packed
        driven = {(engine.hinge_name(place), k) for place, k in packed.system.driven}
        found = np.ones(engine.nu)
        for hinge in packed.described.hinge:
            slots = packed.layout.hinges[hinge.name]
            for k in range(slots.nu):
                bound = hinge.name in self.held or hinge.is_weld or (hinge.name, k) in driven
                found[slots.u + k] = float(not bound)
        return found

    @property
    def _still(self) -> Array:
        return np.zeros(self.calls.engine.nu)

    def _correction(self, q: Array, give: float) -> tuple[Array, Array]:
        """What closes the gaps, and these; what is held stays, though its rows may yield."""
        change, missing = self._lacking(q, self._still, self.calls.gap, give)
        return self.free * change, missing

    def _own(self, q: Array) -> Array:
        """q with the own coordinates of closing hinges where the bodies put them."""
        for _ in range(12):
            change, _ = self._correction(q, _ALONE)
            length = float(np.abs(change).max(initial=0.0))
            if not length > _STILL:
                break
            q = self.calls.moved(q, change * min(1.0, _LONGEST / length))
        return q

    def _rest(self, q: Array) -> float:
        missing = self._lacking(q, self._still, self.calls.gap, _ALONE)[1]
        with np.errstate(over="ignore"):  # what is asked may be beyond all squares
            return float(np.sum(self._weights * missing**2))

    def _closes(self, missing: Array, much: float = 0.0) -> bool:
        """Whether gaps are none, for the size of what they are part of, or no more than `much`."""
        return bool(np.all(np.abs(missing) <= np.maximum(much, _CLOSED * self._sizes)))

    def _largest(self, missing: Array) -> float:
        return float(np.abs(missing).max(initial=0.0))

    def _weighted(self) -> Array:
        """The same for all gaps, for all angles and for all couplings: the mean mobility of their
        kind, so that the least gap is that of the geometry."""
        calls = self.calls
        turning = np.zeros(calls.count, bool)
        for one in calls.records.closures:
            directions = calls.numbers_of(one, "W")
            for direction, row in one.rows.items() if one.kind == "hinge" else ():
                force, moment = directions[direction, :3], directions[direction, 3:]
                turning[row] = moment @ moment > force @ force
        coupling = np.zeros(calls.count, bool)
        coupling[[one.row for one in calls.records.couplings]] = True
        weights, self._turning = np.ones(calls.count), turning
        length = max(1.0, length_of(calls.engine.packed.system))
        self._sizes = np.where(turning | coupling, 1.0, length)
        self._locks = LOCKED * length_of(calls.engine.packed.system)
        for kind in (turning, coupling, ~(turning | coupling)):
            if kind.any():
                weights[kind] = 1.0 / calls.mobility[kind].mean()
        for row in range(calls.count):
            calls.records.scale(row, 1.0 / float(weights[row]))
        return weights

    # --- words ------------------------------------------------------------------------------------

    def _open(self, q: Array, missing: Array) -> str:
        row = int(np.abs(missing).argmax())
        while_held = f" with {self._names()} held" if self.held or self._driven() else ""
        return (
            f"scene: {self._subject(row)}: the nearest pose leaves "
            f"{self._amount(row, missing, '.7g')}{while_held}; {self._remedy(row, q, missing)}"
        )

    def by_names(self, q: Array) -> dict[str, tuple[float, ...]]:
        """q of hinges and of flexible bodies that have some."""
        layout = self.calls.engine.packed.layout
        slots = {**layout.hinges, **layout.modal}
        return {name: tuple(q[one.q_slice].tolist()) for name, one in slots.items() if one.nq}

    def _names(self) -> str:
        """Hinges that are held or driven."""
        names = [f'"{name}"' for name in (*self.held, *self._driven())]
        return ", ".join(names[:_NAMED]) + (" ..." if names[_NAMED:] else "")

    def _driven(self) -> list[str]:
        packed = self.calls.engine.packed
        hinges = packed.described.hinge if packed.system.driven else ()
        return [hinge.name for hinge in hinges if hinge.drive and hinge.name not in self.held]

    def _where(self, row: int) -> str:
        closing = self.calls.closing(row)
        return f"in {closing}" if self.calls.coupling_of(row) else f"where {closing} closes a loop"

    def _subject(self, row: int) -> str:
        closing = self.calls.closing(row)
        if self.calls.coupling_of(row):
            return f"{closing} cannot hold"
        return f"the loop that {closing} closes stays open"

    def _far_mass(self) -> str:
        """A body whose mass centre lies so far away that hardly anything moves it; "" without."""
        bodies = self.calls.engine.packed.described.body
        size = max(
            (math.hypot(*end.position) for b in bodies for end in b.ends.values()), default=0
        )
        for body in bodies:
            away = math.hypot(*body.center_of_mass)
            if size and away > _FAR * size:
                return (
                    f'the mass centre of body "{body.name}" is {away:.3g} m from its origin, '
                    f"{away / size:.0e} times the size of the scene; correct center_of_mass"
                )
        return ""

    def _remedy(self, row: int, q: Array, missing: Array) -> str:
        if self.calls.coupling_of(row):
            return "leave it or another coupling out, or correct what they equal"
        known = (
            self._behind(q)
            or self._far_mass()
            or skewed_by_gap(self.calls.engine.packed, self._largest(missing))
        )
        if known:
            return known
        less = ", hold or drive less" if self.held or self._driven() else ""
        return f"correct lengths or axes{less}, or start nearer to where it closes"

    def _amount(self, row: int, missing: Array, digits: str, per: str = "") -> str:
        amount = f"{abs(missing[row]):{digits}}"
        if self.calls.coupling_of(row):
            return amount
        return f"{amount} {'rad' if self._turning[row] else 'm'}{per}"
