"""Error measures that several cases use."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from typing import Any

import numpy as np

from ..arrays import Array
from ..bridge.precise import precise, relative_error
from ..errors import NumericalFailure
from ..runtime.flexible.beam.harmonic import Direction
from ..runtime.flexible.beam.shapes import root
from ..runtime.model.model import Model
from ..runtime.result.result import Result
from .scenes import LET_GO, solid_bar, spinning_top, sprung_rod, stiffness_of_rate

#: Step of the vibrations of a sprung rod, s.
STEP = 1e-3

#: Duration of a free rotation, s, and the angular velocity at its start, rad/s.
TURNING, SPIN = 2.0, (0.4, 1.6, 1.1)


def finished(run: Result) -> Result:
    """Return a run that reached its end; otherwise raise NumericalFailure with its message."""
    if not run.success:
        raise NumericalFailure(run.message)
    return run


def simulated(model: Model, *args: Any, **options: Any) -> Result:
    """Simulate to the end.  Raises NumericalFailure if the run stops before."""
    return finished(model.simulate(*args, **options))


def correction(
    model: Model,
    states: Iterable[tuple[Array, Array]],
    accelerations: Callable[[Array, Array], Array] | None = None,
) -> float:
    """Largest relative error of accelerations over states (q, u), by iterative refinement.

    It is the correction by one step of refinement over the largest acceleration, equal to the error
    in its leading digits.  The accelerations are those of the model, or of a function of (q, u).
    Their residual comes from inverse dynamics, which eliminates nothing, and is solved for by the
    Riccati sweep (Higham, Accuracy and Stability of Numerical Algorithms, 2002, ch. 12).
    """
    worst = 0.0
    for q, u in states:
        udot = (accelerations or model.accelerations)(q, u)
        change = model.solve(q, model.inverse_dynamics(q, u, udot))
        worst = max(worst, float(np.abs(change).max() / np.abs(udot - change).max()))
    return worst


def rounding(model: Model, states: Iterable[tuple[Array, Array]]) -> float:
    """Largest relative error of the accelerations over states (q, u), against 60 digits."""
    exact = precise(model)
    return max(relative_error(model.accelerations(q, u), exact(q, u)) for q, u in states)


def growth(model: Model, step: float, steps: int, method: str, **options: Any) -> float:
    """Largest coordinate over `steps` fixed steps (s), relative to the largest at the start."""
    times = np.arange(steps + 1) * step
    run = simulated(model, times[-1], method, step, output_times=times, **options)
    return float(np.abs(run.q).max() / np.abs(run.q[0]).max())


def energy_gain(run: Result, exchanged: float) -> float:
    """Energy exchanged (J) plus the spurious gain, relative to the former: 1 without a gain."""
    energy = np.asarray(run.energy())
    return 1 + float((energy - energy[0]).max()) / exchanged


def amplitude(rate: float, steps: int, method: str, **options: Any) -> Array:
    """Amplitude of a sprung rod's vibration after each step, relative to the start.

    It combines the angle and the speed over the frequency.  `rate` is the step times the angular
    frequency.
    """
    run_rate = rate / STEP
    times = np.arange(steps + 1) * STEP
    rod = sprung_rod(stiffness_of_rate(run_rate))
    run = simulated(
        rod, times[-1], method, STEP, rtol=1e-10, atol=1e-14, output_times=times, **options
    )
    return np.hypot(run.q[:, 0], run.u[:, 0] / run_rate) / LET_GO


def bending_error(
    slenderness: float, divisions: Sequence[int], order: int, poisson: float
) -> float:
    """Relative error of the first frequency of a bar of solid elements, against a slender beam.

    The arguments are those of `solid_bar`.
    """
    found = solid_bar(slenderness, divisions, order, poisson).modes(1).omega[0]
    slender = root("clamped-free", 1) ** 2 / (slenderness * math.sqrt(12))
    return abs(float(found) / slender - 1)


def root_inertia(z: float) -> float:
    """Inertia at the root of a vibrating beam of length and stiffness 1 at beta L = z.

    It is computed as in runs.
    """
    beam = Direction(True, 1.0, 0.0, 1.0, np.eye(4))
    s, softened = np.array([1j * z**2]), np.ones(1, dtype=np.complex128)
    return float(-beam.stiffness_at(s, softened)[0, 0, 0].real / z**4)


def error_of_turning(method: str | Callable[[Model, float, int], Array], step: float) -> float:
    """Error of the attitude (rad) of a freely rotating body, with steps of about `step` (s).

    `method` is a method of runs, or a function of the model, the step and the number of steps.
    """
    (top, exact), steps = _turned(), round(TURNING / step)
    step = TURNING / steps
    if callable(method):
        found = method(top, step, steps)
    else:
        found = simulated(top, TURNING, method, step, output_times=[TURNING]).q[-1]
    return 2 * float(np.linalg.norm(found * np.sign(found @ exact) - exact))


@cache
def _turned() -> tuple[Model, Array]:
    """Freely rotating body, and its exact attitude at the end."""
    top = spinning_top("ball", SPIN)
    run = simulated(top, TURNING, rtol=1e-13, atol=1e-15, output_times=[TURNING])
    return top, run.q[-1]
