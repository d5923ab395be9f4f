"""The spatial slider-crank of the IFToMM library of multibody benchmarks, between two balls.

After E. J. Haug, Computer Aided Kinematics and Dynamics of Mechanical Systems, 1989.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

import mstmm

CRANK, ROD, ALONG, UP = 0.08, 0.3, 0.1, 0.12
MASSES = {"crank": 0.12, "rod": 0.5, "slider": 2.0}
SWING, AXIAL, SPEED = 0.004, 0.0004, 6.0
TIMES = np.linspace(0.0, 2.0, 41)


def slider_crank() -> mstmm.Scene:
    """The crank upright at the start, the slider 0.2 m along x."""
    along = np.array([0.2, -ALONG, -UP - CRANK]) / ROD
    half = np.array([1.0 + along[0], *np.cross([1, 0, 0], along)])
    return mstmm.Scene(
        gravity=[0, 0, -9.81],
        body=[
            {"name": "crank", "mass": MASSES["crank"], "center_of_mass": [0, 0, CRANK / 2],
             "inertia": [1e-4, 1e-4, 1e-5], "ends": {"tip": [0, 0, CRANK]}},
            {"name": "rod", "mass": MASSES["rod"], "center_of_mass": [ROD / 2, 0, 0],
             "inertia": [AXIAL, SWING, SWING], "ends": {"tip": [ROD, 0, 0]}},
            {"name": "slider", "mass": MASSES["slider"], "inertia": [1e-4, 1e-4, 1e-4]},
        ],
        hinge=[
            {"name": "shaft", "type": "pin", "axis": [1, 0, 0], "inboard": "ground",
             "outboard": "crank", "position": [0, ALONG, UP], "initial": {"u": SPEED},
             "hold": True},
            {"name": "rail", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground",
             "outboard": "slider", "initial": {"q": 0.15}},
            {"name": "ball", "type": "ball", "inboard": "crank.tip", "outboard": "rod",
             "initial": {"q": [float(x) for x in half / np.linalg.norm(half)]}},
            {"name": "closing", "type": "ball", "inboard": "rod.tip", "outboard": "slider"},
        ],
    )  # fmt: skip


def places(angle: Any) -> tuple[Any, Any, Any]:
    """Of the crank's tip across the rail, and of the slider along it."""
    y, z = ALONG - CRANK * np.sin(angle), UP + CRANK * np.cos(angle)
    return y, z, np.sqrt(ROD**2 - y**2 - z**2)


def inertia_and_height(angle: Any) -> tuple[Any, Any]:
    """Of one coordinate, the angle of the crank: a rod on balls does not turn about itself."""
    y, z, x = places(angle)
    dy, dz = -CRANK * np.cos(angle), -CRANK * np.sin(angle)
    dx = -(y * dy + z * dz) / x
    across = dy**2 + dz**2
    mass = 1e-4 + MASSES["crank"] * CRANK**2 / 4 + MASSES["slider"] * dx**2
    mass = mass + MASSES["rod"] * (dx**2 + across) / 4 + SWING * (dx**2 + across) / ROD**2
    return mass, MASSES["crank"] * (UP + z) / 2 + MASSES["rod"] * z / 2


def angles() -> np.ndarray:
    """Of the crank at TIMES, by Lagrange's equation."""

    def rates(_: float, y: Any) -> list[float]:
        mass, _ = inertia_and_height(y[0])
        slope, rise = (part.imag / 1e-30 for part in inertia_and_height(y[0] + 1e-30j))
        return [y[1], -(slope * y[1] ** 2 / 2 + 9.81 * rise) / mass]

    done = solve_ivp(
        rates, (0.0, TIMES[-1]), [0.0, SPEED], "DOP853", t_eval=TIMES, rtol=1e-12, atol=1e-12
    )
    return np.asarray(done.y[0])


def test_the_start_is_that_of_the_library() -> None:
    """At 6 rad/s the slider begins at 0.2 m with 0.24 m/s."""
    model = mstmm.compile(slider_crank())
    assert (model.loops.rank, len(model.loops.constraint_rows), model.loops.mobility) == (3, 3, 2)
    result = model.simulate(0.0)
    assert abs(result.position("slider")[0, 0] - 0.2) < 1e-12
    assert np.abs(result.velocity("slider")[0] - [0.24, 0, 0]).max() < 1e-12
    middle = (result.velocity("rod")[0] + result.velocity("rod.tip")[0]) / 2
    assert np.abs(middle - [0.12, -0.24, 0]).max() < 1e-12


def test_the_slider_follows_lagrange() -> None:
    model = mstmm.compile(slider_crank())
    result = model.simulate(TIMES[-1], "dop853", rtol=1e-10, atol=1e-12, output_times=TIMES)
    assert result.success, result.message
    wanted = angles()
    assert np.abs(result.quantity("shaft.angle").values - wanted).max() < 1e-7
    assert np.abs(result.position("slider")[:, 0] - places(wanted)[2]).max() < 1e-8
