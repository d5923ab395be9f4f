"""Beams by implicit methods: spun up, swinging, and bent far until they rest."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.model.model import Model
from tests.runtime.model.test_equilibrium_beams import elastica, tip, welded_beam_model
from tests.support.implicit_methods import motions
from tests.support.paths import EXAMPLES

TIMES = [2.0, 5.0, 8.0]

#: Methods and how they are asked for 1 per mille of what is bent.
METHODS: list[tuple[str, dict[str, Any]]] = [
    ("rodas4p2", {"rtol": 1e-5, "atol": 1e-6}), ("rodas5p", {"rtol": 1e-5, "atol": 1e-6}),
    ("esdirk436", {"rtol": 1e-5, "atol": 1e-6}), ("kvaerno5", {"rtol": 1e-5, "atol": 1e-6}),
    ("genalpha", {"rtol": 1e-6, "atol": 1e-7}), ("dttmm", {"step": 2e-3}),
    ("exprb32", {"rtol": 1e-5, "atol": 1e-6}),
]  # fmt: skip


@cache
def blade() -> tuple[Model, Any]:
    """A blade that is spun up by a drive, and its coordinates by an explicit method."""
    model = mstmm.compile(mstmm.load_scene(EXAMPLES / "spin_up/scene.toml"), engine="looped")
    return model, model.simulate(8.0, rtol=1e-10, atol=1e-12, output_times=TIMES).q


@pytest.mark.parametrize("method, how", METHODS)
def test_a_blade_is_spun_up(method: str, how: dict[str, Any]) -> None:
    model, exact = blade()
    run = model.simulate(8.0, method, output_times=TIMES, **how)
    assert run.success, run.message
    assert run.q[:, 0] == pytest.approx(exact[:, 0], abs=1e-12)  # driven
    assert run.q[:, 1:] == pytest.approx(exact[:, 1:], abs=1e-3 * np.abs(exact[:, 1:]).max())


def welded_pendulum(stiffness: float) -> dict[str, Any]:
    """A beam on a pin, 2 m in two welded parts; EI in N m2."""
    scene = motions.beam_pendulum(stiffness)
    scene["beam"][0]["frame"] = scene["beam"][0]["basis"] = "auto"
    scene["beam"].append(scene["beam"][0] | {"name": "second"})
    weld = {"name": "weld", "type": "fixed", "inboard": "beam.tip", "outboard": "second"}
    scene["hinge"].append(weld)
    return scene


@cache
def pendulum() -> tuple[Model, Any]:
    model = mstmm.compile(mstmm.Scene(**welded_pendulum(50.0)), engine="looped")
    return model, model.simulate(0.5, rtol=1e-10, atol=1e-12, output_times=[0.5])


@pytest.mark.parametrize("method, how", METHODS)
def test_welded_beams_swing(method: str, how: dict[str, Any]) -> None:
    model, exact = pendulum()
    run = model.simulate(0.5, method, output_times=[0.5], **how)
    assert run.success, run.message
    apart = run.position("second.tip")[-1] - exact.position("second.tip")[-1]
    assert np.abs(apart).max() < 2e-3


@pytest.mark.parametrize("force", [2.0, 10.0])
@pytest.mark.parametrize("method", ["rodas5p", "esdirk436", "kvaerno5"])
def test_a_bent_beam_comes_to_rest_where_its_equilibrium_is(method: str, force: float) -> None:
    """In pseudo-time, with drag; Newton's method on the same tangent; and the exact elastica."""
    model = welded_beam_model(8, force, viscous_drag=10.0, damping=0.1)
    rest = model.equilibrium()
    run = model.simulate(100.0, method, rtol=1e-4, atol=1e-7, output_times=[100.0])
    assert run.success, run.message
    assert run.statistics is not None
    assert run.statistics.steps < 400
    assert run.q[-1] == pytest.approx(rest, abs=1e-8)
    assert tip(model, run.q[-1], "p7.tip") == pytest.approx(elastica(force), abs=2e-4)
