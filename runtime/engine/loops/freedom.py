"""Independent speeds of closed loops, and the speeds that they determine.

Random speeds, each projected on the constraints by one correction, span the motions of a mechanism.
Independent speeds v are chosen that distinguish these motions, preferably the first in the scene,
and u = N v: N is 1 in the rows of v, and no row has a velocity error.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import NumericalFailure

from ...pack.loops.variants import undriven
from ...pack.pack import packed_system
from ..engine import Engine
from .closed import Closed
from .rank import judging

#: Motions that are rounding compared with others, in characteristic scales of the speeds.
_ROUNDING = 1e-9
#: A speed is chosen if no other one distinguishes motions better by more than this factor.
_WELL = 4.0
#: A requested speed is chosen if no other one is better by more than this factor.
_BARELY = 1e4
#: Position gaps (m, rad) above which loops are open.
_OPEN = 1e-6
#: Speeds determine no others if these would be more than this many times larger.
_MOST = 1e8


class Freedom:
    """Independent speeds and motions of one packed scene with closed loops.

    `free` are the indices of the speeds that are not prescribed, `sizes` (nu,) the characteristic
    scales of the speeds.
    """

    def __init__(self, engine: Engine, free: Sequence[int], sizes: Array, closed: Closed) -> None:
        packed, self._start = engine.packed, closed.start[0]
        still = Engine(packed_system(undriven(packed.system), packed))
        self._calls = judging(still, self._start)
        self._free, self.sizes = np.array(free, dtype=np.int64), sizes
        self._loops = closed.loops

    @cached_property
    def places(self) -> tuple[int, ...]:
        """Indices of the independent speeds, which are chosen at the start."""
        return self.chosen(self._start)

    def chosen(self, q: Array) -> tuple[int, ...]:
        """Choose the indices of speeds that determine all others at q (nq,).

        Each is the first in the scene that distinguishes the remaining motions, in characteristic
        scales, at least a quarter as well as any other.
        """
        left = self._motions(q) / self.sizes[:, None]
        return tuple(sorted(read_off(left, self._free.tolist(), _WELL)[0]))

    def settling(
        self, q: Array, shapes: Sequence[int], kept: Sequence[int], wished: Sequence[int]
    ) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Choose speeds that fix a mechanism at q while `shapes` settle.

        Returns the indices of the fixed speeds, and of the shapes that then determine all others.
        Fixed are `kept`, as far as they can move, and the first speeds that distinguish the motions
        without change of shape, preferably those in `wished`.
        """
        left = self._motions(q) / self.sizes[:, None]
        held, left = read_off(left, kept, _BARELY)
        _, lengths, ways = np.linalg.svd(left[list(shapes)])
        changing = int((lengths > 1 / _BARELY).sum())
        others = [k for k in self._free.tolist() if k not in {*shapes, *kept, *wished}]
        more, _ = read_off(left @ ways[changing:].T, [*wished, *others], _WELL)
        for place in more:
            left = _without(left, place)
        return (*held, *more), tuple(sorted(read_off(left, shapes, _WELL)[0]))

    def following(self, q: Array, places: Sequence[int]) -> Array:
        """Matrix N (nu, n): all speeds for a unit of each of some independent ones.

        Raises NumericalFailure if these do not determine the others, as at a dead centre, and in
        singular poses.
        """
        found, own = self._motions(q), list(places)
        scaled = found[own] / self.sizes[own, None]
        rows, ways = scaled.shape
        branches = self._loops.singular and ways == self._loops.mobility
        if rows == ways and not branches and (not ways or np.linalg.cond(scaled) < _MOST):
            return np.asarray(found @ np.linalg.inv(found[own]))
        self._refuse_open(q)
        names = ", ".join(self._calls.engine.packed.layout.u_name(k) for k in own)
        raise NumericalFailure(
            f"the loops leave {ways} motions here, which {names or 'no speed'} cannot distinguish: "
            "a dead centre or a singular pose; use a state near it"
        )

    def _refuse_open(self, q: Array) -> None:
        gaps = np.abs(self._calls.correction(self._calls.gap, q, np.zeros(len(self.sizes)))[1])
        row = int(gaps.argmax())
        if gaps[row] > _OPEN:
            raise NumericalFailure(
                f"the loop that {self._calls.closing(row)} closes is open by {gaps[row]:.3g} at "
                "this q; use that of model.assemble(q)"
            )

    def driving(self, q: Array, speed: int) -> Array:
        """All speeds (nu,) for a unit of one prescribed speed with the other prescribed ones zero.

        nan if the loops do not permit that motion.
        """
        moved = self._allowed(q, np.eye(1, len(self.sizes), speed)[0])
        slips = self._slips(q, moved)[1]
        return moved if np.abs(slips).max(initial=0.0) < _ROUNDING else np.full_like(moved, np.nan)

    def moved(self, q: Array, speeds: Array) -> Array:
        """Move q (nq,) slightly along speeds (nu,); loops are closed to first order."""
        return self._calls.moved(q, speeds)

    @property
    def free(self) -> list[int]:
        """Indices of the speeds that are not prescribed."""
        return list(map(int, self._free))

    @cached_property
    def rows_of_speeds(self) -> frozenset[int]:
        """Rows that constrain speeds but no positions: of rolling discs, couplings of speeds."""
        records = self._calls.records
        asked = {one.frame: one.of_speeds for one in self._calls.engine.packed.system.closures}
        found = {
            row for one in records.closures for direction, row in one.rows.items()
            if direction in asked[one.frame]
        }  # fmt: skip
        return frozenset(found | {x.row for x in records.couplings if x.coupling.of_speeds})

    def without_slip(self, q: Array, u: Array) -> Array:
        """Nearest speeds to u (nu,) that satisfy all rows; prescribed speeds are unchanged."""
        return np.asarray(u + self._calls.correction(self._calls.slip, q, u)[0])

    def slip(self, q: Array, u: Array) -> Array:
        """Velocity errors (rows,): J(q) u up to its sign."""
        return self._slips(q, u)[1]

    def _motions(self, q: Array) -> Array:
        """Basis (nu, n) of the motions at q, orthonormal in characteristic scales."""
        count = min(len(self._free), self._loops.mobility + 1)  # one more shows at a singular pose
        draw = np.random.default_rng(0)
        trials = np.zeros((count, len(self.sizes)))
        trials[:, self._free] = draw.standard_normal((count, len(self._free)))
        columns = [self._allowed(q, trial * self.sizes) for trial in trials]
        scaled = np.reshape(columns, trials.shape).T / self.sizes[:, None]
        left, lengths, _ = np.linalg.svd(scaled, full_matrices=False)
        kept = lengths > _ROUNDING * lengths.max(initial=1.0)
        return np.asarray(left[:, kept] * self.sizes[:, None])

    def _allowed(self, q: Array, speeds: Array) -> Array:
        """Speeds (nu,) projected on the constraints."""
        return speeds + self._slips(q, speeds)[0]

    def _slips(self, q: Array, speeds: Array) -> tuple[Array, Array]:
        """Correction (nu,) of speeds and their velocity errors (rows,), without those at rest.

        At rest the velocity errors are those of couplings that depend on time.
        """
        correction, slips = self._calls.correction(self._calls.slip, q, speeds)
        still, asked = self._calls.correction(self._calls.slip, q, np.zeros_like(speeds))
        return correction - still, slips - asked


def read_off(left: Array, places: Sequence[int], well: float = _WELL) -> tuple[list[int], Array]:
    """Choose rows that distinguish motions (nu, n), orthonormal in characteristic scales.

    Each is the first of `places` that distinguishes the remaining motions well enough.  Also
    returns the motions in which none of the chosen rows moves.
    """
    own, found = list(places), list[int]()
    for _ in range(left.shape[1]):
        lengths = np.linalg.norm(left[own], axis=1)
        if not lengths.max(initial=0.0) > 1 / _BARELY:
            break
        found.append(own[int(np.argmax(well * lengths >= lengths.max()))])
        left = _without(left, found[-1])
    return found, left


def _without(left: Array, place: int) -> Array:
    """Motions (nu, n) without their part that moves one speed."""
    along = left[place] / np.linalg.norm(left[place])
    return np.asarray(left - np.outer(left @ along, along))
