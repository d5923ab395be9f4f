"""Scenes without any equilibrium: a load that does the same work wherever they are."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import NumericalFailure
from mstmm.runtime.engine.static_equilibrium import EquilibriumProblem, find_unbalanced_motion
from tests.support.paths import EXAMPLES


def body(name: str, **more: Any) -> dict[str, Any]:
    return {"name": name, "mass": 1.0, "inertia": [0.1] * 3, **more}


def slide(name: str, inboard: str, outboard: str, **more: Any) -> dict[str, Any]:
    return {"name": name, "type": "prismatic", "axis": [0, 1, 0], "inboard": inboard,
            "outboard": outboard, **more}  # fmt: skip


SPIN = {"type": "pin", "inboard": "a", "outboard": "b", "law": {"effort": 0.2}}
SCENES: dict[str, tuple[dict[str, Any], str]] = {
    "a body that falls": (
        {"gravity": [0, -9.81, 0], "body": [body("a")], "hinge": [
            {"name": "space", "type": "free", "inboard": "ground", "outboard": "a"}]},
        "-9.81 along space.vy",
    ),
    "a pair on a spring, pushed at one end": (
        {"gravity": [0, 0, 0], "body": [body("a"), body("b")],
         "hinge": [slide("x", "ground", "a"), slide("y", "a", "b", law={"stiffness": 30.0})],
         "load": [{"on": "b", "force": [0, 2.0, 0]}]},
        "2 along x.displacement_rate",
    ),
    "a wheel on a pendulum": (
        {"gravity": [0, -9.81, 0], "body": [body("a", center_of_mass=[0, -1, 0]), body("b")],
         "hinge": [{"name": "pivot", "type": "pin", "inboard": "ground", "outboard": "a"},
                   {"name": "wheel", **SPIN}]},
        "0.2 along wheel.angle_rate",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", SCENES)
def test_loads_that_nothing_balances_are_named(name: str) -> None:
    scene, load = SCENES[name]
    model = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    with pytest.raises(NumericalFailure, match=f"no equilibrium exists: .*{load} ") as caught:
        model.equilibrium(max_steps=5)
    assert "another start" not in str(caught.value)


@pytest.mark.parametrize(
    ("example", "load"),
    [("planetary_gear", "0.3 along sun.angle_rate"), ("satellite_arm", "1 along elbow.angle_rate")],
)
def test_examples_without_equilibrium(example: str, load: str) -> None:
    """0.3 N*m turn the sun, whose ring alone has a spring; 1 N*m bends a free arm."""
    model = mstmm.compile(EXAMPLES / example / "scene.toml", engine="looped")
    with pytest.raises(NumericalFailure, match=f"no equilibrium exists: unbalanced .*{load} "):
        model.equilibrium(max_steps=5)


@pytest.mark.parametrize("law", [{"stiffness": 1e-3}, {"effort": "where(q < -20, -1e3*(q+20), 0)"}])
def test_loads_that_are_balanced_far_away_are_not_said_to_be_unbalanced(
    law: dict[str, Any],
) -> None:
    """10 N on a spring of 1e-3 N/m rest 10 km away, on a stop 20 m away."""
    scene = mstmm.Scene(
        gravity=[0, -10.0, 0], body=[body("a")], hinge=[slide("x", "ground", "a", law=law)]
    )
    try:
        mstmm.compile(scene, engine="looped").equilibrium(max_steps=5)
    except NumericalFailure as failure:
        assert "exists" not in str(failure)


def test_the_motion_is_that_of_the_constant_load() -> None:
    """Springs K with K (1, 2, 0) = 0 under f: f (1, 2, 0) is the work at every state."""
    across = np.array([[2.0, -1.0, 0.0], [0.0, 0.0, 1.0]])
    stiffness, load = across.T @ across, np.array([3.0, 1.0, 2.0])
    problem = EquilibriumProblem(
        lambda q: stiffness @ q - load, lambda q, step: q + step, np.ones(3)
    )
    found = find_unbalanced_motion(problem, np.zeros(3))
    assert found is not None
    np.testing.assert_allclose(found[0] / found[0][0], [1.0, 2.0, 0.0], atol=1e-6)
    balanced = EquilibriumProblem(
        lambda q: stiffness @ (q - [1.0, 1.0, 1.0]), lambda q, step: q + step, np.ones(3)
    )
    assert find_unbalanced_motion(balanced, np.zeros(3)) is None
