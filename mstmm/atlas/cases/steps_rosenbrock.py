"""Cases of Rosenbrock steps without the safeguards of a run."""

from __future__ import annotations

import math

import numpy as np

from ...array_validation import Array
from ...errors import NumericalFailure
from ...runtime.engine.tangent_matrix import TangentMatrix
from ...runtime.integrate.steppers import get
from ...runtime.integrate.steppers.implicit_methods import Rosenbrock, make_rosenbrock
from ...runtime.model.model import Model
from ..case_definition import LOG_SCALE, CaseDefinition, MethodDefinition
from ..error_measures import STEP as VIBRATION_STEP
from ..error_measures import relative_amplitudes, simulate_to_end
from ..shared_scenes import (
    RELEASE_ANGLE,
    double_pendulum,
    elbow_with_spring,
    rod_with_spring,
    sliding_mass,
    stiffness_for_frequency,
)

# --- bare rosenbrock ------------------------------------------------------------------------------
#
# Rosenbrock steps without the safeguards of a run.
#
# Their stages are those of a run: its residual and tangent, accelerations as unknowns. The table
# may be one that runs do not offer. The time derivative of the equations (Hairer, Wanner, Solving
# Ordinary Differential Equations II, 1996, IV.7), and the accelerations of the start, may be left
# out. Errors are measured by the usual norm (IV.8), which weights errors of speeds separately, not
# by the displacement within the step.

#: Safety factor of the step size, and limits of its change.
_SAFETY_FACTOR, _MIN_STEP_FACTOR, _MAX_STEP_FACTOR = 0.9, 0.2, 6.0


class BareRosenbrock:
    """Rosenbrock steps on states (3, n): coordinates, speeds (their rates), accelerations."""

    def __init__(
        self,
        model: Model,
        method: str | Rosenbrock,
        time_slope: bool = True,
        accelerations: Array | None = None,
    ) -> None:
        table = get(method) if isinstance(method, str) else method
        assert isinstance(table, Rosenbrock) and table.E is not None
        self._table, self._estimate = table, table.E[:-1]
        self._base, self._stage = TangentMatrix(model.looped), TangentMatrix(model.looped)
        self._time_coefficients = table.d if time_slope else np.zeros_like(table.d)
        q, u = model.initial_state()
        udot = model.accelerations(q, u) if accelerations is None else accelerations
        self._start = np.array([q, u, udot])

    def fixed_step_states(self, step: float, steps: int) -> Array:
        """States (steps + 1, 3, n) with a fixed step (s)."""
        states = [self._start]
        for number in range(steps):
            states.append(self._step(number * step, step, states[-1])[0])
        return np.array(states)

    def adaptive_step_count(self, t_end: float, rtol: float, atol: float, most: int) -> int:
        """Number of adaptive steps to t_end (s), including rejected ones.

        Raises NumericalFailure if it exceeds `most`.
        """
        t, y, h, exponent = 0.0, self._start, rtol * t_end, 1.0 / (self._table.error_order + 1)
        for number in range(1, most + 1):
            h = min(h, t_end - t)
            new_state, error = self._step(t, h, y)
            norm = self.size(h, error / (atol + rtol * np.maximum(np.abs(y), np.abs(new_state))))
            if norm < 1.0:
                t, y = t + h, new_state
            if t >= t_end:
                return number
            h *= (
                min(_MAX_STEP_FACTOR, max(_MIN_STEP_FACTOR, _SAFETY_FACTOR * norm**-exponent))
                if norm > 0.0
                else _MAX_STEP_FACTOR
            )
        raise NumericalFailure(f"more than {most} steps")

    def size(self, h: float, error: Array) -> float:
        """Norm of errors (3, n) of a step of h (s), relative to their tolerances; limit 1."""
        return float(np.sqrt(np.mean(error[:2] ** 2)))

    def _step(self, t: float, h: float, y: Array) -> tuple[Array, Array]:
        """State at t + h and its error estimate."""
        table, tangent, zeros = self._table, self._base, np.zeros_like(y[0])
        s = 1.0 / (table.gamma * h)
        tangent.residual(t, *y)
        time_derivative = tangent.slope(1.0, zeros, zeros, zeros)
        tangent.factor(s, s)
        stages = np.zeros((table.n_stages, *y.shape))
        for i in range(1, table.n_stages):
            stage_state = y + np.tensordot(table.A[i], stages, 1)
            right = (
                -self._stage.residual(t + table.C[i] * h, *stage_state)
                - self._time_coefficients[i] * h * time_derivative
            )
            q, u = stage_state[1:] + np.tensordot(table.second[i], stages[:, :2], 1) / h
            x = tangent.solve(right, q / s, -u)
            stages[i] = (x + q) / s, x, s * x - u
        end = y + np.tensordot(table.B, stages, 1)
        return end, np.tensordot(self._estimate, stages, 1)


