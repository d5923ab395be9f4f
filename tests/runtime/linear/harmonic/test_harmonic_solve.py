"""Frequency responses of states that turn balls, against Euler's equations."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import mstmm
from mstmm.errors import SceneError

A, B, C, SPIN = 1.0, 1.4, 2.0, 3.0


@cache
def top(across: float) -> mstmm.Model:
    """A body on a ball at its center of mass, with an arm along its axis of spin."""
    body = {"name": "top", "mass": 1.0, "inertia": [A, across, C], "ends": {"tip": [0, 0, 0.5]}}
    ball = {"name": "point", "type": "ball", "inboard": "ground", "outboard": "top"}
    scene = mstmm.Scene(gravity=(0, 0, 0), body=[body], hinge=[ball])
    return mstmm.compile(scene, engine="looped")


def test_a_moment_on_a_body_that_spins() -> None:
    """A wx' + (C - B) W wy = m and B wy' + (A - C) W wx = 0, in axes of the body."""
    linear = top(B).linearize([1, 0, 0, 0], [0, 0, SPIN])
    omega = np.array([0.3, 2.0, 7.0])
    names = ["point.wx", "point.wy", "point.wx_increment"]
    found = linear.frequency_response(omega, ["point.effort_wx"], names)
    s = 1j * omega
    below = A * B * s**2 - (C - B) * (A - C) * SPIN**2
    wx, wy = B * s / below, (C - A) * SPIN / below
    expected = np.array([wx, wy, (s * wx + SPIN * wy) / (s**2 + SPIN**2)]).T
    np.testing.assert_allclose(found.response[:, :, 0], expected, rtol=1e-9)


def test_what_goes_round_is_refused() -> None:
    """A force in inertial axes changes along the motion, in the axes of the body; and about an
    axis that is none of its own the body does not spin steadily."""
    steady, changes = top(B).linearize([1, 0, 0, 0], [0, 0, SPIN]), "not constant along .* state: "
    with pytest.raises(SceneError, match=rf"{changes}top\.tip\.force\.x, .*speeds of hinges"):
        steady.frequency_response([1.0], ["top.tip.fx"], ["point.wx"])
    with pytest.raises(SceneError, match=rf"{changes}top\.tip\.position\.y"):
        steady.frequency_response([1.0], ["point.effort_wx"], ["top.tip.y"])
    tumbling = top(B).linearize([1, 0, 0, 0], [0.5, 0, SPIN])
    with pytest.raises(SceneError, match=f"{changes}.*point.wy_increment"):
        tumbling.frequency_response([1.0], ["point.effort_wx"], ["point.wx"])
    with pytest.raises(SceneError, match="exact: a ball, free or similar hinge rotates"):
        steady.frequency_response([1.0], ["point.effort_wx"], exact=True)
