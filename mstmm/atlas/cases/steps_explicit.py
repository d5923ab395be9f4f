"""Cases of explicit steps, and of forces that steps pass by."""

from __future__ import annotations

import math

import numpy as np

from ..case_definition import COUNT_SCALE, LOG_SCALE, CaseDefinition, MethodDefinition
from ..error_measures import relative_growth, simulate_to_end
from ..shared_scenes import beam_on_ground, pinned_rod, rod_with_spring, sliding_mass, uniform_beam

# --- rk4-stiffness --------------------------------------------------------------------------------

STEP, STEPS = 1e-3, 400


def _spring_growth(stiffness: float, method: str) -> float:
    return relative_growth(rod_with_spring(stiffness), STEP, STEPS, method)


RK4_STIFFNESS = CaseDefinition(
    name="rk4-stiffness",
    title="Explicit steps: stiffness of a spring",
    cause="An explicit step must resolve the fastest vibration whether it is wanted or not. The "
    "classical Runge-Kutta method is stable as long as the step times its angular frequency is "
    "below the square root of 8. Implicit steps stay bounded for any stiffness (for the accuracy "
    "of the vibration see numerical-damping).",
    parameter="stiffness of a rod's pin", unit="N m/rad", low=1e2, high=1e10, scale=LOG_SCALE,
    measured="largest over initial angle in 400 steps", limit=1.01,
    method=MethodDefinition("rk4, h = 1 ms", lambda k: _spring_growth(k, "rk4")),
    remedy=MethodDefinition("genalpha, h = 1 ms", lambda k: _spring_growth(k, "genalpha")),
    reach=1e12,
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, IV.2",
)  # fmt: skip


# --- rk4-damping ----------------------------------------------------------------------------------

STIFFNESS = 100.0


def _damper_growth(damping: float, method: str) -> float:
    return relative_growth(rod_with_spring(STIFFNESS, damping), STEP, STEPS, method)


RK4_DAMPING = CaseDefinition(
    name="rk4-damping",
    title="Explicit steps: strength of a damper",
    cause="A strong damper stops a motion within a time that is unrelated to the motion that "
    "follows. Explicit steps must still be shorter than 2.785 times that time, or they are "
    "unstable; implicit ones need not resolve it.",
    parameter="damping of a rod's pin", unit="N m s/rad", low=1.0, high=1e8, scale=LOG_SCALE,
    measured="largest over initial angle in 400 steps", limit=1.01,
    method=MethodDefinition("rk4, h = 1 ms", lambda c: _damper_growth(c, "rk4")),
    remedy=MethodDefinition("rodas4p2, h = 1 ms", lambda c: _damper_growth(c, "rodas4p2")),
    reach=1e10,
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, IV.2",
)  # fmt: skip


# --- rk4-shapes -----------------------------------------------------------------------------------

SHAPE_T_END = 0.2


def _deflection(shapes: float, method: str) -> float:
    """Largest tip deflection (m) of a clamped beam of 1 m under its weight, from straight."""
    beam = uniform_beam(50.0, int(shapes), stiffening=False)
    beam_model = beam_on_ground(beam, {"type": "fixed"}, 9.81)
    run = simulate_to_end(beam_model, SHAPE_T_END, method, STEP)
    return float(np.abs(run.deflection("beam", "tip")[:, 1]).max())


RK4_SHAPES = CaseDefinition(
    name="rk4-shapes",
    title="Explicit steps: number of shapes of a beam",
    cause="Frequencies of shapes grow with the square of their number, and an explicit step must "
    "resolve the highest, even if the motion is that of the first. Use few suitable shapes, or "
    "implicit steps, which damp what they do not resolve.",
    parameter="shapes of a clamped beam", unit="", low=1, high=20, scale=COUNT_SCALE,
    measured="largest tip deflection over the length", limit=0.1,
    method=MethodDefinition("rk4, h = 1 ms", lambda n: _deflection(n, "rk4")),
    remedy=MethodDefinition("rodas4p2, h = 1 ms", lambda n: _deflection(n, "rodas4p2")), reach=20,
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, IV.2; shapes: Rao, "
    "Vibration of Continuous Systems, 2019, ch. 11",
)  # fmt: skip


