"""Slow motions of many stiff bodies, against what bends give: nothing held counts as free."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse.linalg import LinearOperator, eigsh

import mstmm

COUNT, LENGTH, SPRING, INERTIA = 800, 0.1, 1e4, 1e-6


def rods(root: str) -> mstmm.Model:
    """Rods of 1 kg in a row on pins with springs; the first one is held, or floats in its plane."""
    rod = {"mass": 1.0, "center_of_mass": [LENGTH / 2, 0, 0], "inertia": [INERTIA] * 3,
           "ends": {"tip": [LENGTH, 0, 0]}}  # fmt: skip
    law = {"law": {"stiffness": SPRING}} if root == "pin" else {}
    scene = mstmm.Scene(
        gravity=(0, 0, 0), body=[{**rod, "name": "first"}],
        hinge=[{"name": "root", "type": root, "axis": [0, 0, 1], "inboard": "ground",
                "outboard": "first", **law}],
        chain=[{"name": "row", "count": COUNT - 1, "inboard": "first.tip", "end": "tip",
                "body": rod,
                "hinge": {"type": "pin", "axis": [0, 0, 1], "law": {"stiffness": SPRING}}}],
    )  # fmt: skip
    return mstmm.compile(scene, engine="looped")


def squares(held: bool, count: int) -> np.ndarray:
    """omega^2 of the slowest from bends of the row, whose efforts are SPRING times as large: angles
    are sums of bends, deflections sums of angles, and of what floats its mean motion is taken out.

    Nothing is subtracted that nearly cancels, as stiffness in deflections does.
    """
    places = LENGTH * np.arange(COUNT + 1)
    free = np.empty((0, COUNT + 1)) if held else np.array([np.ones(COUNT + 1), places])

    def momentum(y: np.ndarray) -> np.ndarray:
        middle, turn = (y[1:] + y[:-1]) / 2, INERTIA * np.diff(y) / LENGTH**2
        return np.append(0, middle / 2 + turn) + np.append(middle / 2 - turn, 0)

    carried = np.array([momentum(way) for way in free]).reshape(free.shape)
    inertia = free @ carried.T

    def inertial_bends(bends: np.ndarray) -> np.ndarray:
        turns = np.cumsum(bends if held else np.append(0, bends))
        y = np.append(0, LENGTH * np.cumsum(turns))
        pushed = momentum(y - free.T @ np.linalg.solve(inertia, carried @ y))
        efforts = LENGTH * np.cumsum(np.cumsum(pushed[:0:-1]))[::-1]
        return (efforts if held else efforts[1:]) / SPRING

    n = COUNT if held else COUNT - 1
    operator = LinearOperator((n, n), matvec=inertial_bends, dtype=np.float64)
    return np.sort(1 / eigsh(operator, count, v0=np.ones(n))[0])


@pytest.mark.parametrize("root", ["pin", "planar"])
def test_slow_motions_are_not_taken_for_free_ones(root: str) -> None:
    """Of omega^2 the slowest is 1e-15 of the fastest, which rounding of a matrix of masses would
    hide; what floats has three motions of frequency zero, not more."""
    free = 0 if root == "pin" else 3
    modes = rods(root).modes(free + 4)
    assert modes.is_complete and not modes.omega[:free].any()
    np.testing.assert_allclose(modes.omega[free:], np.sqrt(squares(root == "pin", 4)), rtol=1e-8)
