"""Cases of coordinates of rotations."""

from __future__ import annotations

from functools import cache, partial

import numpy as np

from ...array_validation import Array
from ...runtime.integrate.methods import ClassicalDiscreteTime
from ...runtime.integrate.steppers import get
from ...runtime.integrate.steppers.alpha_family import generalised_alpha
from ...runtime.integrate.steppers.implicit_methods import Rosenbrock
from ...runtime.model.model import Model
from ..case_definition import LOG_SCALE, CaseDefinition, MethodDefinition
from ..error_measures import ROTATION_TIME, attitude_error, rk4_step, simulate_to_end
from ..shared_scenes import ROD_TRANSVERSE_INERTIA, compile_looped, rod, spinning_top
from .classical import ClassicalSteps

# --- gimbal-passage -------------------------------------------------------------------------------

STEP, PASSAGE_T_END = 1e-3, 2.0


def _final_attitude(kind: str, distance: float, *method: str | float, **options: float) -> Array:
    """Final attitude (quaternion) of a body that rotates at about 1 rad/s.

    It passes an attitude whose second angle is `distance` rad below 90 degrees.
    """
    half = distance / 2
    start = [0.0, 0.0, distance] if kind == "gimbal" else [np.cos(half), 0.0, 0.0, np.sin(half)]
    angular_velocity = [np.sin(distance), np.cos(distance), 0.0]
    model = spinning_top(kind)
    run = simulate_to_end(
        model,
        PASSAGE_T_END,
        *method,
        initial=(start, angular_velocity),
        output_times=[PASSAGE_T_END],
        **options,
    )
    return np.asarray(run.orientation("top")[-1])


def _passage_error(distance: float, kind: str) -> float:
    exact = _final_attitude("ball", distance, rtol=1e-13, atol=1e-15)
    attitude = _final_attitude(kind, distance, "rk4", STEP)
    return float(min(np.abs(attitude - exact).max(), np.abs(attitude + exact).max()))


GIMBAL_PASSAGE = CaseDefinition(
    name="gimbal-passage",
    title="Three angles: the attitude at which they are singular",
    cause="Where the second of three angles passes 90 degrees, the axes of the first and the third "
    "coincide. Their rates grow without bound, and steps that are accurate elsewhere lose all "
    "digits. Whether a step hits or jumps over the attitude is a matter of chance. The quaternion "
    "of a ball hinge has no such attitude.",
    parameter="distance of the second angle from 90 degrees", unit="rad", low=1e-5, high=0.5,
    scale=LOG_SCALE,
    measured="error of the attitude after 2 s", limit=1e-6,
    method=MethodDefinition(
        "gimbal, rk4 with h = 1 ms", lambda distance: _passage_error(distance, "gimbal")
    ),
    remedy=MethodDefinition(
        "ball, rk4 with h = 1 ms", lambda distance: _passage_error(distance, "ball")
    ),
    reach=1e-8,
    source="Shabana, Dynamics of Multibody Systems, 2020, ch. 2 (singularity of Euler angles); "
    "matrices of ball hinges: Rui, Wang, Zhang, 2019, ch. 5 (5.49)",
)  # fmt: skip


# --- unnormalised quaternions ---------------------------------------------------------------------
#
# Runge-Kutta steps on the components of quaternions without normalisation.


def unnormalised_coordinates(model: Model, step: float, steps: int) -> Array:
    """q (nq,) after `steps` steps (s) of rk4 from the start, with the rates of the engine."""
    engine, memory = model.looped, np.atleast_2d(model.looped.start_memory())

    def rate(y: Array) -> Array:
        q, u = (np.ascontiguousarray(part[None]) for part in np.split(y, [model.nq]))
        return np.concatenate([part[0] for part in engine.accelerations(0.0, q, u, memory)])

    y = np.concatenate(model.initial_state())
    for _ in range(steps):
        y = rk4_step(rate, y, step)
    return y[: model.nq]


# --- quaternion-drift -----------------------------------------------------------------------------

#: Length of a run, s, and the angular velocity of the body, rad/s.
DRIFT_T_END, DRIFT_SPIN = 50.0, (0.4, 1.6, 1.1)


def _drift(step: float) -> float:
    q = unnormalised_coordinates(spinning_top("ball", DRIFT_SPIN), step, round(DRIFT_T_END / step))
    return abs(float(np.linalg.norm(q)) - 1)


