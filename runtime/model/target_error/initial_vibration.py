"""How far the fast motions of a scene are excited at its start.

The rates at the start, in parts of its motions: one of |lambda| and amplitude a, damped by zeta,
has fallen to what is asked after ln(a / asked) / zeta of its radians.  Implicit steps have to
follow it that long; explicit ones to the end, and more closely as long as its speed is above their
tolerance.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array, Integers
from mstmm.errors import NumericalFailure

from ...engine.eigenvalues import eigenvalues
from ...packing.qr_sweep import refuse_steps
from ...run.spectral_radius import fastest_at_start

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene

#: Coordinates and speeds together up to which all motions are looked at.
_FEW = 64

#: Motions of fewer radians over a run are those that are wanted.
_SLOW = 10.0

#: Motions are far above what is asked by so many times it; the power at which others count less.
_FAR, _EASES = 100.0, 0.7

#: Motions count as the fastest from this part of its rate on.
_AS_FAST = 0.5

#: Radians a step, from which on explicit steps do not follow a motion.
_LEFT = 2.0


@dataclass(frozen=True)
class Vibration:
    """Of a run from a start.

    Attributes:
        rate: |lambda| of the fastest motion, 1/s.
        span: time of the run, s.
        rates, dampings: |lambda| and damping ratio of every motion, (k,).
        parts, speeds: amplitudes (k,) of coordinates and of speeds in the size of their unit (rad
            and rad/s are 1).  Without entries where nothing is known but the rate.
    """

    rate: float
    span: float
    rates: Array
    dampings: Array
    parts: Array
    speeds: Array

    @property
    def known(self) -> bool:
        """Whether more is known than the rate."""
        return bool(len(self.rates))

    @property
    def fastest_damping(self) -> float:
        """Damping ratio of the fastest motions, the least of them."""
        return float(self._of_the_fastest(self.dampings).min(initial=1.0))

    def races(self, asked: float) -> bool:
        """Whether one of the fastest motions is far above what is asked."""
        return bool((self._of_the_fastest(self.parts) > _FAR * asked).any())

    def _of_the_fastest(self, numbers: Array) -> Array:
        return numbers[self.rates >= _AS_FAST * self.rate]

    def radians(self, asked: float) -> float:
        """Radians of the motion that takes most of them until none is above `asked`."""
        return self._until(self.parts, asked)

    def demanding(self, asked: float) -> float:
        """The same, of motions that are not far above `asked` less: their phase may err by more."""
        return self._until(
            self.parts, asked, np.minimum(self.parts / (_FAR * asked), 1.0) ** _EASES
        )

    def speeding(self, asked: float) -> float:
        """The same by speeds."""
        return self._until(self.speeds, asked)

    def outruns(self, steps: int) -> bool:
        """Whether so many steps over the run do not follow the fastest motion."""
        return self.rate * self.span > _LEFT * steps

    def left_behind(self, steps: int) -> float:
        """The largest amplitude of motions that so many steps over the run do not follow; 0 for
        none."""
        return float(self.parts[self.rates * self.span > _LEFT * steps].max(initial=0.0))

    def _until(self, sizes: Array, asked: float, weights: Array | float = 1.0) -> float:
        if not len(self.rates):
            return self.rate * self.span
        seen = sizes > asked
        whole = self.rates[seen] * self.span
        with np.errstate(divide="ignore"):
            lasting = np.log(sizes[seen] / asked) / self.dampings[seen]
        counted = np.minimum(lasting, whole) * np.broadcast_to(weights, sizes.shape)[seen]
        return float(counted.max(initial=0.0))


def initial_vibration(
    model: CompiledScene, t: float, q: Array, u: Array, span: float, few: float
) -> Vibration:
    """That of a run of `span` s from (nq,), (nu,); the rate alone of scenes of many components, and
    where that is up to `few` radians.

    Raises SceneError for scenes that implicit steps cannot follow, NumericalFailure where the start
    cannot be evaluated.
    """
    engine, none = model.looped, np.zeros(0)
    y, memory = np.concatenate([q, u]), engine.start_memory()
    if len(y) > _FEW:
        return Vibration(fastest_at_start(engine, t, q, u), span, none, none, none, none)
    refuse_steps(engine.packed)
    try:
        found, vectors = eigenvalues(engine, t, y, memory)
        rate = float(np.abs(found).max(initial=0.0))
        if rate * span <= few:
            return Vibration(rate, span, none, none, none, none)
        state = q[None].copy(), u[None].copy(), memory[None].copy()
        rates = np.hstack([x[0] for x in engine.accelerations(t, *state)])
        shares = np.linalg.lstsq(vectors, rates.astype(np.complex128), rcond=None)[0]
    except np.linalg.LinAlgError:
        raise NumericalFailure(f"the motions at t = {t:.9g} s are not finite") from None
    fast = np.abs(found) * span > _SLOW
    values, amplitudes = np.abs(found[fast]), np.abs(vectors[:, fast] * shares[fast])
    amplitudes /= values
    q_parts = _in_sizes(amplitudes[: len(q)], model.layout.q_by_unit)
    u_parts = _in_sizes(amplitudes[len(q) :], model.layout.u_by_unit)
    dampings = np.maximum(-found[fast].real, 0.0) / values
    return Vibration(rate, span, values, dampings, q_parts, u_parts)


def _in_sizes(amplitudes: Array, by_unit: dict[str, Integers]) -> Array:
    """(k,) largest amplitude of each motion, of units other than angles in the largest of all."""
    found = np.zeros(amplitudes.shape[1])
    for unit, places in by_unit.items():
        if len(places):
            own = amplitudes[places].max(axis=0)
            size = 1.0 if unit in ("rad", "rad/s") else float(own.max(initial=0.0)) or 1.0
            found = np.maximum(found, own / size)
    return found
