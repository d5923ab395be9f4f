"""Cases of implicit steps from an excited or unstable start."""

from __future__ import annotations

import math

import numpy as np

from ...array_validation import Array
from ...runtime.integrate.methods import ClassicalDiscreteTime, Method
from ...runtime.model.model import Model
from ..case_definition import LOG_SCALE, CaseDefinition, MethodDefinition
from ..error_measures import energy_gain, relative_amplitudes, simulate_to_end
from ..shared_scenes import FALL_ENERGY, compile_looped, double_pendulum, pinned_rod, sliding_mass

#: Step (s) of all cases but the last.
STEP = 0.01

# --- genalpha-overshoot ---------------------------------------------------------------------------

OVERSHOOT_STEPS = 20


def _overshoot(rate: float, method: str) -> float:
    return float(relative_amplitudes(rate, OVERSHOOT_STEPS, method).max())


GENALPHA_OVERSHOOT = CaseDefinition(
    name="genalpha-overshoot",
    title="Generalised-alpha: speeds after a stretched spring",
    cause="Displacements do not overshoot, but speeds do, in proportion to step times frequency: "
    "the step extrapolates the acceleration of a stretched spring. Start from an equilibrium, "
    "resolve the vibration, or use a method that carries no accelerations over.",
    parameter="step times angular frequency", unit="", low=0.1, high=1e5, scale=LOG_SCALE,
    measured="largest over initial amplitude in 20 steps", limit=1.05,
    method=MethodDefinition("genalpha", lambda rate: _overshoot(rate, "genalpha")),
    remedy=MethodDefinition("rodas4p2", lambda rate: _overshoot(rate, "rodas4p2")), reach=1e6,
    source="Hilber, Hughes, Earthquake Engineering and Structural Dynamics 6, 1978; Chung, "
    "Hulbert, Journal of Applied Mechanics 60, 1993",
)  # fmt: skip


# --- wilson-overshoot -----------------------------------------------------------------------------

WILSON_OVERSHOOT = CaseDefinition(
    name="wilson-overshoot",
    title="Wilson's method: overshoot in the first steps",
    cause="Wilson's method carries accelerations over and collocates after the end of the step. It "
    "is stable for any step, but in its first steps a stretched spring overshoots with the square "
    "of step times frequency. Nothing diverges, and still the results of the first instants are "
    "wrong by any factor. L-stable Rosenbrock methods damp the vibration at once.",
    parameter="step times angular frequency", unit="", low=0.1, high=1e5, scale=LOG_SCALE,
    measured="largest over initial amplitude in 20 steps", limit=1.05,
    method=MethodDefinition("wilson", lambda rate: _overshoot(rate, "wilson")),
    remedy=MethodDefinition("rodas4p2", lambda rate: _overshoot(rate, "rodas4p2")), reach=1e6,
    source="Goudreau, Taylor, Computer Methods in Applied Mechanics and Engineering 2, 1972; "
    "Hilber, Hughes, Earthquake Engineering and Structural Dynamics 6, 1978",
)  # fmt: skip


# --- numerical-damping ----------------------------------------------------------------------------

PERIODS = 10


def _lost_amplitude(rate: float, method: str) -> float:
    steps = round(PERIODS * 2 * math.pi / rate)
    return abs(1 - float(relative_amplitudes(rate, steps, method)[-1]))


NUMERICAL_DAMPING = CaseDefinition(
    name="numerical-damping",
    title="Numerical damping of a wanted vibration",
    cause="Implicit methods damp fast vibration, but a wanted one too, with a power of step times "
    "frequency that is one above the order of the method. A higher order keeps the vibration "
    "longer. Generalised-alpha with radius 1 keeps all of it, with a period too long and no "
    "damping of fast motion; exprb32 follows it exactly.",
    parameter="step times angular frequency", unit="", low=0.03, high=3.0, scale=LOG_SCALE,
    measured="relative loss of amplitude in 10 periods", limit=0.01,
    method=MethodDefinition("genalpha", lambda rate: _lost_amplitude(rate, "genalpha")),
    remedy=MethodDefinition("rodas5p", lambda rate: _lost_amplitude(rate, "rodas5p")), reach=3.0,
    source="Chung, Hulbert, Journal of Applied Mechanics 60, 1993; Steinebach, BIT 63, 2023",
)  # fmt: skip


# --- iterated-steps -------------------------------------------------------------------------------

STRETCH = 1e-3


def _stretched_energy(stiffness: float, method: str) -> float:
    return energy_gain(
        simulate_to_end(double_pendulum(stiffness, STRETCH), 2.0, method, STEP), FALL_ENERGY
    )


