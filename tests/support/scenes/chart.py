"""Scenes that are charted in tests, and a clock that no machine moves."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ellipj, ellipk

import mstmm

GRAVITY, LENGTH, AMPLITUDE = 9.81, 1.0, 2.5  # m/s2, m, rad


def pendulum() -> mstmm.Scene:
    """A point mass on a massless rod of 1 m, let go at rest 2.5 rad from where it would hang."""
    body = {"name": "bob", "mass": 1.0, "center_of_mass": [LENGTH, 0, 0], "inertia": [0, 0, 0],
            "ends": {"tip": [LENGTH, 0, 0]}}  # fmt: skip
    pin = {"name": "pivot", "type": "pin", "inboard": "ground", "outboard": "bob",
           "initial": {"q": [AMPLITUDE - np.pi / 2]}}  # fmt: skip
    return mstmm.Scene(gravity=[0, -GRAVITY, 0], body=[body], hinge=[pin])


def swing(t: NDArray[np.float64], amplitude: float = AMPLITUDE) -> NDArray[np.float64]:
    """The pendulum's angle from where it hangs, rad, by Jacobi's elliptic functions.

    After a release at rest sin(angle / 2) = k sn(K - w t) with k = sin(amplitude / 2), w^2 = g / l
    (E. T. Whittaker, A Treatise on the Analytical Dynamics of Particles and Rigid Bodies, 1937,
    section 44).
    """
    k = np.sin(amplitude / 2)
    sn = ellipj(ellipk(k**2) - np.sqrt(GRAVITY / LENGTH) * t, k**2)[0]
    return np.asarray(2 * np.arcsin(k * sn))


def stiff_rods(stiffness: float = 1e8) -> mstmm.Scene:
    """A rod on a damped bushing, and another on a pin at its tip."""
    rod = {"mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [0.001, 0.084, 0.084],
           "ends": {"tip": [1, 0, 0]}}  # fmt: skip
    law = {"stiffness": [stiffness] * 3 + [stiffness, stiffness, 0.0], "damping": [1e3] * 5 + [0.0]}
    bushing = {"name": "bushing", "type": "elastic", "inboard": "ground", "outboard": "one",
               "law": law}  # fmt: skip
    elbow = {"name": "elbow", "type": "pin", "inboard": "one.tip", "outboard": "two"}
    return mstmm.Scene(
        gravity=[0, -GRAVITY, 0],
        body=[rod | {"name": "one"}, rod | {"name": "two"}], hinge=[bushing, elbow],
    )  # fmt: skip


def hub(drag: float = 0.0, **keys: Any) -> mstmm.Scene:
    """A hub turned to and fro, with a beam clamped to it that bends in the plane of the motion."""
    beam = {"name": "blade", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 20.0,
            "modes": {"y": 2}, "viscous_drag": drag} | keys  # fmt: skip
    motor = {"name": "motor", "type": "pin", "inboard": "ground", "outboard": "hub",
             "law": {"effort": "8*sin(2*pi*t/1.2)"}}  # fmt: skip
    clamp = {"name": "clamp", "type": "fixed", "inboard": "hub", "outboard": "blade"}
    body = {"name": "hub", "mass": 5.0, "inertia": [5.0, 5.0, 5.0]}
    return mstmm.Scene(gravity=[0, 0, 0], body=[body], beam=[beam], hinge=[motor, clamp])


class Clock:
    """Seconds that pass by themselves, so many at each look."""

    def __init__(self, at_each_look: float) -> None:
        self.now, self.step = 0.0, at_each_look

    def __call__(self) -> float:
        self.now += self.step
        return self.now
