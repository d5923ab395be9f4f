"""Motions of the example scenes against absolute coordinates with multipliers, run by SciPy."""

from __future__ import annotations

import tomllib
from typing import Any

import numpy as np
import pytest

import mstmm
from tests.reference import dae
from tests.reference.tree import read
from tests.support.paths import EXAMPLES

#: Example -> seconds compared; the independent formulation takes about 5 ms per evaluation.
SPANS = {
    "simple_pendulum": 2.0,
    "driven_release": 0.9,
    "heavy_top": 0.5,
    "three_bodies_on_balls": 0.5,
    "three_pin_arm": 0.5,
    "three_pin_arm_springs": 0.01,
    "branched_tree": 0.5,
    "satellite_arm": 1.0,
    "arm_with_limits": 0.3,
    "puma560": 0.2,
}


def load(name: str) -> dict[str, Any]:
    return tomllib.loads((EXAMPLES / name / "scene.toml").read_text())


def test_every_example_is_compared() -> None:
    """All trees of rigid bodies are; a chain with the same scene written out in
    test_chains, flexible bodies with references of their own in tests/system/flexible and in the
    examples' checks, as are signals, closed loops and couplings in tests/system/loops and there."""
    scenes = {path.parent.name: load(path.parent.name) for path in EXAMPLES.glob("*/scene.toml")}
    elsewhere = {"chain", "beam", "elastic", "signal", "constraint", "coupling"}
    assert set(SPANS) == {
        name for name, scene in scenes.items()
        if not elsewhere & scene.keys() and len(scene["hinge"]) == len(scene["body"])
    }  # fmt: skip


@pytest.mark.parametrize("name", SPANS)
def test_history(name: str) -> None:
    scene = load(name)
    times = np.linspace(0.0, SPANS[name], 5)
    other = dae.simulate(scene, times, rtol=1e-9, atol=1e-10)
    model = mstmm.compile(mstmm.load_scene(EXAMPLES / name / "scene.toml"))
    found = model.simulate(times[-1], rtol=1e-11, atol=1e-13, output_times=times)
    assert found.success, found.message
    size = max(1.0, float(np.abs(other.u).max()))
    assert np.abs(found.q - other.q).max() < 1e-7 * size
    assert np.abs(found.u - other.u).max() < 1e-6 * size
    for number, body in enumerate(read(scene).bodies):
        place = found.position(body.name)
        assert np.abs(place - other.position[:, number]).max() < 1e-7 * size


def test_history_through_stops_with_friction() -> None:
    """The arm starts in its upper stops, moving into them."""
    scene = load("arm_with_limits")
    q, u, times = np.array([0.79, 2.19]), np.array([1.0, 1.5]), np.linspace(0.0, 0.1, 5)
    other = dae.simulate(scene, times, q, u, rtol=1e-9, atol=1e-10)
    found = mstmm.compile(mstmm.Scene(**scene)).simulate(
        0.1, rtol=1e-11, atol=1e-13, output_times=times, initial=(q, u)
    )
    assert found.success, found.message
    assert found.q.max(axis=0) == pytest.approx(other.q.max(axis=0), abs=1e-8)
    assert np.all(found.q.max(axis=0) > [0.8, 2.2])
    assert np.abs(found.q - other.q).max() < 1e-7
    assert np.abs(found.u - other.u).max() < 1e-6