def _normalised_drift(step: float) -> float:
    run = simulate_to_end(
        spinning_top("ball", DRIFT_SPIN), round(DRIFT_T_END / step) * step, "rk4", step
    )
    return float(np.abs(np.linalg.norm(run.q, axis=1) - 1).max())


QUATERNION_DRIFT = CaseDefinition(
    name="quaternion-drift",
    title="Quaternions as four numbers: their length",
    cause="Four numbers for three rotations are constrained by their length, which a method of "
    "integration does not preserve. The length decreases per step with the sixth power of the "
    "step, and a quaternion of another length gives no orthonormal axes. Every run normalises "
    "quaternions after each step.",
    parameter="length of a step", unit="s", low=5e-3, high=0.5, scale=LOG_SCALE,
    measured="change of the length in 50 s", limit=1e-6,
    method=MethodDefinition("rk4, length not restored", _drift),
    remedy=MethodDefinition("rk4, length restored after each step", _normalised_drift), reach=0.5,
    source="Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, 2019, ch. 2; Shabana, "
    "Dynamics of Multibody Systems, 2020, ch. 2",
)  # fmt: skip


# --- naive rotation vectors -----------------------------------------------------------------------
#
# Rotation vectors with a truncated rate, in the extreme the angular velocity.
#
# Within a step an attitude is q exp(theta), and theta' = w + theta x w / 2 + theta x (theta x w) /
# 12 up to the third power of theta (H. Munthe-Kaas, BIT 38 (1998) 92-111). Here products are
# omitted.


def rotate(attitude: Array, theta: Array) -> Array:
    """Quaternion (4,) of an attitude rotated by a rotation vector (3,) in body axes."""
    angle = float(np.linalg.norm(theta))
    w, v = np.cos(angle / 2), 0.5 * np.sinc(angle / (2 * np.pi)) * theta
    w0, v0 = attitude[0], attitude[1:]
    return np.array([w0 * w - v0 @ v, *(w0 * v + w * v0 + np.cross(v0, v))])


def rotation_vector_rate(theta: Array, u: Array, products: int = 2) -> Array:
    """Rate (3,) of a rotation vector at an angular velocity, with 0 to 2 of these products."""
    cross_product = np.cross(theta, u)
    rate = np.asarray(u, float)
    if products > 0:
        rate = rate + cross_product / 2
    return rate + np.cross(theta, cross_product) / 12 if products > 1 else rate


def attitude_by_rotation_vectors(model: Model, step: float, steps: int, products: int = 0) -> Array:
    """q (4,) of a body on a ball hinge after `steps` steps of rk4 on rotation vectors."""
    attitude, speeds = model.initial_state()
    for _ in range(steps):
        stages: list[tuple[Array, Array]] = []
        for fraction in (0.0, 0.5, 0.5, 1.0):
            rate, acceleration = stages[-1] if stages else (np.zeros(3), np.zeros(3))
            theta, u = fraction * step * rate, speeds + fraction * step * acceleration
            stages.append(
                (
                    rotation_vector_rate(theta, u, products),
                    model.accelerations(rotate(attitude, theta), u),
                )
            )
        rate, acceleration = step / 6 * np.tensordot([1, 2, 2, 1], np.array(stages), 1)
        attitude, speeds = rotate(attitude, rate), speeds + acceleration
    return attitude


# --- plain-charts ---------------------------------------------------------------------------------

PLAIN_CHARTS = CaseDefinition(
    name="plain-charts",
    title="Rotation vectors whose rate is the angular velocity",
    cause="Within a step an attitude may be described by a rotation vector, three numbers without "
    "a constraint. Its rate equals the angular velocity only where it is zero; elsewhere products "
    "of both are added. Without them every method falls to second order, whatever the order of its "
    "table. Runs keep two of them, enough for fifth order, or use quaternions.",
    parameter="length of a step", unit="s", low=2e-3, high=0.1, scale=LOG_SCALE,
    measured=f"error of the attitude after {ROTATION_TIME:g} s, rad",
    limit=1e-4,
    method=MethodDefinition(
        "rk4, the products left out", lambda h: attitude_error(attitude_by_rotation_vectors, h)
    ),
    remedy=MethodDefinition("rk4", lambda h: attitude_error("rk4", h)),
    reach=0.1,
    source="Munthe-Kaas, BIT 38, 1998; Brüls, Cardona, Arnold, Mechanism and Machine Theory 48, "
    "2012",
)  # fmt: skip