ITERATED_STEPS = CaseDefinition(
    name="iterated-steps",
    title="Iterated steps: a stiff spring with much energy",
    cause="Generalised-alpha carries the accelerations of the start over. Those of a stretched "
    "spring may be thousands of times those of the motion, and then even converged steps give the "
    "bodies a wrong motion. Rodas4P2 is L-stable in every stage: it damps the unresolved "
    "vibration, and with it the energy of the spring.",
    parameter="stiffness of bushings (stretched by 1 mm)", unit="N/m", low=1e3, high=1e9,
    scale=LOG_SCALE,
    measured="largest energy in 2 s over that exchanged", limit=1.05,
    method=MethodDefinition("genalpha, h = 10 ms", lambda k: _stretched_energy(k, "genalpha")),
    remedy=MethodDefinition("rodas4p2, h = 10 ms", lambda k: _stretched_energy(k, "rodas4p2")),
    reach=1e10,
    source="Chung, Hulbert, Journal of Applied Mechanics 60, 1993; Steinebach, in Progress in "
    "Differential-Algebraic Equations II, 2020",
)  # fmt: skip


# --- one-iteration --------------------------------------------------------------------------------

ONE_ITERATION = CaseDefinition(
    name="one-iteration",
    title="One linearised equation per step: an unresolved stiff motion",
    cause="Where a bushing is stretched at the start, its end moves far within a step, and an "
    "expansion about the predicted motion is inaccurate: the energy grows without a source. "
    "Iterating to convergence, the remedy, holds as long as the iteration converges.",
    parameter="stiffness of bushings (stretched by 1 mm)", unit="N/m", low=1e3, high=1e9,
    scale=LOG_SCALE,
    measured="largest energy in 2 s over that exchanged", limit=1.05,
    method=MethodDefinition("dttmm, h = 10 ms", lambda k: _stretched_energy(k, "dttmm")),
    remedy=MethodDefinition("genalpha, iterated", lambda k: _stretched_energy(k, "genalpha")),
    reach=1e9,
    source="Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, 2019, ch. 7; Negrut, "
    "Jay, Khude, Journal of Computational and Nonlinear Dynamics 4, 2009",
)  # fmt: skip


# --- predicted-loads ------------------------------------------------------------------------------


def _falling_energy(stiffness: float, method: str | Method) -> float:
    run = simulate_to_end(double_pendulum(stiffness), 1.0, method, STEP)
    return energy_gain(run, FALL_ENERGY)


PREDICTED_LOADS = CaseDefinition(
    name="predicted-loads",
    title="One linearised equation per step: rotation of predicted loads",
    cause="A predictor has an error of third order in the length of a spring, and the load there "
    "has that error times the stiffness. The rotation of loads with their bodies is linearised "
    "about this load. Slack springs carry some 40 N, but the predicted load is of the order of "
    "meganewtons, and it disturbs the next step as well. Runs stop at the pivot that changes its "
    "sign. The classical form in absolute coordinates, with damping, rotates only the loads that "
    "the springs had before.",
    parameter="stiffness of bushings (slack at the start)", unit="N/m", low=1e3, high=1e9,
    scale=LOG_SCALE, measured="largest energy in 1 s over that exchanged", limit=1.05,
    method=MethodDefinition("dttmm, h = 10 ms", lambda k: _falling_energy(k, "dttmm")),
    remedy=MethodDefinition(
        "dttmm-classical, generalised-alpha:0.8",
        lambda k: _falling_energy(k, ClassicalDiscreteTime(scheme="generalised-alpha:0.8")),
    ), reach=1e12,
    source="Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, 2019, ch. 7; Negrut, "
    "Jay, Khude, Journal of Computational and Nonlinear Dynamics 4, 2009",
)  # fmt: skip


# --- unstable-motion ------------------------------------------------------------------------------

INITIAL_ANGLE = 1e-9

#: Duration of a run, in time constants of growth.
TIME_CONSTANTS = 8.0


def _inverted_rod(weight: float) -> Model:
    return pinned_rod(-weight, initial={"q": [INITIAL_ANGLE]})


def _growth_error(rate: float, fixed_step: bool) -> float:
    """Relative error; `rate` is the step times the growth rate of an inverted rod on its pin."""
    unit_model = _inverted_rod(1.0)
    slope = float(unit_model.derivatives(np.zeros(1), np.zeros(1)).q[0, 0])
    falling = _inverted_rod((rate / STEP) ** 2 / slope)
    t_end = max(1, round(TIME_CONSTANTS / rate)) * STEP
    exact = simulate_to_end(falling, t_end, rtol=1e-11, atol=1e-22, output_times=[t_end]).q
    if fixed_step:
        angles = simulate_to_end(falling, t_end, "genalpha", STEP, output_times=[t_end]).q
    else:
        angles = simulate_to_end(
            falling, t_end, "rodas4p2", rtol=1e-5, atol=1e-7 * INITIAL_ANGLE, output_times=[t_end]
        ).q
    return abs(float(angles[-1, 0] / exact[-1, 0]) - 1)


