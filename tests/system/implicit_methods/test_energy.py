"""The energy of an oscillator by methods that damp what they do not resolve, and by those that do
not."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.array_validation import Array
from mstmm.runtime.integrate.steppers import get

COUNT = 200


def energy(frequency: float, method: str, radius: float | None = None) -> Array:
    """Of 1 kg on a spring, over steps of 1 s, in that of the start; `frequency` in rad/s."""
    hinge = {
        "name": "spring", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground",
        "outboard": "mass", "initial": {"q": [1.0], "u": [0.3]},
        "law": {"stiffness": frequency**2},
    }  # fmt: skip
    body = {"name": "mass", "mass": 1.0}
    scene = mstmm.Scene(gravity=(0, 0, 0), body=[body], hinge=[hinge])
    model = mstmm.compile(scene, engine="looped")
    run = model.simulate(COUNT, mstmm.methods.GeneralizedAlpha(method, radius=radius), 1.0)
    assert run.success, run.message
    found = np.asarray(run.energy())
    return np.asarray(found / found[0])


@pytest.mark.parametrize(
    "method, radius", [("newmark", None), ("genalpha", 1.0), ("dttmm", 1.0), ("exprb32", None)]
)
def test_without_damping_the_energy_stays(method: str, radius: float | None) -> None:
    for frequency in (0.1, 1.0, 10.0, 100.0):
        assert energy(frequency, method, radius) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("frequency", [0.3, 1.0, 3.0, 30.0])
@pytest.mark.parametrize(
    "method, radius",
    [("genalpha", 0.95), ("genalpha", 0.8), ("genalpha", 0.5), ("dttmm", 0.8), ("hht", None),
     ("rodas4p2", None), ("rodas5p", None), ("esdirk436", None), ("kvaerno5", None)],
)  # fmt: skip
def test_damped_energy_only_leaves(method: str, radius: float | None, frequency: float) -> None:
    """It leaves at the rate that the method's amplification says, and never comes back."""
    found = energy(frequency, method, radius)
    factor = abs(complex(get(method, radius).amplification(1j * frequency)))
    assert factor < 1.0
    lost = 2 * COUNT * np.log(factor)
    if lost > -500:  # below, nothing is left that numbers hold
        assert np.log(found[-1]) == pytest.approx(lost, abs=0.05 * abs(lost) + 0.1)
    peaks = found.reshape(-1)[1:].reshape(5, -1).max(axis=1)
    assert np.all(np.diff(peaks) <= 1e-12)
    assert found[-1] < 1.0


def test_a_smaller_radius_damps_more() -> None:
    left: list[Any] = [energy(3.0, "genalpha", radius)[10] for radius in (1.0, 0.95, 0.8, 0.5)]
    assert left == sorted(left, reverse=True)