# --- single-product -------------------------------------------------------------------------------

#: Variant with one product.
ONE_PRODUCT_VARIANT = partial(attitude_by_rotation_vectors, products=1)

SINGLE_PRODUCT = CaseDefinition(
    name="single-product",
    title="Rotation vectors with one of two products",
    cause="The rate of a rotation vector is the angular velocity plus products of both, each with "
    "one more power of the vector. With the first product alone the rate is accurate to third "
    "order within a step, and so is the result: a table of fourth or fifth order gains nothing. "
    "Runs with rotation vectors keep two products, enough for the fifth order of their tables.",
    parameter="length of a step", unit="s", low=4e-3, high=0.2, scale=LOG_SCALE,
    measured=f"error of the attitude after {ROTATION_TIME:g} s, rad",
    limit=1e-6,
    method=MethodDefinition(
        "rk4, one product kept", lambda h: attitude_error(ONE_PRODUCT_VARIANT, h)
    ),
    remedy=MethodDefinition("kvaerno5, two kept", lambda h: attitude_error("kvaerno5", h)),
    reach=0.2,
    source="Munthe-Kaas, BIT 38, 1998; Iserles, Munthe-Kaas, Norsett, Zanna, Acta Numerica 9, 2000",
)  # fmt: skip


# --- rotation vector rosenbrock -------------------------------------------------------------------
#
# Rosenbrock steps on rotation vectors, optionally with an incomplete tangent matrix.
#
# Within a step an attitude is q exp(theta), and theta' = w + theta x w / 2 + theta x (theta x w) /
# 12 (H. Munthe-Kaas, BIT 38 (1998) 92-111). At theta = 0 the derivative of theta' by theta is that
# of theta x w / 2, though theta vanishes there (E. Hairer, G. Wanner, Solving Ordinary Differential
# Equations II, 1996, IV.7: the order of a table requires the whole Jacobian).

#: Step of the finite differences, rad and rad/s.
_DIFFERENCE_STEP = 1e-5


def attitude_by_rosenbrock(
    model: Model, step: float, steps: int, method: str, slope: bool
) -> Array:
    """q (4,) of a body on a ball hinge after `steps` steps (s) of a Rosenbrock table.

    `slope`: whether the tangent has the derivative of the rotation vector's rate by that vector.
    """
    table = get(method)
    assert isinstance(table, Rosenbrock)
    attitude, speeds = model.initial_state()

    def rates(y: Array) -> Array:
        theta, u = y[:3], y[3:]
        return np.append(
            rotation_vector_rate(theta, u), model.accelerations(rotate(attitude, theta), u)
        )

    for _ in range(steps):
        start = np.append(np.zeros(3), speeds)
        tangent = np.transpose([
            (rates(start + d) - rates(start - d)) / (2 * _DIFFERENCE_STEP)
            for d in _DIFFERENCE_STEP * np.eye(6)
        ])  # fmt: skip
        if not slope:
            tangent[:3, :3] = 0.0
        left = np.eye(6) / (table.gamma * step) - tangent
        stages = np.zeros((table.n_stages, 6))
        for i in range(1, table.n_stages):
            right = rates(start + table.A[i] @ stages) + table.second[i] @ stages / step
            stages[i] = np.linalg.solve(left, right)
        end = start + table.B @ stages
        attitude, speeds = rotate(attitude, end[:3]), end[3:]
    return attitude


# --- turn-slope -----------------------------------------------------------------------------------

TABLE = "rodas4p2"
INCOMPLETE_VARIANT = partial(attitude_by_rosenbrock, method=TABLE, slope=False)

