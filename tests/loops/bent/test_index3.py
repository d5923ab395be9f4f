"""Generalised alpha on rows of positions, with flexible bodies in the loops."""

from __future__ import annotations

import numpy as np
import pytest

import mstmm

from .test_against_tree import SCENES

#: Mass per length, length and bending stiffness of a beam; gravity so weak that its end stays.
HEAVY, LENGTH, STIFF, WEIGHT = 1.5, 1.2, 40.0, 0.01


@pytest.mark.parametrize("name", sorted(SCENES))
def test_order_and_no_gap(name: str) -> None:
    """Against a run by DOP853, whose loops are closed behind its steps."""
    model = mstmm.compile(mstmm.Scene(**SCENES[name][0]()), engine="looped")
    end = 0.1
    exact = model.simulate(end, rtol=1e-11, atol=1e-12, output_times=[0.0, end])
    errors = []
    for steps in (1600, 3200):  # the shapes vibrate
        run = model.simulate(
            end, "genalpha-index3", step=end / steps, rtol=1e-11, atol=1e-12,
            output_times=[0.0, end],
        )  # fmt: skip
        assert run.success, run.message
        closure = run.certificate.closure
        assert closure is not None and closure.gap < 1e-14
        errors.append([
            np.abs(run.q[-1] - exact.q[-1]).max(), np.abs(run.u[-1] - exact.u[-1]).max()
        ])  # fmt: skip
    orders = np.log2(np.array(errors[0]) / errors[1])
    print(name, errors, orders)
    assert orders.min() > 1.8 and orders[0] < 2.2


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
        end, "genalpha-index3", step=1e-4, radius=0.9, output_times=np.linspace(0.0, end, 8)
    )
    wave = np.pi / LENGTH
    speed = wave**2 * np.sqrt(STIFF / HEAVY)
    sag = 4 * HEAVY * WEIGHT / np.pi / (STIFF * wave**4)
    wanted = -sag * (1 - np.cos(speed * run.t))
    found = run.position("bar.middle")[:, 1]
    print(np.abs(found - wanted).max() / sag)
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-4 * sag)