# --- narrow-pulse ---------------------------------------------------------------------------------

#: Position of the pulse, rad, and its work, J.
PULSE_ANGLE, PULSE_WORK = 5.0, 0.5


def _pulse_error(width: float, switched: bool) -> float:
    """Relative error of the final speed, which follows from the work of the pulse."""
    strength = PULSE_WORK / (width * math.sqrt(math.pi))
    effort = f"{strength!r}*exp(-((q - {PULSE_ANGLE})/{width!r})^2)"
    if switched:
        low, high = PULSE_ANGLE - 6 * width, PULSE_ANGLE + 6 * width
        effort = f"where(q > {low!r}, where(q < {high!r}, {effort}, 0), 0)"
    rod_model = pinned_rod(law={"effort": effort}, initial={"u": [1.0]})
    run = simulate_to_end(rod_model, 10.0, output_times=[10.0])
    inertia = float(rod_model.mass_matrix([0.0])[0, 0])
    return abs(float(run.u[-1, 0]) / math.sqrt(1 + 2 * PULSE_WORK / inertia) - 1)


NARROW_PULSE = CaseDefinition(
    name="narrow-pulse",
    title="Narrow pulses between the stages of a step",
    cause="A method evaluates a force only at the stages of its steps. In a uniform motion steps "
    "grow, and a smooth force that is narrow along the motion may be missed with all its work, "
    "while every estimated error is zero. Written with a comparison, the same force is located "
    "however narrow it is; max_step helps as well, at a cost.",
    parameter="width of the pulse", unit="rad", low=1e-4, high=1.0, scale=LOG_SCALE,
    measured="error of the speed after it, relative", limit=1e-6,
    method=MethodDefinition("dop853, rtol 1e-9", lambda w: _pulse_error(w, False)),
    remedy=MethodDefinition("dop853, the pulse within where()", lambda w: _pulse_error(w, True)),
    reach=1e-8,
    source="Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 1993, II.4",
)  # fmt: skip


# --- undamped-stop --------------------------------------------------------------------------------

STOP_STEP, PHASE_COUNT = 0.01, 40


def _rebound(rate: float, fixed_step: bool) -> float:
    """Energy of 1 kg after a stop, relative to that before, at 1 m/s.

    It is the largest over PHASE_COUNT instants within a step at which the contact starts.
    """
    stop = {"lower": 0.0, "stiffness": (rate / STOP_STEP) ** 2, "damping": 0.0}
    mass_model = sliding_mass(limits=stop)
    t_end = STOP_STEP * round((np.pi / rate) + 8)
    speeds = []
    for phase in np.arange(PHASE_COUNT) / PHASE_COUNT:
        start = [STOP_STEP * (1 + phase)], [-1.0]
        settings = {"step": STOP_STEP} if fixed_step else {"rtol": 1e-6, "atol": 1e-9}
        run = simulate_to_end(mass_model, t_end, "genalpha", initial=start, **settings)
        speeds.append(float(run.u[-1, 0]))
    return max(speeds) ** 2


UNDAMPED_STOP = CaseDefinition(
    name="undamped-stop",
    title="Fixed steps across a stop without damping",
    cause="A stop is a spring that starts suddenly. The contact occurs within a step, but the step "
    "assumes it from its start or its end on, so that the rebound has another energy than the "
    "approach. It is larger or smaller depending on the position within the step, and more so the "
    "stiffer the stop. Steps with error control shrink until the contact is resolved.",
    parameter="step times angular frequency on the stop", unit="", low=0.1, high=100.0,
    scale=LOG_SCALE,
    measured="energy after over that before the rebound", limit=1.05,
    method=MethodDefinition("genalpha, fixed steps", lambda rate: _rebound(rate, True)),
    remedy=MethodDefinition("genalpha, rtol = 1e-6", lambda rate: _rebound(rate, False)),
    reach=1e4,
    source="Hairer, Nørsett, Wanner, Solving Ordinary Differential Equations I, 1993, II.6",
)  # fmt: skip


CASES = (RK4_STIFFNESS, RK4_DAMPING, RK4_SHAPES, NARROW_PULSE, UNDAMPED_STOP)
