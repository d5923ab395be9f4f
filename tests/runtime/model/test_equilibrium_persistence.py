"""Equilibrium beside drives."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import NumericalFailure

GRAVITY = 9.81


def driven_four_bar() -> dict[str, Any]:
    """Two bars of 0.25 m that meet above a crank of 0.1 m, which a drive turns."""
    bar: dict[str, Any] = {"mass": 1.0, "center_of_mass": [0.125, 0, 0],
                           "inertia": [0, 5e-3, 5e-3], "ends": {"tip": [0.25, 0, 0]}}  # fmt: skip
    return {
        "gravity": [0, -GRAVITY, 0],
        "body": [
            {"name": "crank", "mass": 1.0, "inertia": [0, 0.1, 0.1], "ends": {"tip": [0.1, 0, 0]}},
            {"name": "coupler", **bar},
            {"name": "rocker", **bar},
        ],
        "hinge": [
            {"name": "a", "type": "pin", "inboard": "ground", "outboard": "crank", "drive": "6*t"},
            {"name": "b", "type": "pin", "inboard": "crank.tip", "outboard": "coupler",
             "initial": {"q": 1.4}},
            {"name": "c", "type": "pin", "inboard": "ground", "outboard": "rocker",
             "position": [0.2, 0, 0], "initial": {"q": 1.8}},
            {"name": "d", "type": "pin", "inboard": "coupler.tip", "outboard": "rocker.tip"},
        ],
    }  # fmt: skip


def test_a_mechanism_whose_drives_leave_nothing_free_is_where_they_have_it() -> None:
    model = mstmm.compile(mstmm.Scene(**driven_four_bar()), engine="looped")
    found = model.equilibrium(t=0.05)
    crank, knee, rocker = (float(found[model.coordinate_layout.hinges[name].q]) for name in "abc")
    coupler = 0.1 * np.exp(1j * crank) + 0.25 * np.exp(1j * (crank + knee))
    assert abs(crank - 0.3) < 1e-12
    assert abs(coupler - 0.2 - 0.25 * np.exp(1j * rocker)) < 1e-9
    assert found.residuals == {} and found.unstable_speeds == () and found.trusted


def test_a_tree_whose_drives_leave_nothing_free_is_where_they_have_it() -> None:
    scene = driven_four_bar()
    scene["body"], scene["hinge"] = scene["body"][:1], scene["hinge"][:1]
    found = mstmm.compile(mstmm.Scene(**scene), engine="looped").equilibrium(t=0.05)
    assert np.abs(found - 0.3).max() < 1e-12 and found.residuals == {}


def driven_disc_model(offset: float, inertia: list[float], drive: str = "20*t") -> mstmm.Model:
    """A disc of 2 kg that a drive turns on a sprung slide of 1 kg, its mass centre so far out."""
    disc = {"name": "disc", "mass": 2.0, "center_of_mass": [offset, 0, 0], "inertia": inertia}
    slide = {"name": "x", "type": "prismatic", "inboard": "ground", "outboard": "slide",
             "axis": [0, 1, 0], "law": {"stiffness": [1000.0]}}  # fmt: skip
    pin = {"name": "p", "type": "pin", "inboard": "slide", "outboard": "disc", "drive": drive}
    scene = {"gravity": [0, -GRAVITY, 0], "body": [{"name": "slide", "mass": 1.0}, disc],
             "hinge": [slide, pin]}  # fmt: skip
    return mstmm.compile(mstmm.Scene(**scene), engine="looped")


@pytest.mark.parametrize("inertia", [[1.0, 1.0, 1.0], [0.0, 0.0, 0.0]])
def test_an_offset_of_rounding_is_no_length_and_no_unbalance(inertia: list[float]) -> None:
    for offset in (1e-12, 1e-9, 1e-7):
        found = driven_disc_model(offset, inertia).equilibrium()
        assert abs(found[0] + 3 * GRAVITY / 1000) < 1e-12
        assert found.unstable_speeds == () and found.trusted


@pytest.mark.parametrize("inertia", [0.0, 1e-3, 1.0])
def test_an_unbalance_that_shakes_does_not_last(inertia: float) -> None:
    for offset in (1e-4, 1e-3, 1e-2):
        with pytest.raises(NumericalFailure, match="is not steady: as drives move"):
            driven_disc_model(offset, 3 * [inertia]).equilibrium()


@pytest.mark.parametrize("offset", [2e-6, 5e-6])
def test_an_unbalance_far_below_the_weight_changes_the_rest_slightly(offset: float) -> None:
    """m r omega^2 of 5e-5 and 1e-4 of the weight, far from resonance."""
    found = driven_disc_model(offset, 3 * [1.0]).equilibrium()
    assert abs(found[0] + 3 * GRAVITY / 1000) < 1e-6
    assert [risk.name for risk in found.risks] == ["unsteady-state"]
    assert "changes slowly" in found.warnings[0]
    assert found.trusted


def test_a_small_unbalance_at_resonance_is_no_small_change() -> None:
    with pytest.raises(NumericalFailure, match="is not steady"):
        driven_disc_model(5e-6, 3 * [1.0], drive=f"{np.sqrt(1000 / 3):.15g}*t").equilibrium()
