"""Beams that run away: what is said of them has numbers, and nothing else is written."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm

BEAM = {"name": "blade", "length": 10.0, "mass_per_length": 1.2, "bending_stiffness": 1.4e4}
HUB = {"name": "hub", "inboard": "ground", "outboard": "blade"}


def run(
    hinge: dict[str, Any], stiffening: bool, t_end: float, modes: int, **options: Any
) -> mstmm.Result:
    beam = BEAM | {"modes": modes, "initial": {"eta": [1e-3] * 2 * modes}}
    beam |= {"stiffening": stiffening}
    scene = mstmm.Scene(gravity=[0, -9.81, 0], beam=[beam], hinge=[HUB | hinge])
    return mstmm.compile(scene, engine="looped").simulate(t_end, **options)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(("modes", "stiffening"), [(3, True), (8, False)])
def test_steps_that_are_too_long(modes: int, stiffening: bool) -> None:
    """Coordinates end at 1e300, of which squares are no numbers."""
    found = run({"type": "fixed"}, stiffening, 60.0, modes, method="rk4", step=0.05)
    assert not found.success and found.message.startswith("step = 0.05 s is too long")
    assert np.abs(found.q).max() > 1e200
    told = str(found.certificate)
    assert "NOT trusted" in told and " nan" not in told and " inf " not in told
    assert found.position("blade.tip").shape == (len(found.t), 3)
    assert found.deflection("blade", 5.0).shape[0] == len(found.t)


@pytest.mark.filterwarnings("error")
def test_a_linear_beam_spun_beyond_its_first_frequency() -> None:
    found = run({"type": "pin", "drive": "60*t"}, False, 20.0, 3, rtol=1e-6)
    assert not found.success and found.message.startswith("not finite")
    told = str(found.certificate)
    assert "has no geometric stiffening and spins at 16 times its first frequency" in told
    assert " nan" not in told and "sum of local errors" not in told