UNSTABLE_MOTION = CaseDefinition(
    name="unstable-motion",
    title="Implicit steps: an unstable motion",
    cause="Implicit steps damp fast motion, including fast growth. For an inverted or buckled body "
    "a step of half the time constant of growth is inaccurate. At twice that time the matrix of "
    "the step changes its sign: the run reports this and ends. The error of the step shows it, but "
    "fixed steps do not use it.",
    parameter="step times rate of growth", unit="", low=0.01, high=8.0, scale=LOG_SCALE,
    measured="error of the displacement, relative", limit=0.1,
    method=MethodDefinition("genalpha, h = 10 ms", lambda rate: _growth_error(rate, True)),
    remedy=MethodDefinition("rodas4p2, rtol 1e-5", lambda rate: _growth_error(rate, False)),
    reach=8.0,
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, IV.3",
)  # fmt: skip


# --- friction-steps -------------------------------------------------------------------------------

REFERENCE_STEP, FRICTION_T_END = 5e-4, 3.0
FRICTION_TIMES = np.linspace(0.0, FRICTION_T_END, 31)


def _friction_path(velocity: float, method: str, step: float) -> Array:
    """Path (m) of 1 kg with friction of 1 N, pulled by 10 N/m whose end moves at 0.3 m/s."""
    friction = {"coulomb": 1.0, "regularisation_velocity": velocity}
    mass_model = sliding_mass(effort="10*(0.3*t - q)", friction=friction)
    run = simulate_to_end(mass_model, FRICTION_T_END, method, step, output_times=FRICTION_TIMES)
    return np.asarray(run.q[:, 0])


def _friction_error(velocity: float, method: str) -> float:
    exact = _friction_path(velocity, "esdirk436", REFERENCE_STEP)
    return float(np.abs(_friction_path(velocity, method, STEP) - exact).max())


FRICTION_STEPS = CaseDefinition(
    name="friction-steps",
    title="Linearised friction: a body that sticks and slips",
    cause="Rosenbrock methods linearise friction at the start of a step. A body that sticks has a "
    "slope there that vanishes as soon as it slips, but the step keeps it: the body sticks too "
    "long. Methods that iterate evaluate friction at the end of the step, until their iteration "
    "does not converge across the bend; then they report it.",
    parameter="velocity over which friction is regularised", unit="m/s", low=1e-7, high=0.1,
    scale=LOG_SCALE,
    measured="error of the displacement, m", limit=1e-4,
    method=MethodDefinition("rodas4p2, h = 10 ms", lambda v: _friction_error(v, "rodas4p2")),
    remedy=MethodDefinition("esdirk436, h = 10 ms", lambda v: _friction_error(v, "esdirk436")),
    reach=1e-7,
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, IV.7 and IV.8",
)  # fmt: skip


# --- order-reduction ------------------------------------------------------------------------------

REDUCTION_STEP = 0.05

#: Output times of the error, s, after the transient of the start.
REDUCTION_TIMES = np.linspace(1.0, 2.0, 21)


def _reduction_error(stiffness: float, method: str) -> float:
    slide = {"type": "prismatic", "axis": [1, 0, 0]}
    law = {"stiffness": stiffness, "damping": 2 * float(np.sqrt(stiffness))}
    bodies = [{"name": "base", "mass": 1.0}, {"name": "mass", "mass": 1.0}]
    hinges = [
        {"name": "road", "inboard": "ground", "outboard": "base", "drive": "0.1*sin(3*t)", **slide},
        {"name": "spring", "inboard": "base", "outboard": "mass", "law": law, **slide},
    ]
    base_model = compile_looped({"gravity": [0, 0, 0], "body": bodies, "hinge": hinges})
    reference = simulate_to_end(
        base_model, 2.0, "rodas5p", rtol=1e-12, atol=1e-16, output_times=REDUCTION_TIMES
    )
    run = simulate_to_end(base_model, 2.0, method, REDUCTION_STEP, output_times=REDUCTION_TIMES)
    stretch = reference.q[:, 1]
    return float(np.abs(run.q[:, 1] - stretch).max() / np.abs(stretch).max())


ORDER_REDUCTION = CaseDefinition(
    name="order-reduction",
    title="Order reduction: a stiff spring moved by a drive",
    cause="Where a stiff spring is moved from outside, the error of a stage is that of the moved "
    "base and not that of the motion. The table of fourth order is of second order here, and its "
    "error in the spring load a hundred times larger. Tables made for this case, such as Rodas4P2, "
    "keep their order.",
    parameter="stiffness of the spring (of 1 kg, critically damped)", unit="N/m",
    low=10.0, high=1e7, scale=LOG_SCALE,
    measured="error of the spring's load, relative", limit=2e-6,
    method=MethodDefinition("rodas4, h = 50 ms", lambda k: _reduction_error(k, "rodas4")),
    remedy=MethodDefinition("rodas4p2, h = 50 ms", lambda k: _reduction_error(k, "rodas4p2")),
    reach=1e10,
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, VI.4; Steinebach, "
    "in Progress in Differential-Algebraic Equations II, 2020",
)  # fmt: skip


CASES = (
    GENALPHA_OVERSHOOT,
    WILSON_OVERSHOOT,
    NUMERICAL_DAMPING,
    ITERATED_STEPS,
    ONE_ITERATION,
    PREDICTED_LOADS,
    UNSTABLE_MOTION,
    FRICTION_STEPS,
    ORDER_REDUCTION,
)
