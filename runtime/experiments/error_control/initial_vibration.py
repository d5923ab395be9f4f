"""Excitation of the fast motions of a scene at its start.

The rates at the start are decomposed into eigenmotions.  One with eigenvalue lambda, amplitude a
and damping ratio zeta has decayed to the target error after ln(a / target) / zeta radians.
Implicit steps have to resolve it that long; explicit ones to the end, and more finely while its
speed is above their tolerance.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array, Integers
from mstmm.errors import NumericalFailure

from ...engine.jacobian import eigenvalues
from ...packing.scene_packing import reject_qr_steps
from ...run.spectral_radius import fastest_at_start
from ..tuning import ERROR_CONTROL as TUNING

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene


@dataclass(frozen=True)
class Vibration:
    """Fast motions of a run from a given start.

    Attributes:
        rate: |lambda| of the fastest motion, 1/s.
        span: time of the run, s.
        rates, dampings: |lambda| and damping ratio of every motion, (k,).
        position_amplitudes, speed_amplitudes: amplitudes (k,) of coordinates and of speeds relative
            to the size of their unit (1 for rad and rad/s).  Empty if only the rate is known.
    """

    rate: float
    span: float
    rates: Array
    dampings: Array
    position_amplitudes: Array
    speed_amplitudes: Array

    @property
    def has_motions(self) -> bool:
        """Whether more than the rate is known."""
        return bool(len(self.rates))

    @property
    def fastest_damping(self) -> float:
        """Smallest damping ratio of the fastest motions."""
        return float(self._fastest_values(self.dampings).min(initial=1.0))

    def races(self, target: float) -> bool:
        """Whether the amplitude of a fastest motion is far above the target error."""
        amplitudes = self._fastest_values(self.position_amplitudes)
        return bool((amplitudes > TUNING.far_above * target).any())

    def _fastest_values(self, numbers: Array) -> Array:
        return numbers[self.rates >= TUNING.fast_share * self.rate]

    def radians(self, target: float) -> float:
        """Largest number of radians until the amplitude of a motion is below `target`."""
        return self._radians_above(self.position_amplitudes, target)

    def demanding_radians(self, target: float) -> float:
        """`radians`, weighted less for motions not far above `target`, whose phase may err more."""
        relative = np.minimum(self.position_amplitudes / (TUNING.far_above * target), 1.0)
        weights = relative**TUNING.weight_power
        return self._radians_above(self.position_amplitudes, target, weights)

    def radians_above_speed(self, target: float) -> float:
        """`radians` until the speed of a motion is below `target`."""
        return self._radians_above(self.speed_amplitudes, target)

    def outruns(self, steps: int) -> bool:
        """Whether so many steps over the run do not resolve the fastest motion."""
        return self.rate * self.span > TUNING.unresolved_step * steps

    def unresolved_amplitude(self, steps: int) -> float:
        """Largest amplitude of motions that so many steps do not resolve; 0 for none."""
        return float(
            self.position_amplitudes[self.rates * self.span > TUNING.unresolved_step * steps].max(
                initial=0.0
            )
        )

    def _radians_above(
        self, amplitudes: Array, target: float, weights: Array | float = 1.0
    ) -> float:
        if not len(self.rates):
            return self.rate * self.span
        is_above = amplitudes > target
        total = self.rates[is_above] * self.span
        with np.errstate(divide="ignore"):
            decay = np.log(amplitudes[is_above] / target) / self.dampings[is_above]
        weighted = np.minimum(decay, total) * np.broadcast_to(weights, amplitudes.shape)[is_above]
        return float(weighted.max(initial=0.0))


def initial_vibration(
    model: CompiledScene, t: float, q: Array, u: Array, span: float, few: float
) -> Vibration:
    """Fast motions of a run of `span` (s) from q (nq,), u (nu,) at t (s).

    Only the rate for scenes with many coordinates, and if it amounts to at most `few` radians.
    Raises SceneError for scenes without implicit steps, NumericalFailure if the start cannot be
    evaluated.
    """
    engine, empty = model.looped, np.zeros(0)
    y, memory = np.concatenate([q, u]), engine.start_memory()
    if len(y) > TUNING.max_coordinates:
        return Vibration(fastest_at_start(engine, t, q, u), span, empty, empty, empty, empty)
    reject_qr_steps(engine.packed)
    try:
        roots, vectors = eigenvalues(engine, t, y, memory)
        rate = float(np.abs(roots).max(initial=0.0))
        if rate * span <= few:
            return Vibration(rate, span, empty, empty, empty, empty)
        state = q[None].copy(), u[None].copy(), memory[None].copy()
        rates = np.hstack([x[0] for x in engine.accelerations(t, *state)])
        participations = np.linalg.lstsq(vectors, rates.astype(np.complex128), rcond=None)[0]
    except np.linalg.LinAlgError:
        raise NumericalFailure(f"the motions at t = {t:.9g} s are not finite") from None
    fast = np.abs(roots) * span > TUNING.slow_radians
    fast_rates, amplitudes = (np.abs(roots[fast]), np.abs(vectors[:, fast] * participations[fast]))
    amplitudes /= fast_rates
    q_parts = _relative_amplitudes(amplitudes[: len(q)], model.coordinate_layout.q_by_unit)
    u_parts = _relative_amplitudes(amplitudes[len(q) :], model.coordinate_layout.u_by_unit)
    dampings = np.maximum(-roots[fast].real, 0.0) / fast_rates
    return Vibration(rate, span, fast_rates, dampings, q_parts, u_parts)


def _relative_amplitudes(amplitudes: Array, by_unit: dict[str, Integers]) -> Array:
    """Largest amplitude (k,) of each motion; other units than angles relative to their largest."""
    relative = np.zeros(amplitudes.shape[1])
    for unit, places in by_unit.items():
        if len(places):
            largest = amplitudes[places].max(axis=0)
            scale = 1.0 if unit in ("rad", "rad/s") else float(largest.max(initial=0.0)) or 1.0
            relative = np.maximum(relative, largest / scale)
    return relative


# --- beam on one hinge ----------------------------------------------------------------------------


def starts_vibrating(model: CompiledScene, t: float, q: Array, u: Array) -> bool:
    """Whether a scene is a vibrating beam on one hinge at q (nq,), u (nu,) and t (s).

    Its motion is vibration about a slowly varying one, which an exponential method integrates with
    few steps.  With more hinges the vibrations change with their angles; without excitation the
    beam does not vibrate.

    Raises NumericalFailure if the start cannot be evaluated.
    """
    engine = model.looped
    shapes = np.zeros(engine.nu, bool)
    for body in model.coordinate_layout.modal.values():
        shapes[body.u_slice] = True
    is_small = engine.nu <= TUNING.max_beam_speeds
    if not is_small or not shapes.any() or np.count_nonzero(~shapes) > TUNING.max_rigid_speeds:
        return False
    state = q[None].copy(), u[None].copy(), engine.start_memory()[None]
    accelerations = np.abs(engine.accelerations(t, *state)[1][0])
    threshold = TUNING.excitation_share * accelerations.max()
    return bool(u[shapes].any() or accelerations[shapes].max() > threshold)
