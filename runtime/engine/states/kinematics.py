"""Points of a scene at given states: positions, motion, and Jacobians.

Given coordinates and speeds are used unchanged, driven ones too; laws, loads and gravity are
omitted, so that no acceleration has to be determined.
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

#: Name of one body or end, or several names.
Names = str | Sequence[str]


#: Kind of a call of `Kinematics.call` -> whether it needs u besides q, and its result for a point.
_SHAPES: dict[str, tuple[bool, tuple[int, ...]]] = {
    "places": (False, (3,)), "poses": (False, (4, 4)), "velocities": (True, (6,)),
    "jacobian": (False, (6,)), "jacobian_rate": (True, (6,)),
}  # fmt: skip

#: Entries (by, row, column, value) of the rotation of increments: the rate of `row` due to `column`
#: is value times the speed `by`.
Brackets = list[tuple[int, int, int, float]]


class Kinematics:
    """Kinematic calls on one packed scene.  Safe to call from several threads.

    Rows of states are arrays (n, nq), (n, nu).  `brackets` returns those of the increments, None if
    they depend on the state.  Code of the scene is looked for when bodies are requested.
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
        #: Number of requests of bodies or ends without code of the scene.
        self._asked = dict[Names, int]()
        self._local = threading.local()
        self._numbers = int(engine.lib.MSTMM_PROBE_NUMBERS)

    def call(self, kind: str, of: Names) -> Call:
        """Prepared call on one state, q (nq,) or q and u (nu,), for bodies or ends.

        `kind` is "places", "poses", "velocities", "jacobian" or "jacobian_rate".
        """
        key = tuple(of) if type(of) is list else of
        try:
            found = self._calls.get((kind, key))
        except TypeError:  # no names: `texts_of` raises the error
            found = None
        if found is None:
            key = of if isinstance(of, str) else texts_of("of", of, "rod1.tip")
            found = self._calls.get((kind, key))
        if found is None or key in self._asked:
            found = self._sought(kind, key)
        return found

    def _sought(self, kind: str, key: Names) -> Call:
        """Prepared call after a search for code at call numbers 1, 2, 4, 8, ..."""
        asked = self._asked[key] = self._asked.get(key, 0) + 1
        found = self._calls.get((kind, key))
        if found is None or asked & (asked - 1) == 0:
            bodies = [probe.body for probe in self._probes_of(key)]
            loops = self._bends or min(bodies, default=-1) < 0 or bool(self._fusion.obstacle)
            codes = [] if loops else [self._fusion.ready_points(body, asked) for body in bodies]
            there = [one for one in codes if one is not None]
            complete = not loops and len(there) == len(bodies)
            if complete:  # prepare the calls that used loops again
                for other in _SHAPES:
                    self._calls.pop((other, key), None)
            if complete or loops:
                self._asked.pop(key, None)
            found = self._calls[kind, key] = self._prepared(kind, key, there if complete else None)
        return found

    def each(self, kind: str, of: Names, general: Callable[..., Array], *states: Array) -> Array:
        """Evaluate "jacobian" or "jacobian_rate" (n, k, 6, nu) at rows of states.

        The prepared call is used, or `general(of, row, ...)` where it returns None.
        """
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
        """Workspace shared by all of these calls, of which one runs at a time."""
        return self._engine.pointer(np.zeros(self._engine.packed.workspace))

    def points(self, of: Names, q: Array, u: Array, udot: Array) -> Array:
        """Motion (n, k, 24) of k bodies or ends, see `Observation`."""
        probes, count = self._probes(of)
        found = np.empty((len(q), count, self._numbers))
        given = (self._engine.pointer(x) for x in (q, u, udot))
        self._run("moving_points", len(q), *given, count, probes, self._engine.pointer(found))
        return found

    def still(self, of: Names, q: Array) -> Array:
        """Result of `points` for n states at rest."""
        rest = np.zeros((len(q), self._engine.nu))
        return self.points(of, q, rest, rest)

    def moving(self, of: Names, q: Array, u: Array) -> Array:
        """Velocity and angular velocity (n, k, 6) in inertial axes."""
        return self.points(of, q, u, np.zeros(u.shape))[..., _MOVES]

    def jacobian(self, of: Names, q: Array) -> Array:
        """Jacobian (k, 6, nu) of one state: derivative of `moving` with respect to speeds."""
        if self._bends:
            return self._by_units(of, q)
        probes, count = self._probes(of)
        found = np.empty((count, 6, self._engine.nu))
        self._run("jacobians", self._engine.pointer(q), count, probes, self._engine.pointer(found))
        return found

    def _by_units(self, of: Names, q: Array) -> Array:
        """Jacobian (k, 6, nu) from unit speeds, rates of modes included."""
        nu = self._engine.nu
        many, units = np.tile(q, (nu, 1)), np.eye(nu)
        return np.moveaxis(self.points(of, many, units, np.zeros((nu, nu)))[..., _MOVES], 0, -1)

    def jacobian_rate(self, of: Names, q: Array, u: Array, turning: Array | None) -> Array:
        """Rate (k, 6, nu) of `jacobian` along speeds u (nu,), at one state.

        Accelerations at udot = 0 are quadratic in the speeds w; half of their change along u is the
        part of J' that is symmetric in u and the column's speed.  The antisymmetric part is the
        bracket of both: w x of the rotations, and J times that of the speeds, -`turning` (nu, nu;
        None: zero), which is the rate of the increments.
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
        """C records of bodies and ends, cached; SceneError for an unknown name."""
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
        """Record of this thread."""
        made: _Record | None = getattr(self._local, "made", None)
        if made is None:
            made = self._local.made = _Record(self._engine)
        return made


class _Record:
    """C record of the general calls of one thread."""

    __slots__ = ("_pointed", "failure", "record")

    def __init__(self, engine: Engine) -> None:
        self.record = engine.ffi.new("mstmm_kinematics *")
        self.failure = engine.ffi.new("mstmm_failure *")
        self._pointed = _fill(self.record, engine, engine.workspace())


class _Compiled:
    """C record of prepared calls with code of the scene."""

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
    """C record of prepared calls of the looped engine for fixed bodies or ends."""

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
    """Fill `mstmm_kinematics`; returns the memory to which it points."""
    arrays = engine.start_memory(), np.zeros(engine.nu), np.empty(engine.nu)
    pointed = [engine.pointer(array) for array in arrays]
    record.model, record.workspace = engine.packed.model, workspace
    record.memory, record.none, record.work = pointed
    return pointed
