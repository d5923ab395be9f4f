"""Error measures and steps that several cases use."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from typing import Any

import numpy as np

from ..array_validation import Array
from ..errors import NumericalFailure
from ..pipeline.extended_precision import extended_precision_accelerations, relative_error
from ..runtime.flexible.beam.dynamic_stiffness import Direction
from ..runtime.flexible.beam.shape_functions import wave_number
from ..runtime.integrate.methods import Method
from ..runtime.model.model import Model
from ..runtime.result.result import Result
from .shared_scenes import (
    RELEASE_ANGLE,
    rod_with_spring,
    solid_bar,
    spinning_top,
    stiffness_for_frequency,
)

#: Step of the vibrations of a sprung rod, s.
STEP = 1e-3

#: Duration of a free rotation, s, and the angular velocity at its start, rad/s.
ROTATION_TIME, SPIN = 2.0, (0.4, 1.6, 1.1)


def require_finished(run: Result) -> Result:
    """Return a run that reached its end; otherwise raise NumericalFailure with its message."""
    if not run.success:
        raise NumericalFailure(run.message)
    return run


def simulate_to_end(model: Model, *args: Any, **options: Any) -> Result:
    """Simulate to the end.  Raises NumericalFailure if the run stops before."""
    return require_finished(model.simulate(*args, **options))


def refinement_correction(
    model: Model,
    states: Iterable[tuple[Array, Array]],
    accelerations: Callable[[Array, Array], Array] | None = None,
) -> float:
    """Largest relative error of accelerations over states (q, u), by iterative refinement.

    The error is that of one step of refinement: the change of the accelerations over the largest
    acceleration, right in its leading digits.  The accelerations are those of the model, or of a
    function of (q, u).  Their residual comes from inverse dynamics, which needs no elimination; the
    Riccati sweep solves for the change (Higham, Accuracy and Stability of Numerical Algorithms,
    2002, ch. 12).
    """
    largest = 0.0
    for q, u in states:
        udot = (accelerations or model.accelerations)(q, u)
        udot_change = model.solve(q, model.inverse_dynamics(q, u, udot))
        largest = max(largest, float(np.abs(udot_change).max() / np.abs(udot - udot_change).max()))
    return largest


def rounding_error(model: Model, states: Iterable[tuple[Array, Array]]) -> float:
    """Largest relative error of the accelerations over states (q, u), against 60 digits."""
    exact = extended_precision_accelerations(model)
    return max(relative_error(model.accelerations(q, u), exact(q, u)) for q, u in states)


def relative_growth(model: Model, step: float, steps: int, method: str | Method) -> float:
    """Largest coordinate over `steps` fixed steps (s), relative to the largest at the start."""
    times = np.arange(steps + 1) * step
    run = simulate_to_end(model, times[-1], method, step, output_times=times)
    return float(np.abs(run.q).max() / np.abs(run.q[0]).max())


def energy_gain(run: Result, exchanged: float) -> float:
    """Energy exchanged (J) plus the spurious gain, relative to the former: 1 without a gain."""
    energy = np.asarray(run.energy())
    return 1 + float((energy - energy[0]).max()) / exchanged


def relative_amplitudes(rate: float, steps: int, method: str) -> Array:
    """Amplitude of a sprung rod's vibration after each step, relative to the start.

    It combines the angle and the speed over the frequency.  `rate` is the step times the angular
    frequency.
    """
    frequency = rate / STEP
    times = np.arange(steps + 1) * STEP
    rod = rod_with_spring(stiffness_for_frequency(frequency))
    run = simulate_to_end(rod, times[-1], method, STEP, rtol=1e-10, atol=1e-14, output_times=times)
    return np.hypot(run.q[:, 0], run.u[:, 0] / frequency) / RELEASE_ANGLE


def bending_error(
    slenderness: float, divisions: Sequence[int], order: int, poisson: float
) -> float:
    """Relative error of the first frequency of a bar of solid elements, against a slender beam.

    The arguments are those of `solid_bar`.
    """
    frequency = solid_bar(slenderness, divisions, order, poisson).modes(1).omega[0]
    beam_frequency = wave_number("clamped-free", 1) ** 2 / (slenderness * math.sqrt(12))
    return abs(float(frequency) / beam_frequency - 1)


def root_inertia(z: float) -> float:
    """Inertia at the root of a vibrating beam of length and stiffness 1 at beta L = z.

    It is computed with the dynamic stiffness that harmonic analyses use.
    """
    beam = Direction(True, 1.0, 0.0, 1.0, np.eye(4))
    s, stiffness_factor = np.array([1j * z**2]), np.ones(1, dtype=np.complex128)
    return float(-beam.stiffness_at(s, stiffness_factor)[0, 0, 0].real / z**4)


def attitude_error(method: str | Callable[[Model, float, int], Array], step: float) -> float:
    """Error of the attitude (rad) of a freely rotating body, with steps of about `step` (s).

    `method` is a method of runs, or a function of the model, the step and the number of steps.
    """
    (body, exact), steps = _rotating_body(), round(ROTATION_TIME / step)
    step = ROTATION_TIME / steps
    if callable(method):
        attitude = method(body, step, steps)
    else:
        attitude = simulate_to_end(
            body, ROTATION_TIME, method, step, output_times=[ROTATION_TIME]
        ).q[-1]
    return 2 * float(np.linalg.norm(attitude * np.sign(attitude @ exact) - exact))


@cache
def _rotating_body() -> tuple[Model, Array]:
    """Freely rotating body, and its exact attitude at the end."""
    body = spinning_top("ball", SPIN)
    run = simulate_to_end(body, ROTATION_TIME, rtol=1e-13, atol=1e-15, output_times=[ROTATION_TIME])
    return body, run.q[-1]


def rk4_step(slope: Callable[[Array], Array], y: Array, step: float) -> Array:
    """State y after one step (s) of y' = slope(y)."""
    first = slope(y)
    second = slope(y + step / 2 * first)
    third = slope(y + step / 2 * second)
    return y + step / 6 * (first + 2 * second + 2 * third + slope(y + step * third))