# --- time-slope -----------------------------------------------------------------------------------

STEP, STEPS = 0.01, 200
#: Height of the waves, m.
WAVE_HEIGHT = 0.01

TIMES = STEP * np.arange(STEPS + 1)


def _road(rate: float) -> Model:
    """Model of 1 kg on a spring of 400 N/m and a damper of 12 N s/m over waves.

    The waves pass with an angular frequency of `rate` over the step.
    """
    wave = f"{rate / STEP!r}"
    effort = f"400*({WAVE_HEIGHT}*sin({wave}*t) - q) + 12*({WAVE_HEIGHT}*{wave}*cos({wave}*t) - u)"
    return sliding_mass((0, 1, 0), effort=effort)


def _road_error(rate: float, time_slope: bool) -> float:
    car = _road(rate)
    exact = simulate_to_end(car, TIMES[-1], rtol=1e-11, atol=1e-15, output_times=TIMES).q[:, 0]
    displacement: Array
    if time_slope:
        displacement = simulate_to_end(car, TIMES[-1], "rodas4", STEP, output_times=TIMES).q[:, 0]
    else:
        displacement = BareRosenbrock(car, "rodas4", time_slope=False).fixed_step_states(
            STEP, STEPS
        )[:, 0, 0]
    return float(np.abs(displacement - exact).max() / WAVE_HEIGHT)


TIME_SLOPE = CaseDefinition(
    name="time-slope",
    title="Rosenbrock steps without the time derivative: a road",
    cause="A linearised step needs the time derivative of the equations, as it needs the tangent "
    "matrix for the coordinates. Where drives, roads or loads depend on time and that derivative "
    "is left out, the table is of first order. Runs include it; tables of W-methods, such as "
    "ROS34PW2, do not need it.",
    parameter="step times angular frequency of the road", unit="", low=1e-4, high=1.0,
    scale=LOG_SCALE,
    measured="error of the displacement over wave height", limit=1e-3,
    method=MethodDefinition(
        "rodas4 without the derivative, h = 10 ms", lambda rate: _road_error(rate, False)
    ),
    remedy=MethodDefinition("rodas4, h = 10 ms", lambda rate: _road_error(rate, True)),
    reach=10.0,
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, IV.7; Rang, "
    "Angermann, BIT 45, 2005 (W-methods)",
)  # fmt: skip


# --- old-accelerations ----------------------------------------------------------------------------

T_END = 0.5


def _start_error(step: float, use_old: bool) -> float:
    rods, steps = double_pendulum(), round(T_END / step)
    step = T_END / steps
    exact = simulate_to_end(rods, T_END, rtol=1e-12, atol=1e-14, output_times=[T_END]).q[-1]
    if use_old:
        angles = BareRosenbrock(rods, "rodas5p", accelerations=np.zeros(2)).fixed_step_states(
            step, steps
        )[-1, 0]
    else:
        angles = simulate_to_end(rods, T_END, "rodas5p", step, output_times=[T_END]).q[-1]
    return float(np.abs(angles - exact).max())


OLD_ACCELERATIONS = CaseDefinition(
    name="old-accelerations",
    title="Accelerations from before an event: rods that are released",
    cause="Steps with accelerations as unknowns start from those of the step before. After a "
    "release, an impact or a sudden load these belong to other equations: the tangent is that of a "
    "wrong state. The first step then has a lasting error of lower order. Here two rods are "
    "released whose accelerations were zero before. One evaluation corrects them; every run makes "
    "it after each event and each discontinuity of the equations.",
    parameter="length of a step", unit="s", low=1e-3, high=0.05, scale=LOG_SCALE,
    measured="error of the angles after 0.5 s, rad", limit=1e-9,
    method=MethodDefinition("rodas5p, accelerations kept", lambda step: _start_error(step, True)),
    remedy=MethodDefinition("rodas5p", lambda step: _start_error(step, False)), reach=0.05,
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, IV.7 and VI.4",
)  # fmt: skip


# --- usual-norm -----------------------------------------------------------------------------------

NORM_T_END, RTOL, ATOL = 0.5, 1e-4, 1e-6

#: Largest number of steps that is counted.
MAX_STEPS = 4000


def _steps_with_usual_norm(stiffness: float) -> float:
    return BareRosenbrock(elbow_with_spring(stiffness), "rodas4p2").adaptive_step_count(
        NORM_T_END, RTOL, ATOL, MAX_STEPS
    )


