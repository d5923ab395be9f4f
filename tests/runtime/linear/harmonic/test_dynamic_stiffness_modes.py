"""Frames of welded beams against the exact dynamic stiffness of Euler and Bernoulli's beam."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

import mstmm
from mstmm.runtime.linear.mode_solvers import ModeCounter
from tests.support.scenes.linear import UNIT


def spans(count: int) -> mstmm.Scene:
    """Unit beams in a row, clamped at the first end; at the end of each a mass of 0.5 on a spring
    of 2000 to the ground, across."""
    beams, bodies, hinges, springs = [], [], [], []
    for k in range(count):
        beams.append({"name": f"beam{k}", **UNIT, "modes": {"y": 6}})
        bodies.append({"name": f"mass{k}", "mass": 0.5, "inertia": [1e-12] * 3})
        before = f"mass{k - 1}" if k else "ground"
        hinges += [
            {"name": f"in{k}", "type": "fixed", "inboard": before, "outboard": f"beam{k}"},
            {"name": f"on{k}", "type": "fixed", "inboard": f"beam{k}.tip", "outboard": f"mass{k}"},
        ]
        springs.append(
            {"name": f"spring{k}", "from": "ground", "to": f"mass{k}", "position": [k + 1, -1, 0],
             "law": {"stiffness": 2e3, "rest": 1.0}}
        )  # fmt: skip
    return mstmm.Scene(gravity=(0, 0, 0), beam=beams, body=bodies, hinge=hinges, spring=springs)


@pytest.mark.parametrize(("count", "below"), [(2, 3), (4, 7), (8, 15), (16, 31), (64, 127)])
def test_no_mode_of_many_spans_is_missed(count: int, below: int) -> None:
    """Below beta = 6.5, where the determinant of transfer matrices changes its sign thousands of
    times: 2 n - 1, as many as finite elements and the exact dynamic stiffness count."""
    linear = mstmm.compile(spans(count), engine="looped").linearize(disturbances=())
    assert ModeCounter(linear.operators).count_below(6.5**4) == below
    if count <= 16:
        assert np.count_nonzero(linear.modes().omega < 6.5**2) == below


def corner_determinant(beta: float) -> float:
    """Of two unit beams at a right angle, the first clamped, without stretch: zero at sqrt(omega).

    w = a (cosh - cos) + b (sinh - sin) along the first, v = c (cosh - cos) + d sinh + e sin along
    the second, which the corner carries along as a mass of 1.
    """
    ch, sh, co, si = np.cosh(beta), np.sinh(beta), np.cos(beta), np.sin(beta)
    rows = [
        [sh + si, ch - co, 0, -1, -1],  # one rotation of the corner
        [ch + co, sh + si, -2, 0, 0],  # one moment
        [sh - si + beta * (ch - co), ch + co + beta * (sh - si), 0, 0, 0],  # shear of the first
        [0, 0, ch + co, sh, -si],  # no moment at the tip
        [0, 0, sh - si, ch, -co],  # no shear there
    ]
    return float(np.linalg.det(np.array(rows)))


def test_a_frame_with_a_corner() -> None:
    """An L of two beams, in its plane."""
    grid = np.linspace(0.3, 8.5, 400)
    values = [corner_determinant(x) for x in grid]
    exact = [
        brentq(corner_determinant, a, b) ** 2
        for a, b, f, g in zip(grid[:-1], grid[1:], values[:-1], values[1:], strict=True)
        if f * g < 0
    ]
    scene = mstmm.Scene(
        gravity=(0, 0, 0),
        beam=[{"name": name, **UNIT, "modes": {"y": 8}} for name in ("post", "arm")],
        hinge=[
            {"name": "foot", "type": "fixed", "inboard": "ground", "outboard": "post"},
            {"name": "corner", "type": "fixed", "inboard": "post.tip", "outboard": "arm",
             "orientation": [np.sqrt(0.5), 0, 0, np.sqrt(0.5)]},
        ],
    )  # fmt: skip
    model = mstmm.compile(scene, engine="looped")
    modes, counted = model.modes(4), model.dynamic_stiffness_modes(len(exact))
    assert len(exact) >= 4
    np.testing.assert_allclose(modes.omega, exact[:4], rtol=2e-6)
    np.testing.assert_allclose(counted.omega, exact, rtol=1e-10)
    assert counted.coordinates == ("post.y1", "post.y2", "arm.y1", "arm.y2")
    np.testing.assert_allclose(np.abs(counted.shapes).max(axis=0), 1.0)
