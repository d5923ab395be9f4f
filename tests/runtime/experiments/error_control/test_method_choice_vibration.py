"""How far fast motions are excited at the start: masses on springs, by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

import mstmm
from mstmm.runtime.experiments.error_control.error_extrapolation import Kind
from mstmm.runtime.experiments.error_control.method_choice import (
    Family,
    Vibration,
    initial_vibration,
)
from mstmm.runtime.integrate.settings import Settings

_ASKED = 1e-6


def weight(k: float, zeta: float, mass: float = 2.0) -> mstmm.Model:
    """A mass let go on a slack spring of k N/m, in gravity."""
    law = {"stiffness": k, "damping": 2 * zeta * math.sqrt(k * mass)}
    body = {"name": "mass", "mass": mass, "inertia": [1.0, 1.0, 1.0]}
    slide = {
        "name": "slide", "type": "prismatic", "axis": [0.0, 1.0, 0.0], "inboard": "ground",
        "outboard": "mass", "law": law,
    }  # fmt: skip
    scene = mstmm.Scene(schema_version=1, gravity=[0.0, -9.81, 0.0], body=[body], hinge=[slide])
    return mstmm.compile(scene, engine="looped")


def vibration_from_start(model: mstmm.Model, span: float, few: float = 0.0) -> Vibration:
    return initial_vibration(model, 0.0, *model.initial_state(), span, few)


def test_an_undamped_one_lasts_to_the_end() -> None:
    found = vibration_from_start(weight(5e3, 0.0), 10.0)
    assert found.rate == pytest.approx(50.0, rel=1e-6)
    assert found.radians(_ASKED) == pytest.approx(500.0, rel=1e-6)
    assert found.radians_above_speed(_ASKED) == pytest.approx(500.0, rel=1e-6)


def test_a_damped_one_lasts_until_it_has_fallen_to_what_is_asked() -> None:
    """The two motions s = -zeta w +- i w (1 - zeta^2)^(1/2) share an amplitude: that of a start at
    rest, x0 = m g / k, is x0 / (2 (1 - zeta^2)^(1/2)) for each.  Of the only length of a scene its
    largest part counts, so that what is asked is asked of it."""
    zeta = 0.05
    found = vibration_from_start(weight(5e3, zeta), 100.0)
    assert found.radians(_ASKED) == pytest.approx(math.log(1 / _ASKED) / zeta, rel=1e-6)
    assert found.radians(2.0) == 0.0
    assert found.fastest_damping == pytest.approx(zeta, rel=1e-6)
    assert found.races(1 / 101) and not found.races(1 / 99)  # its part is 1, of the only length


def test_an_angle_is_measured_in_rad() -> None:
    rod = {
        "name": "rod", "mass": 1.0, "center_of_mass": [0.5, 0.0, 0.0], "inertia": [0.01, 0.1, 0.1],
    }  # fmt: skip
    pin = {
        "name": "pin", "type": "pin", "axis": [0.0, 0.0, 1.0], "inboard": "ground",
        "outboard": "rod", "law": {"stiffness": 1e5},
    }  # fmt: skip
    scene = mstmm.Scene(schema_version=1, gravity=[0.0, -9.81, 0.0], body=[rod], hinge=[pin])
    found = vibration_from_start(mstmm.compile(scene, engine="looped"), 1.0)
    static = 9.81 * 0.5 / 1e5
    assert found.position_amplitudes.max() == pytest.approx(static / 2, rel=1e-3)
    assert found.fastest_damping == pytest.approx(0.0, abs=1e-6)
    assert found.radians(static) == 0.0
    assert found.radians(static / 3) == pytest.approx(found.rate, rel=1e-6)
    assert found.unresolved_amplitude(10) == found.position_amplitudes.max()
    assert found.unresolved_amplitude(1000) == 0.0


def test_of_slow_motion_the_rate_alone_is_looked_up() -> None:
    found = vibration_from_start(weight(5e3, 0.0), 10.0, few=501.0)
    assert not found.has_motions and found.rate == pytest.approx(50.0, rel=1e-6)
    assert found.radians(_ASKED) == found.rate * found.span
    assert not len(found.rates) and not np.any(found.position_amplitudes)


@pytest.mark.parametrize(
    ("zeta", "error", "method"),
    [(0.1, 1e-3, "dopri5"), (0.0, 1e-3, "dopri5"), (0.1, 0.5, "dopri5"), (0.0, 0.5, "dop853")],
)
def test_where_explicit_steps_damp_errors_the_lower_order_is_taken(
    zeta: float, error: float, method: str
) -> None:
    """Of motions that are damped, or far above what is asked: here the part is 1 or 1/2."""
    model = weight(5e3, zeta)
    found = Family(model, Settings(10.0, method="auto"), error, *model.initial_state())
    assert found.method(Kind.EXPLICIT, 1e-3, ()) == method