TURN_SLOPE = CaseDefinition(
    name="turn-slope",
    title="Rosenbrock steps on rotation vectors: a missing derivative",
    cause="A rotation vector starts every step at zero, where its rate is the angular velocity. "
    "The derivative of that rate by the vector, however, is half a product that does not vanish "
    "there. Without it in the tangent matrix all tables fall to second order. Runs include it.",
    parameter="length of a step", unit="s", low=4e-3, high=0.1, scale=LOG_SCALE,
    measured=f"error of the attitude after {ROTATION_TIME:g} s, rad",
    limit=1e-6,
    method=MethodDefinition(
        f"{TABLE}, the derivative left out", lambda h: attitude_error(INCOMPLETE_VARIANT, h)
    ),
    remedy=MethodDefinition(TABLE, lambda h: attitude_error(TABLE, h)),
    reach=0.1,
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, IV.7 (order takes "
    "the whole Jacobian); Munthe-Kaas, BIT 38, 1998",
)  # fmt: skip


# --- additive rotations ---------------------------------------------------------------------------
#
# Steps of the classical method that add finite rotations like vectors.
#
# A body rotates by T(psi) times the change of psi, with the tangent operator T of the exponential;
# here the matrices have 1 instead of T.


def additive_coordinates(model: Model, step: float, steps: int, radius: float) -> Array:
    """q (nq,) after `steps` steps (s) of generalised-alpha, with one solution per step.

    `radius` is the spectral radius at infinity.  Raises NumericalFailure if a step fails.
    """
    run = ClassicalSteps(model, generalised_alpha(radius))
    run.stepper.run.turning = 0
    return run.advance(step, steps)


# --- plain-turns ----------------------------------------------------------------------------------

TURN_T_END, TURN_SPIN, RADIUS = 1.0, 6.0, 0.8


@cache
def _two_rods() -> Model:
    """Two falling rods on ball hinges; the first spins about its axis, the second across it."""
    spins = ([TURN_SPIN, 0, 0], [0, 0, TURN_SPIN / 2])
    hinge_ends = (("shoulder", "ground", "upper"), ("elbow", "upper.tip", "lower"))
    return compile_looped(
        {
            "gravity": [0, -9.81, 0],
            "body": [
                rod(name, inertia=(0.01, ROD_TRANSVERSE_INERTIA, ROD_TRANSVERSE_INERTIA))
                for name in ("upper", "lower")
            ],
            "hinge": [
                {
                    "name": name,
                    "type": "ball",
                    "inboard": inboard,
                    "outboard": outboard,
                    "initial": {"u": spin},
                }
                for (name, inboard, outboard), spin in zip(hinge_ends, spins, strict=True)
            ],
        }
    )


@cache
def _exact() -> Array:
    return simulate_to_end(
        _two_rods(), TURN_T_END, rtol=1e-11, atol=1e-13, output_times=[TURN_T_END]
    ).q[-1]


def _turn_error(rate: float, additive: bool) -> float:
    steps = round(TURN_T_END * TURN_SPIN / rate)
    step = TURN_T_END / steps
    if additive:
        coordinates = additive_coordinates(_two_rods(), step, steps, RADIUS)
    else:
        method = ClassicalDiscreteTime(scheme=f"generalised-alpha:{RADIUS}")
        coordinates = simulate_to_end(
            _two_rods(), TURN_T_END, method, step, output_times=[TURN_T_END]
        ).q[-1]
    return float(np.abs(coordinates - _exact()).max())


PLAIN_TURNS = CaseDefinition(
    name="plain-turns",
    title="Finite rotations without the tangent operator",
    cause="The unknown of a body in space is a rotation vector from the predicted attitude; a "
    "change of that vector is a rotation only near zero. With the hinges as constraints, the error "
    "of the linear equations is a gap, which causes loads in the next step. The motion is lost "
    "within a second at steps that are far from long. The tangent operator in the matrices keeps "
    "the hinges closed.",
    parameter="step times angular velocity", unit="", low=3e-3, high=0.1, scale=LOG_SCALE,
    measured="error of the coordinates after 1 s", limit=0.02,
    method=MethodDefinition("dttmm-classical, T left out", lambda rate: _turn_error(rate, True)),
    remedy=MethodDefinition("dttmm-classical", lambda rate: _turn_error(rate, False)), reach=0.3,
    source="Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, 2019, ch. 8; Brüls, "
    "Cardona, Arnold, Mechanism and Machine Theory 48, 2012",
)  # fmt: skip


CASES = (GIMBAL_PASSAGE, QUATERNION_DRIFT, PLAIN_CHARTS, SINGLE_PRODUCT, TURN_SLOPE, PLAIN_TURNS)
