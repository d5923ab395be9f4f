"""Linear beam in spin-up to higher and higher speeds."""

from __future__ import annotations

import math

import numpy as np

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import simulate_to_end
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import compile_looped

#: Duration of the spin-up, and of the run, s.
SPIN_UP_TIME, T_END = 15.0, 30.0


def _deflection(spin: float, stiffening: bool, shapes: int) -> float:
    """Largest deflection of the tip in a run, m."""
    rate = spin / SPIN_UP_TIME
    ramp = f"{rate!r}*(t^2/2 + ({SPIN_UP_TIME}/(2*pi))^2*(cos(2*pi*t/{SPIN_UP_TIME}) - 1))"
    blade = {
        "name": "blade", "length": 10.0, "mass_per_length": 1.2, "bending_stiffness": 1.4e4,
        "modes": {"y": shapes}, "stiffening": stiffening,
    }  # fmt: skip
    hub = {
        "name": "hub", "type": "pin", "inboard": "ground", "outboard": "blade",
        "drive": f"where(t < {SPIN_UP_TIME}, {ramp}, {spin!r}*(t - {SPIN_UP_TIME / 2}))",
    }  # fmt: skip
    times = np.linspace(0.0, T_END, 301)
    run = simulate_to_end(
        compile_looped({"gravity": [0, 0, 0], "beam": [blade], "hinge": [hub]}), T_END, "rodas4p2",
        rtol=1e-6, atol=1e-8, output_times=times,
    )  # fmt: skip
    return float(np.abs(run.deflection("blade", "tip")[:, 1]).max())


def _error(spin: float, stiffening: bool) -> float:
    exact = _deflection(spin, True, 6)
    deflection = _deflection(spin, stiffening, 3)
    return abs(deflection / exact - 1) if math.isfinite(deflection) else math.inf


CASE = CaseDefinition(
    name="linear-beam",
    title="Linear beam: spin above its first frequency",
    cause="In the axes of a linear beam the centrifugal force increases every deflection. Nothing "
    "opposes it, because the shortening of the bent axis is neglected: at a spin equal to the "
    "first frequency the stiffness vanishes. With the shortening the spin stiffens the beam, as it "
    "should.",
    parameter="spin after 15 s",
    unit="rad/s",
    low=0.5,
    high=8.0,
    scale=LOG_SCALE,
    measured="error of the tip's largest deflection, relative",
    limit=1.0,
    method=MethodDefinition("stiffening = false, 3 shapes", lambda spin: _error(spin, False)),
    remedy=MethodDefinition("stiffening = true, 3 shapes", lambda spin: _error(spin, True)),
    reach=16.0,
    source="Kane, Ryan, Banerjee, Journal of Guidance, Control, and Dynamics 10, 1987; Simo, "
    "Vu-Quoc, Journal of Applied Mechanics 53, 1986",
)
