"""Rotation vectors that forget that rotations do not add."""

from __future__ import annotations

import numpy as np

from ....arrays import Array
from ...definition import Definition, Method
from ...measures import simulated
from ...scale import LOG
from ...scenes import spinning_top
from ...variants import plain_charts

#: Length of a run, s, and the angular velocity of the body, rad/s.
T_END, SPIN = 2.0, (0.4, 1.6, 1.1)


def _angle(attitude: Array, other: Array) -> float:
    """Between two attitudes, rad."""
    return 2 * float(np.linalg.norm(attitude * np.sign(attitude @ other) - other))


def _error(step: float, charts: bool) -> float:
    top, steps = spinning_top("ball", SPIN), round(T_END / step)
    step = T_END / steps
    exact = simulated(top, T_END, rtol=1e-12, atol=1e-14, output_times=[T_END]).q[-1]
    if charts:
        return _angle(plain_charts.end_of(top, step, steps), exact)
    return _angle(simulated(top, T_END, "rk4", step, output_times=[T_END]).q[-1], exact)


CASE = Definition(
    name="plain-charts",
    title="Rotation vectors whose rate is the angular velocity",
    why="Within a step an attitude may be told by a rotation vector, three numbers without a tie. "
    "Its rate is the angular velocity only where it is zero; beyond, products of both come in. "
    "Without them every method falls to second order, whatever its table promises. Runs keep two "
    "of them, enough for fifth order, or go by quaternions.",
    parameter="length of a step", unit="s", low=2e-3, high=0.1, scale=LOG,
    measured="error of the attitude after 2 s, rad", limit=1e-4,
    method=Method("rk4, the products left out", lambda step: _error(step, True)),
    remedy=Method("rk4", lambda step: _error(step, False)), reach=0.1,
    source="Munthe-Kaas, BIT 38, 1998; Brüls, Cardona, Arnold, Mechanism and Machine Theory 48, "
    "2012",
)  # fmt: skip
