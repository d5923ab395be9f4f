"""A crane whose trolley follows a recorded route, in gusts: signals, inputs and outputs.

Statement: with the trolley at x(t), the cubic spline through the recorded places, the load hangs as
a pendulum on a driven point, J theta'' + b theta' + M c (g sin theta + x'' cos theta) = F L cos
theta, with the gust F held from row to row and the brake b; and the motor gives what trolley, rope
and load take.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

import mstmm

SCENE = Path(__file__).with_name("scene.toml")
G, ROPE, LOAD, ROPE_MASS, TROLLEY = 9.81, 3.0, 40.0, 2.0, 120.0
INERTIA = ROPE_MASS * ROPE**2 / 3 + LOAD * ROPE**2 + 4.0
MOMENT = ROPE_MASS * ROPE / 2 + LOAD * ROPE  # mass times distance of the mass centre
END = 8.0
Array = NDArray[np.float64]


def pendulum(
    times: Array, x: CubicSpline, gusts: Array, knots: Array, brake: float
) -> tuple[Array, Array, Array]:
    """theta, its rate and the force of the rail motor by the equations above, from row to row."""
    state, found = np.zeros(2), []

    def turning(t: float, y: Array, gust: float) -> Array:
        moved = MOMENT * (G * np.sin(y[0]) + x(t, 2) * np.cos(y[0]))
        return np.array([y[1], (gust * ROPE * np.cos(y[0]) - moved - brake * y[1]) / INERTIA])

    for a, b, gust in zip(knots, knots[1:], gusts, strict=False):
        inside = times[(times >= a) & ((times < b) | (b == END))]
        run = solve_ivp(turning, (a, b), state, "DOP853", np.append(inside[inside < b], b),
                        rtol=1e-11, atol=1e-12, args=(gust,))  # fmt: skip
        state = run.y[:, -1]
        for t, y in zip(run.t, run.y.T, strict=True):
            if t < b or b == END:
                turn = turning(t, y, gust)[1]
                swung = MOMENT * (turn * np.cos(y[0]) - y[1] ** 2 * np.sin(y[0]))
                total = TROLLEY + ROPE_MASS + LOAD
                found.append((*y, total * x(t, 2) + swung - gust))
    theta, rate, force = np.array(found).T
    return theta, rate, force


def main() -> None:
    """Run it as it is, with a brake, and in calm air, and compare."""
    with SCENE.with_name("route.csv").open() as file:
        table = csv.DictReader(file)
        rows = [[float(row[key]) for key in ("time", "place", "gust")] for row in table]
    knots, places, gusts = np.array(rows).T
    x = CubicSpline(knots, places)
    model = mstmm.compile(mstmm.load_scene(SCENE))
    times = np.linspace(0, END, 321)
    for brake, wind in ((0.0, "gusts"), (150.0, "gusts"), (0.0, 0.0)):
        result = model.simulate(
            END, rtol=1e-10, atol=1e-12, output_times=times, inputs={"brake": brake, "wind": wind}
        )
        assert result.success, result.message
        blown = gusts if wind == "gusts" else 0 * gusts
        theta, rate, force = pendulum(times, x, blown, knots, brake)
        found = result.outputs()
        sway = float(abs(found["sway"] - np.degrees(theta)).max())
        ahead = float(abs(found["ahead"] - ROPE * np.sin(theta)).max())
        power = float(abs(found["motor_power"] - force * x(times, 1)).max())
        print(f"brake {brake:g} N m s, wind {wind}: sway up to {abs(found['sway']).max():.2f} deg")
        print(f"  apart: sway {sway:.1e} deg, ahead {ahead:.1e} m, power {power:.1e} W")
        assert abs(result.speeds("swing")[:, 0] - rate).max() < 1e-8
        assert sway < 1e-6 and ahead < 1e-8 and power < 1e-6
        balance = float(np.ptp(result.energy() - result.work))
        assert balance < 1e-6, balance


if __name__ == "__main__":
    main()
