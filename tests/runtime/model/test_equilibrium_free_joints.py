"""Equilibrium of arms with joints that nothing pushes."""

from __future__ import annotations

import tomllib

import pytest

import mstmm
from mstmm.errors import NumericalFailure
from tests.support.paths import ROOT

PUMA = ROOT / "examples" / "puma560" / "scene.toml"


@pytest.mark.parametrize("tilt", [0.0, 0.3])
def test_joints_that_only_rounding_pushes_are_undetermined(tilt: float) -> None:
    """Joint 1 is vertical and the hand hangs straight below joint 6: efforts of 1e-16 N*m are left
    by frames turned by pi / 2."""
    scene = mstmm.Scene(**tomllib.loads(PUMA.read_text()))
    model = mstmm.compile(scene, engine="looped")
    start = model.initial_state()[0]
    start[1] += tilt
    for called in (model.equilibrium, lambda q: model.linearize()):
        with pytest.raises(NumericalFailure, match=r"undetermined along joint1\.\S+, joint6\.\S+:"):
            called(start)
