"""Points of a scene at given states: where they are, how they move, and how speeds move them.

Coordinates and speeds are taken as they are given, driven ones as well; laws, loads and gravity
are left out, so that no motion has to be determined.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from typing import Any

import numpy as np

from mstmm.arrays import Array, numbers
from mstmm.errors import NumericalFailure, SceneError
from mstmm.scene import split

from ..calls import Probe
from ..engine import Engine
from ..references import References
from ..shown import COLUMNS

#: Columns of a probe: velocity and angular velocity, acceleration and angular acceleration.
_MOVES = [*range(3, 6), *range(9, 12)]
_GAINS = [*range(6, 9), *range(12, 15)]
_TURNS = COLUMNS["angular_velocity"]

#: One body or end, or several.
Names = str | Sequence[str]


class Kinematics:
    """Calls on one packed scene.  Safe to make from several threads.

    Rows of states are arrays (n, nq), (n, nu), or the bytes of one.
    """

    def __init__(self, engine: Engine, references: References) -> None:
        self._engine, self._references = engine.inertia_alone, references
        self._known = dict[Names, tuple[Any, int]]()
        self._local = threading.local()
        self._still = np.zeros(engine.nu).tobytes()
        self._bends = bool(engine.packed.layout.modal)
        lib = engine.lib
        self._points, self._rows = lib.mstmm_moving_points, lib.mstmm_jacobians
        self._numbers, self._no_number = int(lib.MSTMM_PROBE_NUMBERS), int(lib.MSTMM_NO_NUMBER)

    def points(self, of: Names, n: int, q: Any, u: Any, udot: Any) -> Array:
        """(n, k, 24): motion of k bodies or ends, see `Observation`."""
        probes, count = self._probes(of)
        found = np.empty((n, count, self._numbers))
        given = (self._bytes(x) for x in (q, u, udot))
        self._call(self._points, n, *given, count, probes, self._engine.pointer(found))
        return found

    def still(self, of: Names, q: Array) -> Array:
        """`points` of n states at rest."""
        nothing = np.zeros((len(q), self._engine.nu))
        return self.points(of, len(q), q, nothing, nothing)

    def at_rest(self, of: Names, q: bytes) -> Array:
        """`points` of one state at rest."""
        return self.points(of, 1, q, self._still, self._still)

    def moving(self, of: Names, q: Array, u: Array) -> Array:
        """(n, k, 6): velocity and angular velocity, inertial axes."""
        return self.points(of, len(q), q, u, np.zeros(u.shape))[..., _MOVES]

    def jacobian(self, of: Names, q: Any) -> Array:
        """(k, 6, nu) of one state: what each speed adds to `moving`."""
        if self._bends:
            return self._by_units(of, q)
        probes, count = self._probes(of)
        found = np.empty((count, 6, self._engine.nu))
        self._call(self._rows, self._bytes(q), count, probes, self._engine.pointer(found))
        return found

    def _by_units(self, of: Names, q: Any) -> Array:
        """The same by one speed after the other, modes among them."""
        nu = self._engine.nu
        row = np.frombuffer(q) if isinstance(q, bytes) else q
        many, units = np.tile(row, (nu, 1)), np.eye(nu)
        return np.moveaxis(self.points(of, nu, many, units, np.zeros((nu, nu)))[..., _MOVES], 0, -1)

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
        own = self.points(of, 2 * nu, np.tile(q, (2 * nu, 1)), speeds, np.zeros((2 * nu, nu)))
        own = own[..., _GAINS]
        found = np.moveaxis(own[:nu] - own[nu:], 0, -1) / (4 * size)
        jacobian = self.jacobian(of, q)
        turns = (jacobian @ u)[:, 3:]
        found[:, 3:] += np.cross(turns[:, :, None], jacobian[:, 3:], axis=1) / 2
        return found if turning is None else found - jacobian @ turning / 2

    def _probes(self, of: Names) -> tuple[Any, int]:
        """Records of bodies and ends for C, kept; SceneError for one that there is not."""
        key = of if isinstance(of, str) else tuple(of)
        known = self._known.get(key)
        if known is None:
            names = [key] if isinstance(key, str) else key
            for name in names:
                if not isinstance(name, str):
                    raise SceneError(f"{name!r}: expected the name of a body or an end")
                if split(name)[0] != "ground" and name not in self._references:
                    raise SceneError(self._references.unknown(name))
            places = [Probe(*self._engine.packed.end(name)) for name in names]
            known = self._known[key] = self._engine.probes(places), len(places)
        return known

    def _bytes(self, rows: Any) -> Any:
        return rows if isinstance(rows, bytes) else self._engine.pointer(rows)

    def _call(self, function: Any, *given: Any) -> None:
        made = self._made()
        code = function(made.record, *given, made.failure)
        if code == self._no_number:  # of one state, which nobody has looked at
            numbers("q", np.frombuffer(next(x for x in given if isinstance(x, bytes))))
        if code:
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
        self.record = record = engine.ffi.new("mstmm_kinematics *")
        self.failure = engine.ffi.new("mstmm_failure *")
        arrays = engine.start_memory(), np.zeros(engine.nu), np.empty(engine.nu)
        self._pointed = [engine.pointer(array) for array in arrays]
        record.model, record.workspace = engine.packed.model, engine.workspace()
        record.memory, record.none, record.work = self._pointed
