"""Default shapes and buckling out of a plane: critical loads of Timoshenko and Gere, Theory of
Elastic Stability, 2nd ed., sections 2.1 (Euler) and 6.3 (Prandtl)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.flexible.flexible_bodies import modal_bodies

HELD = {"name": "foot", "type": "fixed", "inboard": "ground", "outboard": "b"}


def scene(force: list[Any], **more: Any) -> mstmm.Scene:
    """A cantilever of 1 m and 1 kg with a force at its tip, without gravity."""
    beam = {"name": "b", "length": 1.0, "mass_per_length": 1.0, **more.pop("beam", {})}
    load = [{"on": "b.tip", "force": force}]
    return mstmm.Scene(
        gravity=[0, 0, 0], constants={"P": 1.0}, beam=[beam], hinge=[HELD], load=load, **more
    )


def critical(built: mstmm.Scene, unstable: float) -> float:
    found = mstmm.compile(built, engine="looped").stability_limit("constants.P", 0.1, unstable)
    return float(found.value)


@pytest.mark.parametrize("bending", [[0.5, 2.0], [2.0, 0.5]])
def test_a_column_buckles_in_its_weaker_plane(bending: list[float]) -> None:
    column = scene(["0-P", 0, 0], beam={"bending_stiffness": bending})
    assert critical(column, 3.0) == pytest.approx(np.pi**2 / 4 * 0.5, rel=3e-3)
    pushed = mstmm.compile(column, engine="looped").with_parameters({"constants.P": 2.0})
    assert pushed.equilibrium().unstable_speeds


def test_a_narrow_beam_buckles_sideways_with_twist() -> None:
    soft, stiff, twist = 1.0, 400.0, 0.8
    narrow = {"bending_stiffness": [soft, stiff], "torsional_stiffness": twist,
              "polar_inertia_per_length": 1e-6}  # fmt: skip
    prandtl = 4.0126 * np.sqrt(soft * twist)
    assert critical(scene([0, "0-P", 0], beam=narrow), 8.0) == pytest.approx(prandtl, rel=0.01)


def test_a_spring_braces_a_column_in_its_plane_alone() -> None:
    spring = {"name": "s", "from": "ground", "position": [1.0, -1.0, 0.0], "to": "b.tip",
              "type": "spring", "law": {"stiffness": 1e3, "rest": 1.0}}  # fmt: skip
    braced = scene(["0-P", 0, 0], beam={"bending_stiffness": 1.0}, spring=[spring])
    assert critical(braced, 6.0) == pytest.approx(np.pi**2 / 4, rel=3e-3)


@pytest.mark.parametrize("bending", [1.0, [2.0, 1.0]])
def test_a_beam_as_stiff_across_its_plane_as_in_it_has_the_shapes_of_the_plane(
    bending: Any,
) -> None:
    body = modal_bodies(scene([0, "0-P", 0], beam={"bending_stiffness": bending}))["b"]
    assert {name[0] for name in body.modes} == {"y"}


def test_a_weak_beam_gives_shapes_out_of_the_plane_to_those_that_carry_it() -> None:
    stiff = {"name": "a", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 5.0}
    weak = stiff | {"name": "b", "bending_stiffness": [0.5, 5.0]}
    hinges = [HELD | {"outboard": "a"}, HELD | {"name": "w", "inboard": "a.tip"}]
    load = [{"on": "b.tip", "force": ["0-3", 0, 0]}]
    bodies = modal_bodies(mstmm.Scene(beam=[stiff, weak], hinge=hinges, load=load,
                                      gravity=[0, -9.81, 0]))  # fmt: skip
    assert all({name[0] for name in body.modes} == {"y", "z"} for body in bodies.values())


def test_answers_about_a_column_with_shapes_of_one_plane_are_doubted() -> None:
    column = scene(["0-P", 0, 0], beam={"bending_stiffness": [0.5, 2.0], "modes": {"y": 3}})
    model = mstmm.compile(column, engine="looped").with_parameters({"constants.P": 2.0})
    loaded = 2.0 / (np.pi**2 / 4 * 0.5)
    for answer in (model.equilibrium(), model.linearize()):
        (risk,) = (risk for risk in answer.risks if risk.name == "buckling")
        assert risk.invalidates and risk.value == pytest.approx(loaded, rel=0.01)
    found = model.stability_limit("constants.P", 0.1, 8.0)
    assert not found.trusted and "out of the plane" in found.warnings[0]


def test_a_constraint_braces_a_column_in_its_plane_alone() -> None:
    guide = {"type": "point-on-plane", "from": "ground", "to": "b.tip", "normal": [0, 1, 0]}
    body = modal_bodies(scene(["0-P", 0, 0], beam={"bending_stiffness": 1.0}, constraint=[guide]))
    assert {name[0] for name in body["b"].modes} == {"y", "z"}
