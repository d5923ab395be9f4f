"""Cases of the motion of flexible bodies: stiffening, frames and coupling."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np

from ...array_validation import Array
from ..case_definition import COUNT_SCALE, LOG_SCALE, CaseDefinition, MethodDefinition
from ..error_measures import simulate_to_end
from ..shared_scenes import beam_on_ground, compile_looped, row_hinges, uniform_beam

# --- linear-beam ----------------------------------------------------------------------------------

#: Duration of the spin-up, and of the run, s.
SPIN_UP_TIME, SPIN_T_END = 15.0, 30.0


def _deflection(spin: float, stiffening: bool, shapes: int) -> float:
    """Largest deflection of the tip in a run, m."""
    rate = spin / SPIN_UP_TIME
    ramp = f"{rate!r}*(t^2/2 + ({SPIN_UP_TIME}/(2*pi))^2*(cos(2*pi*t/{SPIN_UP_TIME}) - 1))"
    blade = {
        "name": "blade", "length": 10.0, "mass_per_length": 1.2, "bending_stiffness": 1.4e4,
        "modes": {"y": shapes}, "stiffening": stiffening,
    }  # fmt: skip
    drive = f"where(t < {SPIN_UP_TIME}, {ramp}, {spin!r}*(t - {SPIN_UP_TIME / 2}))"
    times = np.linspace(0.0, SPIN_T_END, 301)
    model = beam_on_ground(blade, {"type": "pin", "drive": drive})
    run = simulate_to_end(model, SPIN_T_END, "rodas4p2", rtol=1e-6, atol=1e-8, output_times=times)
    return float(np.abs(run.deflection("blade", "tip")[:, 1]).max())


def _spin_error(spin: float, stiffening: bool) -> float:
    exact = _deflection(spin, True, 6)
    deflection = _deflection(spin, stiffening, 3)
    return abs(deflection / exact - 1) if math.isfinite(deflection) else math.inf


LINEAR_BEAM = CaseDefinition(
    name="linear-beam",
    title="Linear beam: spin above its first frequency",
    cause="In the axes of a linear beam the centrifugal force increases every deflection. Nothing "
    "opposes it, because the shortening of the bent axis is neglected: at a spin equal to the "
    "first frequency the stiffness vanishes. With the shortening the spin stiffens the beam, as it "
    "should.",
    parameter="spin after 15 s", unit="rad/s", low=0.5, high=8.0, scale=LOG_SCALE,
    measured="error of the tip's largest deflection, relative", limit=1.0,
    method=MethodDefinition("stiffening = false, 3 shapes", lambda spin: _spin_error(spin, False)),
    remedy=MethodDefinition("stiffening = true, 3 shapes", lambda spin: _spin_error(spin, True)),
    reach=16.0,
    source="Kane, Ryan, Banerjee, Journal of Guidance, Control, and Dynamics 10, 1987; Simo, "
    "Vu-Quoc, Journal of Applied Mechanics 53, 1986",
)  # fmt: skip


# --- linear-weight --------------------------------------------------------------------------------

FALL_T_END, GRAVITY = 1.0, 9.81


def _falling_tip(
    weight: float, level: str | None = None, rtol: float = 1e-6, **of_beam: Any
) -> Array:
    """Path (n, 2), m, of the tip of a beam of 1 m and 1 kg with this weight, in EI/L^2."""
    beam = {
        "name": "rod", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": GRAVITY / weight,
    }  # fmt: skip
    pin = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod"}
    run = simulate_to_end(
        compile_looped(
            {"gravity": [0, -GRAVITY, 0], "beam": [beam | of_beam], "hinge": [pin]},
            flexibility=level,
        ),
        FALL_T_END, "rodas5p", rtol=rtol, atol=rtol / 100,
        output_times=np.linspace(0, FALL_T_END, 101),
    )  # fmt: skip
    return np.asarray(run.position("rod.tip")[:, :2])


@cache
def _exact_path(weight: float) -> tuple[Array, float]:
    """Exact path, by more shapes in the mean frame, and the largest error of a rigid rod (m)."""
    exact = _falling_tip(weight, rtol=1e-8, frame="mean", modes={"y": 6})
    rigid = _falling_tip(weight, "rigid", modes={"y": 6})
    return exact, float(np.abs(rigid - exact).max())


def _fall_error(weight: float, stiffening: bool) -> float:
    exact, rigid_error = _exact_path(weight)
    path = _falling_tip(weight, frame="tangent", modes={"y": 2}, stiffening=stiffening)
    return float(np.abs(path - exact).max()) / rigid_error


LINEAR_WEIGHT = CaseDefinition(
    name="linear-weight",
    title="Linear beam under its weight: worse than a rigid one",
    cause="In the axes of a pinned end only the bending stiffness of a falling beam opposes its "
    "weight and the centrifugal force. Linear equations neglect that the force along the beam "
    "stiffens it as it swings. Their correction of a rigid rod is then worse than none.",
    parameter="weight, in EI/L²", unit="", low=0.1, high=5.0, scale=LOG_SCALE,
    measured="tip path error in 1 s over that of a rigid rod", limit=1.0,
    method=MethodDefinition(
        "stiffening = false, 2 shapes", lambda weight: _fall_error(weight, False)
    ),
    remedy=MethodDefinition(
        "stiffening = true, 2 shapes", lambda weight: _fall_error(weight, True)
    ),
    reach=6.0,
    source="Kane, Ryan, Banerjee, Journal of Guidance, Control, and Dynamics 10, 1987; Sharf, "
    "Multibody System Dynamics 3, 1999",
)  # fmt: skip


# --- stiffened-mass -------------------------------------------------------------------------------

SHAPES = 4


def _lost_inertia(deflection: float, quadrature: bool) -> float:
    """Largest relative loss of inertia over all motions; above 1 the inertia is negative."""
    beam = uniform_beam(50.0, SHAPES, frame="tangent", stiffening=True, quadrature=quadrature)
    beam_model = beam_on_ground(beam, {"type": "pin"})
    straight, zeros = beam_model.initial_state()
    bent = straight.copy()
    bent[1] = 1e-3
    run = simulate_to_end(beam_model, 1e-6, initial=(bent, zeros), output_times=[0.0, 1e-6])
    bent[1] *= deflection / float(run.deflection("beam", "tip")[0, 1])
    inverse = np.linalg.inv(np.linalg.cholesky(beam_model.mass_matrix(straight)))
    eigenvalues = np.linalg.eigvalsh(inverse @ beam_model.mass_matrix(bent) @ inverse.T)
    return 1 - float(eigenvalues.min())


STIFFENED_MASS = CaseDefinition(
    name="stiffened-mass",
    title="Stiffened beam: inertia truncated after the second order",
    cause="Shortening makes the mass matrix of a beam depend on its deflection. Truncated after "
    "the second power, it subtracts more inertia than there is where shapes carry nearly all of "
    "it, as in a frame tangent to a rotating section. Accelerations then change their sign. Mass "
    "in points along the beam (`quadrature`), or the mean frame, keeps the matrix positive "
    "definite.",
    parameter="deflection of the tip of a pinned beam, relative to its length", unit="", low=5e-3,
    high=0.4, scale=LOG_SCALE,
    measured="lost part of the inertia", limit=1.0,
    method=MethodDefinition(
        f"tangent frame, {SHAPES} shapes, truncated", lambda d: _lost_inertia(d, False)
    ),
    remedy=MethodDefinition("the same with quadrature", lambda d: _lost_inertia(d, True)),
    reach=0.6,
    source="Kane, Ryan, Banerjee, Journal of Guidance, Control, and Dynamics 10, 1987; Shabana, "
    "Dynamics of Multibody Systems, 2020, ch. 5",
)  # fmt: skip


# --- single-frame ---------------------------------------------------------------------------------


@cache
def _tip_position(load: float, pieces: int, shapes: int) -> Array:
    """Static tip position of a clamped beam of 1 m and 1 N m2 under a transverse tip load (N)."""
    names = [f"piece{i}" for i in range(pieces)]
    end = f"{names[-1]}.tip"
    beam_model = compile_looped({
        "gravity": [0, 0, 0], "hinge": row_hinges(names, "fixed"),
        "beam": [uniform_beam(1.0, shapes, name, length=1 / pieces) for name in names],
        "load": [{"on": end, "force": [0, load, 0]}],
    })  # fmt: skip
    rest = beam_model.equilibrium(), np.zeros(beam_model.nu)
    run = simulate_to_end(beam_model, 1e-9, initial=rest, output_times=[0.0, 1e-9])
    return np.asarray(run.position(end)[0])


def _frame_error(load: float, pieces: int, shapes: int) -> float:
    return float(np.abs(_tip_position(load, pieces, shapes) - _tip_position(load, 12, 2)).max())


SINGLE_FRAME = CaseDefinition(
    name="single-frame",
    title="One floating frame: large deflections of a beam",
    cause="Shape functions are small deflections from a frame. One frame is accurate only as long "
    "as the sections of the beam rotate little against it: the relative error of the deflection is "
    "half the square of the slope. More shapes do not help; welded pieces with separate frames do.",
    parameter="load across the tip of a clamped beam, in EI/L²", unit="", low=0.02, high=10.0,
    scale=LOG_SCALE,
    measured="tip position error over the length", limit=0.01,
    method=MethodDefinition("one beam, 3 shapes", lambda load: _frame_error(load, 1, 3)),
    remedy=MethodDefinition(
        "6 welded pieces, 2 shapes each", lambda load: _frame_error(load, 6, 2)
    ),
    reach=10.0,
    source="Shabana, Dynamics of Multibody Systems, 2020, ch. 5 and 6; Rui, Wang, Zhang, Transfer "
    "Matrix Method for Multibody Systems, 2019, ch. 8",
)  # fmt: skip


# --- tangent-frame --------------------------------------------------------------------------------

STEP, STEPS = 1e-3, 200


def _largest_angle(shapes: float, frame: str) -> float:
    """Largest angle (rad) of the end of a beam of 1 m and 1 kg on a damped pin, from 1 rad/s."""
    pin = {"type": "pin", "law": {"damping": 1.0}, "initial": {"u": [1.0]}}
    beam_model = beam_on_ground(uniform_beam(1.0, int(shapes), frame=frame), pin)
    times = np.arange(STEPS + 1) * STEP
    run = simulate_to_end(beam_model, times[-1], "rk4", STEP, output_times=times)
    return float(np.abs(run.q[:, 0]).max())


TANGENT_FRAME = CaseDefinition(
    name="tangent-frame",
    title="Frame tangent to a beam at a pinned end",
    cause="Many clamped shapes together can nearly represent the rotation of a pinned beam without "
    "its frame. The inertia left for the frame falls with the third power of their number, and a "
    "damper in the pin then causes a motion faster than any of the beam. A chord frame, or the "
    "mean frame, has ten times more of the inertia.",
    parameter="shapes of a beam on a damped pin", unit="", low=1, high=20, scale=COUNT_SCALE,
    measured="largest angle of the pinned end, rad", limit=1.0,
    method=MethodDefinition(
        "tangent frame, rk4 with h = 1 ms", lambda n: _largest_angle(n, "tangent")
    ),
    remedy=MethodDefinition("mean frame, rk4 with h = 1 ms", lambda n: _largest_angle(n, "mean")),
    reach=20,
    source="Schwertassek, Wallrapp, Shabana, Flexible multibody simulation and choice of shape "
    "functions, Nonlinear Dynamics 20 (1999), pp. 361-380",
)  # fmt: skip


# --- one-way --------------------------------------------------------------------------------------

#: Inertia of the beam, 1 m and 1 kg, about the hub (kg*m2); duration of the torque (s).
BEAM_INERTIA, PULSE_DURATION = 1 / 3, 3.6

TIMES = np.linspace(0.0, 2 * PULSE_DURATION, 101)


def _tip_path(hub: float, level: str, shapes: int) -> tuple[Array, float]:
    """Path of the tip and its largest deflection, m, under a torque of one period."""
    torque = 0.02 * (hub + BEAM_INERTIA)
    center = {"name": "hub", "mass": 1.0, "inertia": [hub] * 3}
    arm = {
        "name": "arm", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 1.0,
        "modes": {"y": shapes},
    }  # fmt: skip
    law = {"effort": f"where(t < {PULSE_DURATION}, {torque!r}*sin(2*pi*t/{PULSE_DURATION}), 0)"}
    hinges = [
        {"name": "motor", "type": "pin", "inboard": "ground", "outboard": "hub", "law": law},
        {"name": "weld", "type": "fixed", "inboard": "hub", "outboard": "arm"},
    ]
    hub_model = compile_looped(
        {"gravity": [0, 0, 0], "body": [center], "beam": [arm], "hinge": hinges}, flexibility=level
    )
    run = simulate_to_end(hub_model, TIMES[-1], rtol=1e-8, atol=1e-10, output_times=TIMES)
    return run.position("arm.tip"), float(np.abs(run.deflection("arm", "tip")).max())


def _one_way_error(ratio: float, level: str) -> float:
    exact, deflection = _tip_path(ratio * BEAM_INERTIA, "coupled", 6)
    return float(np.abs(_tip_path(ratio * BEAM_INERTIA, level, 3)[0] - exact).max()) / deflection


ONE_WAY = CaseDefinition(
    name="one-way",
    title="One-way coupling: a beam that does not act on its hub",
    cause="A beam that only responds to the motion of a rigid run costs next to nothing, and is "
    "accurate as long as the body that carries it is heavy. Otherwise the hub moves with the "
    "vibration, which changes its frequency and size, and the response may be worse than none.",
    parameter="inertia of the hub over that of the beam", unit="", low=0.1, high=1e3,
    scale=LOG_SCALE,
    measured="error of the tip, relative to its deflection", limit=0.1,
    method=MethodDefinition("one-way, 3 shapes", lambda ratio: _one_way_error(ratio, "one-way")),
    remedy=MethodDefinition("coupled, 3 shapes", lambda ratio: _one_way_error(ratio, "coupled")),
    reach=0.1,
    source="Shabana, Dynamics of Multibody Systems, 2020, ch. 5 (linear theory of elastodynamics)",
)  # fmt: skip


CASES = (LINEAR_BEAM, LINEAR_WEIGHT, STIFFENED_MASS, SINGLE_FRAME, TANGENT_FRAME, ONE_WAY)
