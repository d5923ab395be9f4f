"""Linear models of closed loops with flexible bodies, at rest."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from reference.compare import worst
from reference.jets import Array

import mstmm

from .test_against_tree import shackled, slider_crank

LENGTH, STIFFNESS, DENSITY = 2.0, 300.0, 1.5
STEP = 1e-5


def held(end: str) -> mstmm.Model:
    """A beam clamped to the ground whose other end a hinge holds on a rail."""
    rail = {"name": "guide", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground",
            "outboard": "slider", "initial": {"q": LENGTH}}  # fmt: skip
    beam = {"name": "bar", "length": LENGTH, "mass_per_length": DENSITY,
            "bending_stiffness": STIFFNESS, "modes": {"y": 8, "z": 0}, "frame": "tangent",
            "basis": "static+fixed-interface"}  # fmt: skip
    return mstmm.compile(mstmm.Scene(
        gravity=[0, 0, 0], beam=[beam],
        body=[{"name": "slider", "mass": 0.8, "inertia": [1e-3, 1e-3, 1e-3]}],
        hinge=[{"name": "root", "type": "fixed", "inboard": "ground", "outboard": "bar"}, rail,
               {"name": "end", "type": end, "inboard": "bar.tip", "outboard": "slider",
                "cut": True}],
    ))  # fmt: skip


@pytest.mark.parametrize(
    ("end", "roots", "bound"),
    [("fixed", [4.730040744862704, 7.853204624095838, 10.995607838001671], 1e-12),
     ("pin", [3.926602312047919, 7.068582745628732], 1e-5)],
)  # fmt: skip
def test_beams_held_at_both_ends(end: str, roots: list[float], bound: float) -> None:
    """Zeros of cos x cosh x = 1 and tan x = tanh x; shapes of held ends are the former."""
    wanted = np.square(roots) * np.sqrt(STIFFNESS / DENSITY) / LENGTH**2
    modes = held(end).modes()
    assert worst(modes.omega[: len(roots)], wanted) < bound
    assert modes.strain()["bar"] == pytest.approx(1.0)


@pytest.mark.parametrize("make", [slider_crank, shackled])
def test_matrices_are_slopes_of_accelerations(make: Any) -> None:
    """Beside rest under weight, by central differences between closed states."""
    model = mstmm.compile(mstmm.Scene(**make()))
    linear = model.linearize(inputs=["bar.tip.fy"])
    loops, q, still = linear.mechanism, linear.state.q, np.zeros(model.nu)
    n, places, memory = len(linear), list(linear.free), model.looped.start_memory()
    assert loops is not None

    def beside(x: Array) -> Array:
        moved = q + model.looped.rates(0.0, q, loops.ways @ x, memory)
        return model.accelerations(model.assemble(moved, still)[0], still)[places]

    slopes = [(beside(x) - beside(-x)) / (2 * STEP) for x in STEP * np.eye(n)]
    assert worst(np.array(slopes).T, linear.A[n:, :n]) < 1e-6
    whole = linear.elastic + linear.geometric + linear.load
    assert worst(whole, linear.K) < 1e-12

    omega, outputs = np.array([3.0, 40.0]), ["bar.tip.position.y", "wrist.angle_rate"]
    found = linear.frequency_response(omega, outputs=outputs, structural=0.05)
    c = linear.output_matrices(outputs)[0]
    for k, s in enumerate(1j * omega):
        stiff = linear.K + 0.05j * linear.elastic
        x = np.linalg.solve(s**2 * linear.M + s * linear.C + stiff, linear.V)
        wanted = c[:, :n] @ x + c[:, n:] @ (s * x)
        assert np.abs(found.values[k] - wanted).max() < 1e-9 * np.abs(wanted).max()
