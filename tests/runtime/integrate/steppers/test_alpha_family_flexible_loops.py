"""Generalised alpha on rows of positions, with flexible bodies in the loops."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.array_validation import Array
from tests.system.loops.test_flexible_against_tree import SCENES
from tests.system.loops.test_flexible_constraints import ROWS, blade_model

#: Mass per length, length and bending stiffness of a beam; gravity so weak that its end stays.
HEAVY, LENGTH, STIFF, WEIGHT = 1.5, 1.2, 40.0, 0.01


def errors(model: mstmm.Model, method: str, end: float, steps: int) -> Array:
    """Of q and of u, the largest at ends of steps, beside DOP853, which closes loops behind its."""
    at: dict[str, Any] = {"rtol": 1e-11, "atol": 1e-12, "output_times": np.linspace(0.0, end, 11)}
    exact, run = model.simulate(end, **at), model.simulate(end, method, step=end / steps, **at)
    assert run.success, run.message
    closure = run.certificate.loop_closure
    assert closure is not None and closure.gap < 1e-13
    return np.array([np.abs(run.q - exact.q).max(), np.abs(run.u - exact.u).max()])


@pytest.mark.parametrize("method", ["genalpha-index3", "hht-index3"])
@pytest.mark.parametrize("name", sorted(SCENES))
def test_order_and_no_gap(name: str, method: str) -> None:
    model = mstmm.compile(mstmm.Scene(**SCENES[name][0]()), engine="looped")
    coarse, fine = (errors(model, method, 0.1, steps) for steps in (1600, 3200))
    print(name, coarse, fine, np.log2(coarse / fine))
    assert np.abs(np.log2(coarse / fine) - 2).max() < 0.1 and fine[0] < 1e-5


@pytest.mark.parametrize("name", ROWS)
def test_constraints_and_couplings(name: str) -> None:
    closing, ring, _ = ROWS[name]
    model = blade_model(ring, **closing)
    coarse, fine = (errors(model, "genalpha-index3", 0.2, steps) for steps in (400, 800))
    print(name, coarse, fine, np.log2(coarse / fine))
    assert np.abs(np.log2(coarse / fine) - 2).max() < 0.1 and fine[0] < 1e-4


def test_fused_code_does_as_looped() -> None:
    scene = mstmm.Scene(**SCENES["slider_crank"][0]())
    runs = [
        mstmm.compile(scene, engine=engine).simulate(0.01, "genalpha-index3", step=1e-4)
        for engine in ("looped", "fused")
    ]
    assert runs[1].success, runs[1].message
    for one, other in ((runs[0].q, runs[1].q), (runs[0].u, runs[1].u)):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-9)


def test_a_beam_that_slides_rings_as_its_shape_alone() -> None:
    """Between a pin and a slider on the ground no loop turns: the sine of a simply supported beam
    is one oscillator, of frequency (pi / L)^2 sqrt(EI / m), that rings about what weight makes of
    it: 4 m g / pi / (EI (pi / L)^4) (1 - cos(w t)) at the middle."""
    beam = {"name": "bar", "length": LENGTH, "mass_per_length": HEAVY, "bending_stiffness": STIFF,
            "modes": {"y": 1, "z": 0}, "frame": "chord", "basis": "simply-supported",
            "ends": {"middle": LENGTH / 2}}  # fmt: skip
    shoe = {"name": "shoe", "mass": 0.4, "inertia": [1e-3] * 3}
    hinges = [
        {"name": "root", "type": "pin", "inboard": "ground", "outboard": "bar"},
        {"name": "guide", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground",
         "outboard": "shoe", "initial": {"q": LENGTH}},
        {"name": "wrist", "type": "pin", "inboard": "bar.tip", "outboard": "shoe", "cut": True},
    ]  # fmt: skip
    scene = {"gravity": [0, -WEIGHT, 0], "body": [shoe], "beam": [beam], "hinge": hinges}
    model, end = mstmm.compile(mstmm.Scene(**scene)), 0.7
    run = model.simulate(
        end,
        mstmm.methods.GeneralizedAlpha("genalpha-index3", radius=0.9),
        step=1e-4,
        output_times=np.linspace(0.0, end, 8),
    )
    wave = np.pi / LENGTH
    speed = wave**2 * np.sqrt(STIFF / HEAVY)
    sag = 4 * HEAVY * WEIGHT / np.pi / (STIFF * wave**4)
    wanted = -sag * (1 - np.cos(speed * run.t))
    found = run.position("bar.middle")[:, 1]
    print(np.abs(found - wanted).max() / sag)
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-4 * sag)
