"""Checks of exact beams: each measure at a state where its value is known, and its finding."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.result.checks import exact_beams as checks
from mstmm.runtime.result.flexible.exact_range import ExactRange
from tests.support.models import compile_scene


def _cantilever(load: dict[str, Any], **keys: Any) -> mstmm.Result:
    """A rod of EI = L = rho A = 1 in equilibrium under a load on its tip."""
    rod = {"name": "rod", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 1.0}
    clamp = {"name": "clamp", "type": "fixed", "inboard": "ground", "outboard": "rod"}
    model = compile_scene(
        {
            "gravity": [0, 0, 0], "beam": [rod | {"kinematics": "exact"} | keys], "hinge": [clamp],
            "load": [{"on": "rod.tip"} | load],
        }
    )  # fmt: skip
    return model.simulate(1e-9, initial=(np.asarray(model.equilibrium()), np.zeros(model.nu)))


def _range(result: mstmm.Result) -> ExactRange:
    (found,) = result.certificate.exact_beams
    return found


def test_turn_of_the_longest_segment() -> None:
    """A circle of radius 1 / 4: a segment turns by 4 times its length."""
    result = _cantilever({"moment": [0.0, 0.0, 4.0]}, modes={"y": 2})
    body = result.model.flexible_bodies["rod"]
    sections = np.sort([0.0, *(station.x for station in body.stations)])
    assert _range(result).segment_rotation == pytest.approx(4 * np.diff(sections).max(), rel=1e-9)
    assert _range(result).magnus_difference < 1e-12  # of a circle both orders are exact
    assert (_range(result).missed_energy or 0.0) < 1e-12


def test_a_segment_that_turns_far_is_reported() -> None:
    result = _cantilever({"moment": [0.0, 0.0, 5.2]}, modes={"y": 1})
    assert _range(result).segment_rotation > checks.MAX_SEGMENT_ROTATION
    assert [risk.name for risk in result.risks] == ["turn"]


def test_strain_modes_miss_the_moment_of_a_dead_load() -> None:
    """Two modes vanish at the tip with their moment's slope; four Legendre strains do not."""
    push = {"force": [0.0, 1.0, 0.0]}
    missed = [
        _range(_cantilever(push, **keys)).missed_energy or 0.0
        for keys in ({"modes": {"y": 1}, "basis": "modes"}, {"modes": {"y": 5}})
    ]
    assert missed[0] > 1e-3
    assert missed[1] < 1e-6


def test_strain_of_the_outermost_fibre() -> None:
    """sqrt(3) r kappa = 0.0866 for r = 0.01 m and kappa = 5 / m."""
    result = _cantilever({"moment": [0.0, 0.0, 5.0]}, modes={"y": 2}, rotary_inertia=[1e-4, 1e-4])
    assert _range(result).fibre_strain == pytest.approx(np.sqrt(3) * 0.05, rel=1e-6)
    assert "strain" in [risk.name for risk in result.risks]


def test_one_stretch_coordinate() -> None:
    result = _cantilever(
        {"force": [1.0, 0.0, 0.0]}, modes={"y": 2, "axial": 1}, axial_stiffness=100.0
    )
    assert result.deflection("rod", "tip")[0, 0] == pytest.approx(0.01, rel=1e-9)
    assert any("one stretch coordinate" in text for text in result.warnings)
