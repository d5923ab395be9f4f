"""Assembly: the nearest state in which the loops are closed.

Positions are found by steps with compliant rows (Levenberg, Quart. Appl. Math. 2 (1944) 164-168):
with mu times their mobility on the diagonal of L a step is the change of least inertia that closes
the gaps as far as mu permits, and it stays bounded far from a closed state.  Speeds need one
correction because velocity errors are linear in them.
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

#: Longest step of a coordinate (rad, m), and maximum number of steps.
_LONGEST, _STEPS = 0.5, 300
#: Compliance of the rows: initial, maximum and minimum.
_FIRST, _MOST, _LEAST = 1e-2, 1e8, 1e-12
#: Paths along which misfits close are so many times longer than the misfits.
_LONG = 50.0
#: Gap (m, rad) that counts as closed for distances of hinges up to 1 m, and change (rad, m) at
#: which the iteration has converged.
_CLOSED, _STILL = 1e-10, 1e-9
#: Number of other starts if one leads to an open loop, and their distance from it (rad, m).
_TRIES, _SHAKEN = 4, 0.1
#: Maximum number of choices of rows.
_CHOICES = 4
#: Maximum number of hinges named in a message.
_NAMED = 8
#: Distance of a mass centre, relative to the size of the scene, beyond which its body hardly moves.
_FAR = 1e5
#: Permitted velocity errors relative to the largest speed; smallest pivot of an independent row
#: relative to its mobility.
_SLIP, _TOLD = 1e-8, 1e-15
#: Compliance so large that only the coordinates of closing hinges change.
_ALONE = 1e14


def with_held(engine: Engine, hinges: Collection[str]) -> Engine:
    """Engine of the same scene with all speeds of some hinges prescribed.

    Flexible bodies have their stiffness at rest in it.
    """
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
    """Assembly of one packed scene at `t` (s) with some hinges held, near `q` (nq,).

    `behind` returns the end of a message with the cause of loops that do not close near a q.
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
        #: 1 for speeds that are neither held nor driven, else 0.
        self.free = self._free_speeds()

    def positions(self, q: Array, much: float = 0.0, rough: bool = True) -> Array:
        """Close the loops near q (nq,).

        Gaps of up to `much` (m, rad) that no change closes may remain; with `rough` also those that
        close only after a long path.  Raises OpenLoop with the smallest gap, its pose and the held
        hinges if there is no such state near.
        """
        draw, start = np.random.default_rng(0), q
        rough = rough and much > 0.0
        nearest, missing = self._nearest(start, rough)
        for _ in range(_TRIES):
            if self._closes(missing, much):
                return nearest
            # With all links in line the direction of bending is undetermined.
            shaken = draw.uniform(-_SHAKEN, _SHAKEN, len(self._still)) * self.free
            trial, after = self._nearest(self.calls.moved(start, shaken), rough)
            if self._largest(after) < self._largest(missing):
                nearest, missing = trial, after
        if self._closes(missing, much):
            return nearest
        gap = self._largest(missing)
        raise OpenLoop(self._open(nearest, missing), gap, self.by_names(nearest))

    def nearest_closed(self, q: Array, much: float = 0.0) -> Array | None:
        """State (nq,) to which steps from q lead if its gaps are at most `much`, else None."""
        try:
            found, missing = self._nearest(q, much > 0.0)
        except NumericalFailure:
            return None
        return found if self._closes(missing, much) else None

    def _nearest(self, q: Array, rough: bool = False) -> tuple[Array, Array]:
        """State of the smallest gap to which steps from q lead, and the errors of the rows there.

        With `rough`, misfits that close only after a long path along a motion remain.
        """
        self.calls.choose(q)
        for _ in range(_CHOICES):
            q, missing = self._stepped(q, rough)
            if not self.calls.choose(q):
                break
        return q, missing

    def _stepped(self, q: Array, rough: bool) -> tuple[Array, Array]:
        """Result of `_nearest` for the rows chosen at present."""
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
        """Correction and errors of the rows, without misfits of rows that are not satisfied now."""
        change, missing = self.calls.correction(level, q, u, give)
        most = self._locks * max(1.0, float(np.abs(u).max(initial=0.0)))
        misfits = self.calls.resting() & (np.abs(missing) <= most)
        return change, np.where(misfits, 0.0, missing)

    def speeds(self, q: Array, u: Array) -> Array:
        """Remove the velocity errors of u (nu,) at the closed q.

        SceneError if the held speeds do not permit it.
        """
        self.calls.choose(q)
        u, missing = self._without_slips(q, u)
        counting = self.calls.inverses() > 0
        if self._slipping(u, missing) is not None and not counting.all():
            # Near a singular pose small pivots above rounding still belong to independent rows.
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
                f"{known or 'give fewer or other speeds'}"
            )
        return u

    def _without_slips(self, q: Array, u: Array) -> tuple[Array, Array]:
        """Speeds u with corrected velocity errors, and the remaining errors of the rows."""
        change, missing = self._lacking(q, u, self.calls.slip)
        largest = self._largest(missing)
        while True:  # once, except for digits lost because of heavy outboard bodies
            trial = u + self.free * change
            change, after = self._lacking(q, trial, self.calls.slip)
            if not self._largest(after) < largest:
                return u, missing
            u, missing, largest = trial, after, self._largest(after)

    def _slipping(self, u: Array, missing: Array) -> int | None:
        """Row with the largest velocity error if that exceeds rounding, else None."""
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
        """Correction of the gaps, and the gaps; held coordinates stay, though their rows comply."""
        change, missing = self._lacking(q, self._still, self.calls.gap, give)
        return self.free * change, missing

    def _own(self, q: Array) -> Array:
        """Adapt the coordinates of closing hinges in q to the positions of the bodies."""
        for _ in range(12):
            change, _ = self._correction(q, _ALONE)
            length = float(np.abs(change).max(initial=0.0))
            if not length > _STILL:
                break
            q = self.calls.moved(q, change * min(1.0, _LONGEST / length))
        return q

    def _rest(self, q: Array) -> float:
        missing = self._lacking(q, self._still, self.calls.gap, _ALONE)[1]
        with np.errstate(over="ignore"):  # squares of requested values may overflow
            return float(np.sum(self._weights * missing**2))

    def _closes(self, missing: Array, much: float = 0.0) -> bool:
        """True if all gaps are zero relative to the scene's size, or at most `much`."""
        return bool(np.all(np.abs(missing) <= np.maximum(much, _CLOSED * self._sizes)))

    def _largest(self, missing: Array) -> float:
        return float(np.abs(missing).max(initial=0.0))

    def _weighted(self) -> Array:
        """Weights (rows,) of the gaps: the inverse mean mobility of lengths, angles or couplings.

        Equal weights within a kind make the smallest gap a property of the geometry.
        """
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
        """Coordinates q by the names of hinges and flexible bodies."""
        layout = self.calls.engine.packed.layout
        slots = {**layout.hinges, **layout.modal}
        return {name: tuple(q[one.q_slice].tolist()) for name, one in slots.items() if one.nq}

    def _names(self) -> str:
        """Names of the held or driven hinges for messages."""
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
            return f"{closing} cannot be satisfied"
        return f"the loop that {closing} closes stays open"

    def _far_mass(self) -> str:
        """End of a message that names a body with an implausibly distant mass centre, or ""."""
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
            return "omit it or another coupling, or correct their expressions"
        known = (
            self._behind(q)
            or self._far_mass()
            or skewed_by_gap(self.calls.engine.packed, self._largest(missing))
        )
        if known:
            return known
        less = ", hold or drive less" if self.held or self._driven() else ""
        return f"correct lengths or axes{less}, or start nearer to a closed state"

    def _amount(self, row: int, missing: Array, digits: str, per: str = "") -> str:
        amount = f"{abs(missing[row]):{digits}}"
        if self.calls.coupling_of(row):
            return amount
        return f"{amount} {'rad' if self._turning[row] else 'm'}{per}"
