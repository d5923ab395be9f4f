"""Rotation vectors integrated as if rotations could be added."""

from __future__ import annotations

from ...definition import Definition, Method
from ...measures import TURNING, error_of_turning
from ...scale import LOG
from ...variants import plain_charts

CASE = Definition(
    name="plain-charts",
    title="Rotation vectors whose rate is the angular velocity",
    why="Within a step an attitude may be described by a rotation vector, three numbers without "
    "a constraint. Its rate equals the angular velocity only where it is zero; elsewhere products "
    "of both are added. Without them every method falls to second order, whatever the order of its "
    "table. Runs keep two of them, enough for fifth order, or use quaternions.",
    parameter="length of a step", unit="s", low=2e-3, high=0.1, scale=LOG,
    measured=f"error of the attitude after {TURNING:g} s, rad", limit=1e-4,
    method=Method("rk4, the products left out", lambda h: error_of_turning(plain_charts.end_of, h)),
    remedy=Method("rk4", lambda h: error_of_turning("rk4", h)), reach=0.1,
    source="Munthe-Kaas, BIT 38, 1998; Brüls, Cardona, Arnold, Mechanism and Machine Theory 48, "
    "2012",
)  # fmt: skip
