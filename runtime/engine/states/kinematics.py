"""Points of a scene at given states: where they are, how they move, and how speeds move them.

Coordinates and speeds are taken as they are given, driven ones as well; laws, loads and gravity
are left out, so that no motion has to be determined.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from mstmm.arguments import texts_of
from mstmm.arrays import Array
from mstmm.errors import NumericalFailure

from ...kernels.fused import FusedLibrary
from ...kernels.prepared import Call, nothing, prepared
from ..calls import Probe
from ..code import Fusing
from ..engine import Engine
from ..references import References
from ..shown import COLUMNS
from .alone import small

#: Columns of a probe: velocity and angular velocity, acceleration and angular acceleration.
_MOVES = [*range(3, 6), *range(9, 12)]
_GAINS = [*range(6, 9), *range(12, 15)]
_TURNS = COLUMNS["angular_velocity"]

#: One body or end, or several.
Names = str | Sequence[str]


#: What a call of `Kinematics.call` reads, q or q and u, and what it answers of a point.
_SHAPES: dict[str, tuple[bool, tuple[int, ...]]] = {
    "places": (False, (3,)), "poses": (False, (4, 4)), "velocities": (True, (6,)),
    "jacobian": (False, (6,)), "jacobian_rate": (True, (6,)),
}  # fmt: skip

#: (by, row, column, value): increments turn by themselves, the rate of `row` by `column` being
#: value times the speed `by`.
Brackets = list[tuple[int, int, int, float]]


class Kinematics:
    """Calls on one packed scene.  Safe to make from several threads.

    Rows of states are arrays (n, nq), (n, nu).  `brackets` are those of the increments, None where
    they change with the state.  Code of the scene is looked for as bodies are asked for.
    """

    def __init__(
        self, engine: Engine, fusion: Fusing, references: References,
        brackets: Callable[[], Brackets | None],
    ) -> None:  # fmt: skip
        self._engine, self._fusion, self._references = engine.inertia_alone, fusion, references
        self._brackets, self._bends = brackets, bool(engine.packed.layout.modal)
        self._known = dict[Names, list[Probe]]()
        self._records = dict[Names, tuple[Any, int]]()
        self._calls = dict[tuple[str, Names], Call]()
        #: How often bodies or ends were asked for without code of the scene.
        self._asked = dict[Names, int]()
        self._local = threading.local()
        self._numbers = int(engine.lib.MSTMM_PROBE_NUMBERS)

    def call(self, kind: str, of: Names) -> Call:
        """The call on one state, q (nq,) or q and u (nu,), that answers "places", "poses",
        "velocities", "jacobian" or "jacobian_rate" of bodies or ends."""
        key = tuple(of) if type(of) is list else of
        try:
            found = self._calls.get((kind, key))
        except TypeError:  # no names: `texts_of` says what is wrong
            found = None
        if found is None:
            key = of if isinstance(of, str) else texts_of("of", of, "rod1.tip")
            found = self._calls.get((kind, key))
        if found is None or key in self._asked:
            found = self._sought(kind, key)
        return found

    def _sought(self, kind: str, key: Names) -> Call:
        """The same, where code is looked for at the first call and at those numbers that double."""
        asked = self._asked[key] = self._asked.get(key, 0) + 1
        found = self._calls.get((kind, key))
        if found is None or asked & (asked - 1) == 0:
            bodies = [probe.body for probe in self._probes_of(key)]
            loops = self._bends or min(bodies, default=-1) < 0 or bool(self._fusion.obstacle)
            codes = [] if loops else [self._fusion.ready_points(body, asked) for body in bodies]
            there = [one for one in codes if one is not None]
            complete = not loops and len(there) == len(bodies)
            if complete:  # what goes by loops so far is made anew
                for other in _SHAPES:
                    self._calls.pop((other, key), None)
            if complete or loops:
                self._asked.pop(key, None)
            found = self._calls[kind, key] = self._prepared(kind, key, there if complete else None)
        return found

    def each(self, kind: str, of: Names, general: Callable[..., Array], *states: Array) -> Array:
        """(n, k, 6, nu): "jacobian" or "jacobian_rate" at rows of states, by `call`, and by
        `general` (of, row, ...) where that leaves it to the general way."""
        call, count = self.call(kind, of), self._probes(of)[1]
        found = np.empty((len(states[0]), count, 6, self._engine.nu))
        for place, given in zip(found, zip(*states, strict=True), strict=True):
            answer = call(*given)
            place[:] = general(of, *given) if answer is None else answer
        return found

    def _prepared(self, kind: str, of: Names, codes: list[FusedLibrary] | None) -> Call:
        engine, (probes, count) = self._engine, self._probes(of)
        if codes is not None:
            fused = _Compiled(engine, self._fusion, self._probes_of(of), codes)
            return self._of_record(kind, of, "compiled_points", fused)
        by_speeds = kind.startswith("jacobian")
        brackets = self._brackets() if kind == "jacobian_rate" and not self._bends else []
        if brackets is None or not small(engine) or (by_speeds and self._bends):
            return nothing
        record = _Points(engine, self._room, probes, count, brackets)
        return self._of_record(kind, of, "points", record)

    def _of_record(self, kind: str, of: Names, functions: str, record: Any) -> Call:
        nq, nu = self._engine.nq, self._engine.nu
        moving, shape = _SHAPES[kind]
        several = () if isinstance(of, str) else (len(of),)
        return prepared(
            f"mstmm_{functions}_{kind}", record.record, (nq, nu)[: 1 + moving],
            (*several, *shape, *((nu,) if kind.startswith("jacobian") else ())), kept=record,
        )  # fmt: skip

    @cached_property
    def _room(self) -> Any:
        """A workspace that all of these calls use, of which one at a time runs."""
        return self._engine.pointer(np.zeros(self._engine.packed.workspace))

    def points(self, of: Names, q: Array, u: Array, udot: Array) -> Array:
        """(n, k, 24): motion of k bodies or ends, see `Observation`."""
        probes, count = self._probes(of)
        found = np.empty((len(q), count, self._numbers))
        given = (self._engine.pointer(x) for x in (q, u, udot))
        self._run("moving_points", len(q), *given, count, probes, self._engine.pointer(found))
        return found

    def still(self, of: Names, q: Array) -> Array:
        """`points` of n states at rest."""
        rest = np.zeros((len(q), self._engine.nu))
        return self.points(of, q, rest, rest)

    def moving(self, of: Names, q: Array, u: Array) -> Array:
        """(n, k, 6): velocity and angular velocity, inertial axes."""
        return self.points(of, q, u, np.zeros(u.shape))[..., _MOVES]

    def jacobian(self, of: Names, q: Array) -> Array:
        """(k, 6, nu) of one state: what each speed adds to `moving`."""
        if self._bends:
            return self._by_units(of, q)
        probes, count = self._probes(of)
        found = np.empty((count, 6, self._engine.nu))
        self._run("jacobians", self._engine.pointer(q), count, probes, self._engine.pointer(found))
        return found

    def _by_units(self, of: Names, q: Array) -> Array:
        """The same by one speed after the other, modes among them."""
        nu = self._engine.nu
        many, units = np.tile(q, (nu, 1)), np.eye(nu)
        return np.moveaxis(self.points(of, many, units, np.zeros((nu, nu)))[..., _MOVES], 0, -1)

    def jacobian_rate(self, of: Names, q: Array, u: Array, turning: Array | None) -> Array:
        """(k, 6, nu) of one state: the rate of `jacobian` along speeds u (nu,).

        The accelerations that speeds w bring by themselves are a square of w; half of its change
        along u is the part of J' that does not tell u from the column's own speed.  What does is
        the bracket of both: w x of the turns, and J times that of the speeds, -`turning` (nu, nu;
        None: zero), which is the rate of increments by themselves.
        """
        nu = self._engine.nu
        size = max(1.0, float(np.abs(u).max(initial=0.0)))
        steps = size * np.eye(nu)
        speeds = np.concatenate([u + steps, u - steps])
        own = self.points(of, np.tile(q, (2 * nu, 1)), speeds, np.zeros((2 * nu, nu)))
        own = own[..., _GAINS]
        found = np.moveaxis(own[:nu] - own[nu:], 0, -1) / (4 * size)
        jacobian = self.jacobian(of, q)
        turns = (jacobian @ u)[:, 3:]
        found[:, 3:] += np.cross(turns[:, :, None], jacobian[:, 3:], axis=1) / 2
        return found if turning is None else found - jacobian @ turning / 2

    def _probes(self, of: Names) -> tuple[Any, int]:
        """Records of bodies and ends for C, kept; SceneError for one that there is not."""
        key = of if isinstance(of, str) else tuple(of)
        known = self._records.get(key)
        if known is None:
            places = self._probes_of(of)
            known = self._records[key] = self._engine.probes(places), len(places)
        return known

    def _probes_of(self, of: Names) -> list[Probe]:
        key = of if isinstance(of, str) else texts_of("of", of, "rod1.tip")
        known = self._known.get(key)
        if known is None:
            names = [key] if isinstance(key, str) else key
            places = map(self._references.place, names)
            known = self._known[key] = [Probe(*self._engine.packed.end(one)) for one in places]
        return known

    def _run(self, function: str, *given: Any) -> None:
        made = self._made()
        run = getattr(self._engine.lib, f"mstmm_{function}")
        if run(made.record, *given, made.failure):
            raise NumericalFailure(self._engine.failure_text(made.failure, 0.0))

    def _made(self) -> _Record:
        """This thread's record."""
        made: _Record | None = getattr(self._local, "made", None)
        if made is None:
            made = self._local.made = _Record(self._engine)
        return made


