"""Rotation vectors that forget that rotations do not add."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

from ....arrays import Array
from ....runtime.model.model import Model
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


@cache
def _exact() -> tuple[Model, Array]:
    """The body, and its attitude at the end."""
    top = spinning_top("ball", SPIN)
    return top, simulated(top, T_END, rtol=1e-13, atol=1e-15, output_times=[T_END]).q[-1]


def error_of(method: str | Callable[[Model, float, int], Array], step: float) -> float:
    """Of the attitude at the end by steps of about this length (s), rad; of a method of runs, or of
    a function of the model, the step and their number."""
    (top, exact), steps = _exact(), round(T_END / step)
    step = T_END / steps
    if callable(method):
        return _angle(method(top, step, steps), exact)
    return _angle(simulated(top, T_END, method, step, output_times=[T_END]).q[-1], exact)


CASE = Definition(
    name="plain-charts",
    title="Rotation vectors whose rate is the angular velocity",
    why="Within a step an attitude may be told by a rotation vector, three numbers without a tie. "
    "Its rate is the angular velocity only where it is zero; beyond, products of both come in. "
    "Without them every method falls to second order, whatever its table promises. Runs keep two "
    "of them, enough for fifth order, or go by quaternions.",
    parameter="length of a step", unit="s", low=2e-3, high=0.1, scale=LOG,
    measured="error of the attitude after 2 s, rad", limit=1e-4,
    method=Method("rk4, the products left out", lambda step: error_of(plain_charts.end_of, step)),
    remedy=Method("rk4", lambda step: error_of("rk4", step)), reach=0.1,
    source="Munthe-Kaas, BIT 38, 1998; Brüls, Cardona, Arnold, Mechanism and Machine Theory 48, "
    "2012",
)  # fmt: skip