def _steps_of_run(stiffness: float) -> float:
    run = simulate_to_end(
        elbow_with_spring(stiffness), NORM_T_END, "rodas4p2", rtol=RTOL, atol=ATOL
    )
    assert run.statistics is not None
    return run.statistics.steps + run.statistics.rejected_steps


USUAL_NORM = CaseDefinition(
    name="usual-norm",
    title="The usual error norm: a stiff spring that is slack at the start",
    cause="A slack spring starts to vibrate with the speed of the load over its frequency, far "
    "above any tolerance, while the displacement of that vibration is far below. In the usual norm "
    "that speed forces every period to be resolved. Weighted by the displacement within the step "
    "the speed is ignored, and the run follows only the slow motion. (A spring so stiff that even "
    "its speed is below the tolerance is harmless in both norms.)",
    parameter="stiffness of an elbow between falling rods", unit="N m/rad", low=1.0, high=1e8,
    scale=LOG_SCALE,
    measured="steps in 0.5 s, including rejected ones", limit=500,
    method=MethodDefinition(
        "rodas4p2, rtol 1e-4, speeds weighted separately", _steps_with_usual_norm
    ),
    remedy=MethodDefinition("rodas4p2, rtol 1e-4", _steps_of_run),
    reach=1e16,
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, IV.8 (the norm); "
    "Lubich, ZAMP 44, 1993 (stiff mechanical systems)",
)  # fmt: skip


# --- ros3p ----------------------------------------------------------------------------------------
#
# Rosenbrock method that is A-stable but not L-stable.
#
# J. Lang, J. Verwer, ROS3P, an accurate third-order Rosenbrock solver designed for parabolic
# problems, BIT 41 (2001) 731-738: gamma = 1/2 + sqrt(3)/6. Its spectral radius at infinity is
# sqrt(3) - 1.

_ROOT = math.sqrt(3.0)
_GAMMA = 0.5 + _ROOT / 6


def ros3p_tableau() -> Rosenbrock:
    """Tableau of the method, of order 3 with an error estimate of order 2."""
    inverse_gamma = 1 / _GAMMA
    A = [[0.0, 0, 0], [inverse_gamma, 0, 0], [inverse_gamma, 0, 0]]
    C = [[0.0, 0, 0], [-(inverse_gamma**2), 0, 0], [-2 * _ROOT, -_ROOT, 0]]
    last = _ROOT / 3, 1 - _ROOT / 3
    return make_rosenbrock(
        "ros3p", 3, _GAMMA, A, C, np.array([0.0, 1.0, 1.0]),
        np.array([_GAMMA, _GAMMA - 1, 0.5 - 2 * _GAMMA]), B=[2.0, *last],
        E=[2 - 5 / 3 * inverse_gamma, last[0] - 1, 0.0], error_order=2,
        source="Lang, Verwer, BIT 41 (2001)",
    )  # fmt: skip


# --- lasting-vibration ----------------------------------------------------------------------------

#: Step times angular frequency.
RATE = 1e4


def _remaining_ros3p(steps: float) -> float:
    count, rate = max(1, round(steps)), RATE / VIBRATION_STEP
    rod = rod_with_spring(stiffness_for_frequency(rate))
    q, u, _ = BareRosenbrock(rod, ros3p_tableau()).fixed_step_states(VIBRATION_STEP, count)[-1]
    return float(np.hypot(q[0], u[0] / rate) / RELEASE_ANGLE)


def _remaining_rodas4p2(steps: float) -> float:
    return float(relative_amplitudes(RATE, max(1, round(steps)), "rodas4p2")[-1])


LASTING_VIBRATION = CaseDefinition(
    name="lasting-vibration",
    title="A-stable but not L-stable: unresolved vibration remains",
    cause="A method may be stable for any stiffness and still keep most of a vibration far too "
    "fast for its steps. This one keeps three quarters of it per step, and over about the first "
    "ten steps the vibration hides all other motion. The methods of a run keep next to nothing "
    "(they are L-stable, or damp by a chosen radius).",
    parameter="steps after the start", unit="", low=1.0, high=100.0, scale=LOG_SCALE,
    measured="remaining amplitude, relative to the start", limit=0.01,
    method=MethodDefinition("ros3p, step times frequency 1e4", _remaining_ros3p),
    remedy=MethodDefinition("rodas4p2", _remaining_rodas4p2), reach=1.0,
    source="Lang, Verwer, BIT 41, 2001; Hairer, Wanner, Solving Ordinary Differential Equations "
    "II, 1996, IV.3",
)  # fmt: skip


CASES = (TIME_SLOPE, OLD_ACCELERATIONS, USUAL_NORM, LASTING_VIBRATION)
