"""Starts far from closed, and what is left open where nothing closes."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from reference.jets import Array

import mstmm

from .linkages import CRANK, FEET, OBLIQUE, ROCKER, bricard, four_bar, legs
from .scenes import andrews, four_bars


def off(model: mstmm.Model, kept: tuple[str, ...], size: float, draw: np.random.Generator) -> Array:
    """The start with all coordinates off by up to `size` (rad, m), but for those of `kept`."""
    start, _ = model.initial_state()
    shift = draw.uniform(-size, size, len(start))
    for hinge in model.scene.hinge:
        place = model.layout.hinges[hinge.name].q_slice
        if hinge.type == "ball":
            shift[place] /= 2  # of a quaternion half the angle
        if hinge.name in kept:
            shift[place] = 0.0
    return start + shift


@pytest.mark.parametrize(
    ("scene", "kept", "size"),
    [
        (four_bar(), ("foot",), 0.3),
        (four_bar(tilt=OBLIQUE), ("foot",), 1.0),
        (four_bars(40, 1.0), ("foot0",), 0.3),
        (andrews(), ("beta",), 0.3),
        (bricard(), (), 0.3),
        (legs(), tuple(f"slide{k}" for k in range(6)), 0.3),
    ],
    ids=["four-bar", "oblique", "forty-windows", "squeezer", "bricard", "legs"],
)
def test_every_start_nearby_closes(
    scene: dict[str, Any], kept: tuple[str, ...], size: float
) -> None:
    """Twenty starts; what is held stays to the bit, and no end is off its partner."""
    model, draw = mstmm.compile(mstmm.Scene(**scene)), np.random.default_rng(12)
    for _ in range(20):
        wish = off(model, kept, size, draw)
        q, u = model.assemble(wish, np.zeros(model.nu), hold=kept)
        for place in (model.layout.hinges[name].q_slice for name in kept):
            assert (q[place] == wish[place]).all()
        assert gap(model, scene, q, u) < 1e-9


def gap(model: mstmm.Model, scene: dict[str, Any], q: Array, u: Array) -> float:
    """Largest distance between the two ends of a cut ball or pin, from positions of ends, m."""
    result = model.simulate(0.0, initial=(q, u))
    apart = []
    for hinge in scene["hinge"]:
        if hinge["name"] in model.loops.cut:
            ends = hinge["inboard"], hinge["outboard"]
            sides = [
                np.array(hinge.get("position", [0, 0, 0]), float) if end == "ground"
                else result.position(end)[0]
                for end in ends
            ]  # fmt: skip
            apart.append(float(np.linalg.norm(sides[0] - sides[1])))
    return max(apart)


@pytest.mark.parametrize("cut", ["knee", "tip", "end"])
@pytest.mark.parametrize("mass", [1e-3, 1.3, 1e3])
def test_the_least_gap_is_that_of_the_geometry(cut: str, mass: float) -> None:
    """A coupler of 0.3 m, a crank that is held: at best all in one line, whatever the masses."""
    scene = four_bar(cut=cut, tilt=OBLIQUE)
    for body in scene["body"]:
        if body["name"] == "coupler":
            body["ends"]["tip"], body["mass"] = [0.3, 0, 0], mass
    for hinge in scene["hinge"]:
        if hinge["name"] == "foot":
            hinge |= {"hold": True, "initial": {"q": 2.5}}
    least = abs(FEET - CRANK * np.exp(2.5j)) - ROCKER - 0.3
    with pytest.raises(mstmm.SceneError, match=f'hinge "{cut}" closes stays open') as caught:
        mstmm.compile(mstmm.Scene(**scene))
    told = re.search(r"leaves ([0-9.e-]+) m", str(caught.value))
    assert told and abs(float(told[1]) - least) < 1e-6
    assert '"foot" held' in str(caught.value)