class _Record:
    """What C works with, of one thread."""

    __slots__ = ("_pointed", "failure", "record")

    def __init__(self, engine: Engine) -> None:
        self.record = engine.ffi.new("mstmm_kinematics *")
        self.failure = engine.ffi.new("mstmm_failure *")
        self._pointed = _fill(self.record, engine, engine.workspace())


class _Compiled:
    """What C works with where there is code of the scene."""

    def __init__(
        self, engine: Engine, fusion: Fusing, probes: list[Probe], codes: list[FusedLibrary]
    ) -> None:
        ffi, pointer = engine.ffi, engine.pointer
        self.record = record = ffi.new("mstmm_compiled_points *")
        ends = np.array([[*probe.offset, *probe.axes] for probe in probes])
        arrays = ends.ravel(), np.array(fusion.numbers), engine.start_memory(), np.zeros(engine.nu)
        pointed = [pointer(array) for array in arrays]
        record.ends, record.p, record.memory, record.none = pointed
        libraries = ffi.new("mstmm_fused *[]", [ffi.cast("mstmm_fused *", one.descriptor)
                                                for one in codes])  # fmt: skip
        record.n_probes, record.codes = len(codes), libraries
        self._pointed = *pointed, libraries, codes


class _Points:
    """What C works with where the same bodies or ends are asked for again and again."""

    def __init__(
        self, engine: Engine, room: Any, probes: Any, count: int, brackets: Brackets
    ) -> None:
        nu, bodies = engine.nu, engine.packed.topology.count
        self.record = record = engine.ffi.new("mstmm_points *")
        pointed = [engine.pointer(np.empty(size)) for size in (nu, 6 * nu)]
        record.speeds, record.rows = pointed
        way = engine.ffi.from_buffer("int[]", np.empty(bodies, dtype=np.int32))
        turns = engine.ffi.new("mstmm_bracket[]", brackets)
        record.n_probes, record.probes, record.way = count, probes, way
        record.n_brackets, record.brackets = len(brackets), turns
        self._pointed = *pointed, probes, way, turns, *_fill(record.at, engine, room), room, engine


def _fill(record: Any, engine: Engine, workspace: Any) -> list[Any]:
    """Fill `mstmm_kinematics`; what it points to."""
    arrays = engine.start_memory(), np.zeros(engine.nu), np.empty(engine.nu)
    pointed = [engine.pointer(array) for array in arrays]
    record.model, record.workspace = engine.packed.model, workspace
    record.memory, record.none, record.work = pointed
    return pointed
