"""Cases of steps in absolute coordinates, by the classical matrices."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

from ...array_validation import Array
from ...errors import NumericalFailure
from ...runtime.classical.body_parts import build_parts
from ...runtime.classical.c_records import Stepper, scene_size
from ...runtime.classical.planar_and_spatial import (
    AUXILIARY,
    AXES,
    RATE,
    SPEED,
    PartMovement,
    select_form,
)
from ...runtime.classical.state_conversion import StateConversion, start_movements
from ...runtime.integrate.methods import ClassicalDiscreteTime
from ...runtime.integrate.steppers.alpha_family import Scheme, newmark, parse_scheme
from ...runtime.model.model import Model
from ..case_definition import COUNT_SCALE, LOG_SCALE, CaseDefinition, MethodDefinition
from ..error_measures import energy_gain, simulate_to_end
from ..shared_scenes import FALL_ENERGY, double_pendulum

# --- classical stepper ----------------------------------------------------------------------------
#
# Steps of the classical method for variants that modify them or read internal results.


class ClassicalSteps:
    """Classical steps from the initial state of a model; `stepper` may be modified."""

    def __init__(self, model: Model, scheme: Scheme, iterations: int = 1) -> None:
        engine, (self.q, u) = model.looped, model.initial_state()
        parts = build_parts(engine.packed)
        motions = start_movements(engine, parts, 0.0, self.q, u)
        names = [engine.body_name(part.hinge) for part in parts]
        gravity = np.array(engine.packed.system.gravity)
        form = select_form(parts, motions, gravity, names, scene_size(parts))
        start = np.array([form.initial_motion(k, motion) for k, motion in enumerate(motions)])
        self.stepper = Stepper(engine, parts, form, scheme, start, iterations, product=False)
        self._states = StateConversion(engine.packed, parts, form, self.q)

    def advance(self, step: float, steps: int = 1) -> Array:
        """Advance by `steps` steps (s); return q (nq,).  NumericalFailure if a step fails."""
        states = self.stepper.advance(steps, step)
        if len(states) < steps:
            raise NumericalFailure(f"a step fails with code {self.stepper.run.failure}")
        self.q = self._states.convert(states)[0][-1]
        return self.q

    def part_movements(self) -> list[PartMovement]:
        """Current motion of each part in absolute coordinates, as arrays over one time."""
        states, motions = self._states, self.stepper.motions
        return [
            states.form.part_movement(p, k, motions[k][None]) for k, p in enumerate(states.parts)
        ]


#: Step of the double pendulum (s).
STEP = 0.01

# --- classical-iteration --------------------------------------------------------------------------

STRETCH = 1e-3


def _relative_energy(stiffness: float, scheme: str, iterations: int = 1) -> float:
    model = double_pendulum(stiffness, STRETCH)
    method = ClassicalDiscreteTime(scheme=scheme, iterations=iterations)
    return energy_gain(simulate_to_end(model, 2.0, method, STEP), FALL_ENERGY)


CLASSICAL_ITERATION = CaseDefinition(
    name="classical-iteration",
    title="Classical method, one solution per step: unresolved stiff motion",
    cause="The trapezoidal rule in absolute coordinates with one linear solution per step moves "
    "the bodies by the error of the first solution. A scheme that damps fast motion, iterated, "
    "holds up to about a hundred times that stiffness.",
    parameter="stiffness of bushings (stretched by 1 mm)", unit="N/m", low=1e3, high=1e9,
    scale=LOG_SCALE,
    measured="largest energy in 2 s over that exchanged", limit=1.05,
    method=MethodDefinition(
        "dttmm-classical, newmark, one solution", lambda k: _relative_energy(k, "newmark")
    ),
    remedy=MethodDefinition(
        "generalised-alpha:0.8, iterated",
        lambda k: _relative_energy(k, "generalised-alpha:0.8", 20),
    ),
    reach=1e9,
    source="Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, 2019, ch. 7",
)  # fmt: skip


# --- newmark-constraints --------------------------------------------------------------------------


def _energy_change(t_end: float, scheme: str) -> float:
    steps = max(1, round(t_end / STEP))
    method = ClassicalDiscreteTime(scheme=scheme)
    run = simulate_to_end(double_pendulum(), steps * STEP, method, STEP)
    energy = np.asarray(run.energy())
    exchanged = np.ptp(np.asarray(run.quantity("energy.kinetic").values))
    return float(np.abs(energy - energy[0]).max() / exchanged)


NEWMARK_CONSTRAINTS = CaseDefinition(
    name="newmark-constraints",
    title="Undamped Newmark in absolute coordinates: length of a run",
    cause="Where hinges are constraints at position level, their loads follow the second "
    "difference of positions. The trapezoidal rule keeps every other error of these loads: they "
    "oscillate, grow slowly and then explode, however far the steps are iterated. Schemes that "
    "damp infinitely fast motion avoid this, and hinge coordinates have no such loads.",
    parameter="length of the run", unit="s", low=0.5, high=30.0, scale=LOG_SCALE,
    measured="change of the energy over that exchanged", limit=0.1,
    method=MethodDefinition(
        "dttmm-classical, newmark, h = 10 ms", lambda t: _energy_change(t, "newmark")
    ),
    remedy=MethodDefinition(
        "dttmm-classical, generalised-alpha:0.8",
        lambda t: _energy_change(t, "generalised-alpha:0.8"),
    ),
    reach=60.0,
    source="Cardona, Geradin, Computers and Structures 33, 1989; method: Rui, Wang, Zhang, "
    "Transfer Matrix Method for Multibody Systems, 2019, ch. 7",
)  # fmt: skip


# --- no predictor ---------------------------------------------------------------------------------
#
# Steps of the classical method linearised at their start: the predictor y* = y_n.

#: Trapezoidal rule, which needs no acceleration at the start of a step except the auxiliary one.
_SCHEME = newmark(0.5)


def coordinates_without_predictor(
    model: Model, step: float, steps: int, iterations: int = 1
) -> Array:
    """q (nq,) after `steps` steps (s) of the trapezoidal rule from the start.

    The stepper predicts with the accelerations of its motions, and then discards them.  Those set
    here predict that no body moves.  Raises NumericalFailure if a step fails.
    """
    run = ClassicalSteps(model, _SCHEME, iterations)
    for _ in range(steps):
        _set_resting_predictor(run.stepper.motions, step)
        run.advance(step)
    return run.q


def _set_resting_predictor(motions: Array, step: float) -> None:
    """Set accelerations with which the rule predicts the start of the step as its end."""
    speed, auxiliary = motions[:, SPEED:RATE], motions[:, AUXILIARY:AXES]
    motions[:, RATE:AUXILIARY] = -(speed / step + (0.5 - _SCHEME.beta) * auxiliary) / _SCHEME.beta


# --- predictor-order ------------------------------------------------------------------------------

PREDICTOR_T_END, REFERENCE_STEPS = 0.2, 4


def _without_predictor(steps: int) -> Array:
    return coordinates_without_predictor(double_pendulum(), PREDICTOR_T_END / steps, steps)


def _with_predictor(steps: int) -> Array:
    method = ClassicalDiscreteTime(scheme="newmark")
    run = simulate_to_end(
        double_pendulum(),
        PREDICTOR_T_END,
        method,
        PREDICTOR_T_END / steps,
        output_times=[PREDICTOR_T_END],
    )
    return run.q[-1]


@cache
def _exact() -> Array:
    return simulate_to_end(
        double_pendulum(), PREDICTOR_T_END, rtol=1e-12, atol=1e-14, output_times=[PREDICTOR_T_END]
    ).q[-1]  # fmt: skip


def _predictor_error(end_of: Callable[[int], Array], steps: int) -> float:
    return float(np.abs(end_of(steps) - _exact()).max())


def _excess(steps: float, end_of: Callable[[int], Array]) -> float:
    """Error relative to second order: 1 as long as it falls with the square of the step."""
    return (
        _predictor_error(end_of, int(steps))
        / _predictor_error(end_of, REFERENCE_STEPS)
        * (steps / REFERENCE_STEPS) ** 2
    )


PREDICTOR_ORDER = CaseDefinition(
    name="predictor-order",
    title="One solution per step: a predictor without motion",
    cause="Expanded about the start of a step, the hinge constraints omit the rotation of the "
    "hinge points within the step, an error of second order. Loads depend on the second difference "
    "of that error, and centripetal accelerations are wrong however short the steps are. A "
    "predictor with the accelerations has an error of third order. Second order is measured from "
    "four steps on.",
    parameter="steps in 0.2 s", unit="", low=REFERENCE_STEPS, high=1024, scale=COUNT_SCALE,
    measured="error over that of second order", limit=2.0,
    method=MethodDefinition(
        "newmark about y* = y", lambda steps: _excess(steps, _without_predictor)
    ),
    remedy=MethodDefinition(
        "newmark about y* = y + h yd + h² ydd/2", lambda steps: _excess(steps, _with_predictor)
    ),
    reach=4096,
    source="Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, 2019, ch. 7; Arnold, "
    "Bruls, Multibody System Dynamics 18, 2007",
)  # fmt: skip


# --- wilson-gaps ----------------------------------------------------------------------------------

GAP_T_END, ITERATIONS = 1.0, 20


def _largest_gap(step: float, scheme: str) -> float:
    """Largest gap, m, in the pins of two falling rods of 1 m."""
    run, largest = ClassicalSteps(double_pendulum(), parse_scheme(scheme), ITERATIONS), 0.0
    for _ in range(round(GAP_T_END / step)):
        run.advance(step)
        upper, lower = run.part_movements()
        elbow = upper.position + upper.axes[:, :, 0]
        largest = max(largest, *np.abs([upper.position, lower.position - elbow]).max(axis=(1, 2)))
    return largest


WILSON_GAPS = CaseDefinition(
    name="wilson-gaps",
    title="Wilson's method in absolute coordinates: hinges that open",
    cause="Wilson's collocation satisfies the equations, and with them the constraints, after the "
    "end of the step. The hinges are closed there, but not at the end of the step to which the "
    "method returns. However far a step is iterated, the gaps are of fourth order in the step. "
    "Schemes that satisfy the constraints at the end of the step close them to rounding.",
    parameter="length of a step", unit="s", low=2e-3, high=0.1, scale=LOG_SCALE,
    measured="largest gap in 1 s, m", limit=1e-6,
    method=MethodDefinition("wilson, iterated", lambda step: _largest_gap(step, "wilson")),
    remedy=MethodDefinition(
        "generalised-alpha:0.8, iterated", lambda step: _largest_gap(step, "generalised-alpha:0.8")
    ),
    reach=0.1,
    source="Wilson, Farhoomand, Bathe, Earthquake Engineering and Structural Dynamics 1, 1973; "
    "method: Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, 2019, ch. 7",
)  # fmt: skip


CASES = (CLASSICAL_ITERATION, NEWMARK_CONSTRAINTS, PREDICTOR_ORDER, WILSON_GAPS)
