"""Scenes in a plane are swept in it: as in space, but for what is across the plane."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm

from .linkages import bricard

#: Lengths of a row of two windows that lean, and how far its bodies lie across the plane.
CRANK, COUPLER, ANGLE, APART = 0.8, 1.1, 0.6, 0.3


def windows(axis: tuple[float, float, float] = (0.0, 0.0, 1.0)) -> dict[str, Any]:
    """Two windows of lopsided bodies in planes apart, with all that acts on hinges and bodies."""
    rod = {"mass": 1.3, "center_of_mass": [0.4, 0.07, 0.2],
           "inertia": [0.1, 0.2, 0.25, 0.01, 0.02, 0.03],
           "ends": {"crank": [CRANK, 0, 0], "coupler": [COUPLER, 0, APART]}}  # fmt: skip
    names = [*(f"crank{k}" for k in range(3)), *(f"coupler{k}" for k in range(2))]
    pin = {"type": "pin", "axis": list(axis)}
    hinges: list[dict[str, Any]] = [
        pin | {"name": f"foot{k}", "inboard": "ground", "outboard": f"crank{k}",
               "position": [COUPLER * k, 0.0, APART * k], "initial": {"q": ANGLE, "u": 0.7}}
        for k in range(3)
    ]  # fmt: skip
    for k in range(2):
        hinges += [
            pin | {"name": f"left{k}", "inboard": f"crank{k}.crank", "outboard": f"coupler{k}",
                   "initial": {"q": -ANGLE, "u": -0.7}},
            pin | {"name": f"right{k}", "inboard": f"coupler{k}.coupler",
                   "outboard": f"crank{k + 1}.crank", "initial": {"q": ANGLE, "u": 0.7}},
        ]  # fmt: skip
    hinges[0] |= {"law": {"stiffness": 20.0, "damping": 0.4, "inertia": 0.05}}
    hinges[4] |= {"law": {"damping": 0.3}}
    return {
        "gravity": [1.0, -9.0, 2.0],
        "body": [rod | {"name": name} for name in names],
        "hinge": hinges,
        "load": [{"on": "coupler0.coupler", "force": ["3*cos(t)", 2.0, 5.0], "moment": [1, 2, 3]}],
        "spring": [{"name": "tie", "from": "crank0.crank", "to": "coupler1.coupler",
                    "law": {"stiffness": 50.0, "damping": 1.0, "rest": 1.0}}],
    }  # fmt: skip


def test_accelerations_are_those_in_space() -> None:
    model = mstmm.compile(mstmm.Scene(**windows()), engine="looped")
    draw = np.random.default_rng(5)
    q, _ = model.initial_state()
    states = [(q + 0.1 * draw.standard_normal(model.nq), draw.standard_normal(model.nu))
              for _ in range(5)]  # fmt: skip
    flat = [model.accelerations(*state) for state in states]
    assert model.packed.model.planar
    model.packed.model.planar = 0
    for state, found in zip(states, flat, strict=True):
        assert found == pytest.approx(model.accelerations(*state), rel=1e-12, abs=1e-12)


def test_a_ring_in_space_is_swept_there() -> None:
    """Its axes are those of a cube; in a plane its accelerations would be others."""
    model = mstmm.compile(mstmm.Scene(**bricard()), engine="looped")
    assert not model.packed.model.planar
    state = model.initial_state()
    in_space = model.accelerations(*state)
    model.packed.model.planar = 1
    assert np.abs(model.accelerations(*state) - in_space).max() > 0.1
