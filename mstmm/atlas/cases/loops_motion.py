"""Cases of the motion, the assembly and the frequencies of closed loops."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np

from ...array_validation import Array
from ...errors import LoopClosureError
from ...runtime.engine.loops.assembly import Assembly
from ...runtime.engine.loops.loop_calls import LoopCalls
from ...runtime.linear.constrained_linearisation import mechanism_at
from ...runtime.linear.mck_matrices import State
from ...runtime.model.model import Model
from ..case_definition import LOG_SCALE, CaseDefinition, MethodDefinition
from ..error_measures import rk4_step, simulate_to_end
from ..shared_scenes import CRANK_INCLINATION, compile_looped, four_bar, hanging_linkage

# --- baumgarte ------------------------------------------------------------------------------------
#
# Closed loops stabilised by springs and dampers (Baumgarte) instead of a projection.
#
# Gaps g of the loops satisfy g'' + 2 alpha g' + alpha^2 g = 0 instead of g'' = 0. The accelerations
# get the corrections of position gap and velocity error, times alpha^2 and 2 alpha (J. Baumgarte,
# Computer Methods in Applied Mechanics and Engineering 1 (1972) 1-16).


def largest_gap(model: Model, step: float, steps: int, rate: float) -> float:
    """Largest gap (m, rad) in `steps` steps (s) of rk4 with alpha = `rate` (1/s).

    For hinges whose coordinates are integrals of their speeds.  NaN if a state is not finite.
    """
    engine, (q, u) = model.looped, model.initial_state()
    calls, memory, position_count = (
        LoopCalls(engine, q),
        np.atleast_2d(engine.start_memory()),
        model.nq,
    )

    def state_rate(y: Array) -> Array:
        q, u = np.ascontiguousarray(y[:position_count]), np.ascontiguousarray(y[position_count:])
        rates = engine.accelerations(0.0, q[None], u[None], memory)
        position_correction = calls.correction(calls.position_level, q, u)[0]
        velocity_correction = calls.correction(calls.velocity_level, q, u)[0]
        return np.append(
            rates[0][0],
            rates[1][0] + rate**2 * position_correction + 2 * rate * velocity_correction,
        )

    y, largest = np.append(q, u), 0.0
    for _ in range(steps):
        y = rk4_step(state_rate, y, step)
        if not np.isfinite(y).all() or np.abs(y).max() > 1e6:
            return float("nan")
        gap = calls.correction(calls.position_level, np.ascontiguousarray(y[:position_count]), u)[1]
        largest = max(largest, float(np.abs(gap).max()))
    return largest


# --- baumgarte ------------------------------------------------------------------------------------

STEP, STEPS = 5e-3, 300


@cache
def _four_bar() -> Model:
    return compile_looped(four_bar(speed=6.0))


def _stabilised_gap(rate: float) -> float:
    return largest_gap(_four_bar(), STEP, STEPS, rate / STEP)


@cache
def _projected_gap() -> float:
    linkage = _four_bar()
    times = STEP * np.arange(STEPS + 1)
    run = simulate_to_end(linkage, times[-1], "rk4", STEP, output_times=times)
    calls, still = LoopCalls(linkage.looped, run.q[0]), np.zeros(linkage.nu)
    return max(
        float(np.abs(calls.correction(calls.position_level, q, still)[1]).max()) for q in run.q
    )


BAUMGARTE = CaseDefinition(
    name="baumgarte",
    title="Closed loops with springs and dampers: a four-bar",
    cause="Accelerations that satisfy the constraints leave the position gap of a loop to the "
    "errors of the steps, and it grows. Baumgarte closes it by a spring and a damper, whose rate "
    "the user has to choose. A low rate has little effect. A high one makes the equations stiff, "
    "until the steps are too long for it. Projecting positions and speeds after each step needs no "
    "such number, and leaves only rounding.",
    parameter="rate of the springs times step", unit="", low=0.05, high=10.0, scale=LOG_SCALE,
    measured="largest gap in 1.5 s, m or rad", limit=1e-3,
    method=MethodDefinition("rk4, h = 5 ms, Baumgarte's rates", _stabilised_gap),
    remedy=MethodDefinition("rk4, h = 5 ms, projection", lambda rate: _projected_gap()), reach=10.0,
    source="Baumgarte, Computer Methods in Applied Mechanics and Engineering 1, 1972; Hairer, "
    "Lubich, Wanner, Geometric Numerical Integration, 2006, IV.4",
)  # fmt: skip


# --- position only projection ---------------------------------------------------------------------
#
# Closed loops with a projection of positions after each step, but not of speeds.
#
# The velocity error of the constraints remains, and opens gaps again in the next step (E. Hairer,
# C. Lubich, G. Wanner, Geometric Numerical Integration, 2006, IV.4).

#: Number of corrections of the gaps after a step, which converge quadratically.
_CORRECTION_COUNT = 3


def largest_velocity_error(model: Model, step: float, steps: int) -> float:
    """Largest velocity error (m/s, rad/s) of the loops in `steps` steps (s) of rk4.

    For hinges whose coordinates are integrals of their speeds.  NaN if a state is not finite.
    """
    engine, (q, u) = model.looped, model.initial_state()
    calls, memory, largest = LoopCalls(engine, q), np.atleast_2d(engine.start_memory()), 0.0

    def state_rate(y: Array) -> Array:
        q, u = (np.ascontiguousarray(part) for part in np.split(y, [model.nq]))
        rates = engine.accelerations(0.0, q[None], u[None], memory)
        return np.append(rates[0][0], rates[1][0])

    for _ in range(steps):
        y = rk4_step(state_rate, np.append(q, u), step)
        if not np.isfinite(y).all() or np.abs(y).max() > 1e6:
            return float("nan")
        q, u = (np.ascontiguousarray(part) for part in np.split(y, [model.nq]))
        for _ in range(_CORRECTION_COUNT):
            q = q + calls.correction(calls.position_level, q, u)[0]
        largest = max(largest, float(np.abs(calls.correction(calls.velocity_level, q, u)[1]).max()))
    return largest


# --- projected-places -----------------------------------------------------------------------------

T_END = 1.5


def _error_with_positions(step: float) -> float:
    return largest_velocity_error(compile_looped(four_bar(speed=6.0)), step, round(T_END / step))


def _error_with_speeds(step: float) -> float:
    linkage, times = compile_looped(four_bar(speed=6.0)), step * np.arange(round(T_END / step) + 1)
    run = simulate_to_end(linkage, times[-1], "rk4", step, output_times=times)
    calls = LoopCalls(linkage.looped, run.q[0])
    states = zip(run.q, run.u, strict=True)
    return max(
        float(np.abs(calls.correction(calls.velocity_level, *state)[1]).max()) for state in states
    )


PROJECTED_PLACES = CaseDefinition(
    name="projected-places",
    title="Closed loops with projection of positions only: a four-bar",
    cause="Projected positions make the loop look closed after each step. Its speeds still violate "
    "the constraints, and the next step follows them: angles of this four-bar have 6 to 18 times "
    "the error of a run with projected speeds. That projection costs one more pass with factors "
    "that are available.",
    parameter="length of a step", unit="s", low=1e-3, high=0.02, scale=LOG_SCALE,
    measured="largest velocity error in 1.5 s, m/s or rad/s", limit=1e-5,
    method=MethodDefinition("rk4, positions projected", _error_with_positions),
    remedy=MethodDefinition("rk4, positions and speeds projected", _error_with_speeds), reach=0.02,
    source="Hairer, Lubich, Wanner, Geometric Numerical Integration, 2006, IV.4; Eich, SIAM "
    "Journal on Numerical Analysis 30, 1993 (both projected)",
)  # fmt: skip


# --- mass weighted assembly -----------------------------------------------------------------------
#
# Assembly with gaps weighted by the mobility of the bodies along each row.
#
# Each row has a separate weight, so that a row along which bodies are light counts less.


class MassWeightedAssembly(Assembly):
    """Assembly that minimises gaps weighted by the mobility of each row."""

    def _compute_weights(self) -> Array:
        super()._compute_weights()
        mobility = np.asarray(self.calls.mobility, float)
        for row, row_mobility in enumerate(mobility.tolist()):
            self.calls.records.scale(row, row_mobility)
        return 1.0 / mobility


def nearest_pose(model: Model, q: Array, fixed_hinge: str, by_masses: bool) -> dict[str, float]:
    """Final hinge coordinates of the assembly of loops that cannot close, near q (nq,).

    The hinge `fixed_hinge` does not move; for hinges of one coordinate.  Raises ValueError if the
    loops close.
    """
    assembly_class = MassWeightedAssembly if by_masses else Assembly
    try:
        assembly_class(model.looped, q, [fixed_hinge]).positions(q)
    except LoopClosureError as error:
        return {name: coordinates[0] for name, coordinates in error.pose.items()}
    raise ValueError("nearest_pose: expected loops that cannot close, they close")


# --- least-gap ------------------------------------------------------------------------------------

#: Distance of the feet, m; fixed angle of the crank and initial rotation of the coupler, rad.
FOOT_DISTANCE, CRANK_ANGLE, COUPLER_OFFSET = 1.6, 2.8, 1.0
CRANK, COUPLER, ROCKER = 0.5, 1.1, 0.8


@cache
def _short_linkage(spread: float) -> Model:
    """Four-bar linkage with a very light coupler that is too short at some crank angles."""
    scene = four_bar(ratio=1e-3, spread=spread, feet=FOOT_DISTANCE)
    closing = scene["hinge"][-1]
    closing["inboard"], closing["outboard"] = closing["outboard"], closing["inboard"]
    return compile_looped(scene)


def _gap_error(spread: float, by_masses: bool) -> float:
    """Relative excess of the gap; at the least gap coupler and rocker are in line."""
    linkage = _short_linkage(spread)
    q = linkage.initial_state()[0]
    hinges = linkage.coordinate_layout.hinges
    q[hinges["foot"].q_slice] = CRANK_ANGLE
    q[hinges["knee"].q_slice] += COUPLER_OFFSET
    pose = nearest_pose(linkage, q, "foot", by_masses)
    knee = [CRANK * math.cos(CRANK_ANGLE), CRANK * math.sin(CRANK_ANGLE)]
    least_gap = math.dist(knee, (FOOT_DISTANCE, 0.0)) - COUPLER - ROCKER
    coupler_angle = CRANK_ANGLE + pose["knee"]
    tips = (
        (knee[0] + COUPLER * math.cos(coupler_angle), knee[1] + COUPLER * math.sin(coupler_angle)),
        (FOOT_DISTANCE + ROCKER * math.cos(pose["heel"]), ROCKER * math.sin(pose["heel"])),
    )
    return math.dist(*tips) / least_gap - 1.0


LEAST_GAP = CaseDefinition(
    name="least-gap",
    title="Least gaps of open loops weighted by masses: a slender coupler",
    cause="Where a loop cannot be closed, the pose of the least gap shows the reason. Weighted by "
    "the mobility of each row, gaps across a coupler with its mass in the middle count next to "
    "nothing. The iteration then ends with the bodies far apart, and the message reports a "
    "misleading gap and pose. One scale for all rows of a kind leaves the least gap to the "
    "geometry, and still prefers steps that move little mass.",
    parameter="moments of inertia of rods over those of uniform ones", unit="", low=1e-4, high=10.0,
    scale=LOG_SCALE,
    measured="gap in excess of the least one, relative", limit=1e-3,
    method=MethodDefinition("each row by its own mobility", lambda x: _gap_error(x, True)),
    remedy=MethodDefinition("one scale for all rows of a kind", lambda x: _gap_error(x, False)),
    reach=1e-8,
    source="Levenberg, Quarterly of Applied Mathematics 2, 1944 (damped least squares); "
    "Bjorck, Numerical Methods for Least Squares Problems, 1996, 4.4 (weighted problems)",
)  # fmt: skip


# --- missing load stiffness -----------------------------------------------------------------------
#
# Linear models of closed loops with frozen loads: K = N' R_q N without d(J' lambda)/dq.
#
# Loads at a cut rotate and move with their bodies, and tension along a rod straightens it. A tree
# differentiated along the motions that its loops allow lacks that stiffness (F. Gonzalez, P.
# Masarati, J. Cuadrado, M. A. Naya, Journal of Computational and Nonlinear Dynamics 12, 2017).


def squared_frequencies(model: Model) -> Array:
    """Squared angular frequencies of the mechanism at its start at rest, ascending, 1/s^2."""
    q, u = model.initial_state()
    state = State(0.0, q, u, np.zeros(model.nu))
    mechanism = mechanism_at(model, state)
    assert mechanism is not None
    frozen = replace(mechanism, constraint_stiffness=np.zeros_like(mechanism.constraint_stiffness))
    matrices = frozen.matrices(frozen.tree, state)
    return np.asarray(np.sort(np.linalg.eigvals(np.linalg.solve(matrices.M, matrices.K)).real))


# --- loaded-linkage -------------------------------------------------------------------------------

#: Moment of the weights of coupler and half the cranks with an arm of a crank (1 m), N*m.
WEIGHT_MOMENT = 2 * 9.81


def _hanging_linkage(load: float) -> Model:
    return compile_looped(hanging_linkage(WEIGHT_MOMENT / load))


def _frequency_error(load: float, squared: float) -> float:
    """Relative error of omega^2, against its closed form.

    The cranks of 1 m are inclined by a, the feet are 1 + 2 sin a apart, and all masses are 1.  The
    ends of the coupler stay 1 m apart to second order if the mean inclination grows by
    (1/2 + sin a) tan a s^2 for cranks that rotate by s.
    """
    sine, cosine = math.sin(CRANK_INCLINATION), math.cos(CRANK_INCLINATION)
    lift = cosine + (1 + 2 * sine) * sine**2 / cosine
    moment = 2 / 3 + cosine**2 + sine**2 / 3
    return abs(squared * moment / (WEIGHT_MOMENT / load + WEIGHT_MOMENT * lift) - 1)


def _error_with_frozen_loads(load: float) -> float:
    return _frequency_error(load, float(squared_frequencies(_hanging_linkage(load))[0]))


def _error_with_rotating_loads(load: float) -> float:
    return _frequency_error(load, float(_hanging_linkage(load).modes(1).omega[0]) ** 2)


LOADED_LINKAGE = CaseDefinition(
    name="loaded-linkage",
    title="Frequencies of closed loops: a linkage under load",
    cause="The tree of a mechanism, linearised along the motions that its loops allow, has the "
    "right masses and springs, and the weight of every body as if it swung independently. The "
    "loads of the loop are missing: those at its cut rotate with the rods, and stiffen or soften "
    "the whole. With stiff springs the error is small; for a linkage supported by its weight the "
    "frequency is wrong. The geometric stiffness of these loads belongs to the stiffness matrix.",
    parameter="weight times length over stiffness of the spring", unit="", low=1e-4, high=10.0,
    scale=LOG_SCALE,
    measured="error of the squared frequency, relative", limit=1e-2,
    method=MethodDefinition(
        "tree along its motions, loads of fixed direction", _error_with_frozen_loads
    ),
    remedy=MethodDefinition("loads rotate as well (model.modes)", _error_with_rotating_loads),
    reach=1e6,
    source="Gonzalez, Masarati, Cuadrado, Naya, Journal of Computational and Nonlinear Dynamics "
    "12, 2017 (linearised equations of constrained systems)",
)  # fmt: skip


CASES = (BAUMGARTE, PROJECTED_PLACES, LEAST_GAP, LOADED_LINKAGE)
