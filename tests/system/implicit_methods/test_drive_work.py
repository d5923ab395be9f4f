"""The work of drives and dampers by implicit methods: as exact as the motion lets it be, so that
the energy balance tells of the motion; what the motion itself loses is told all the same."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.integrate.steppers import IMPLICIT
from mstmm.runtime.model.model import Model
from mstmm.runtime.result.result import Result
from tests.support.scenes.results import rod

FAMILY = ["genalpha", "dttmm", "hht", "newmark"]


@cache
def carriage() -> Model:
    """1 kg that is driven to and fro, sin(3 t), beside a rod that turns freely without weight."""
    hinges: list[dict[str, Any]] = [
        {"name": "rail", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground",
         "outboard": "mass", "drive": ["sin(3*t)"]},
        {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod",
         "initial": {"u": [1.0]}},
    ]  # fmt: skip
    bodies = [{"name": "mass", "mass": 1.0}, rod("rod")]
    scene = mstmm.Scene(gravity=(0, 0, 0), body=bodies, hinge=hinges)
    return mstmm.compile(scene, engine="looped")


@cache
def swing(law: tuple[tuple[str, float], ...] = ()) -> Model:
    """A rod that is driven to and fro, with one of 1 g hung from it."""
    light = rod("tail")
    light |= {"mass": 1e-3 * light["mass"], "inertia": [1e-3 * x for x in light["inertia"]]}
    hinges: list[dict[str, Any]] = [
        {"name": "motor", "type": "pin", "inboard": "ground", "outboard": "arm",
         "drive": ["sin(3*t)"]},
        {"name": "elbow", "type": "pin", "inboard": "arm.tip", "outboard": "tail",
         "initial": {"q": [0.3]}, "law": dict(law)},
    ]  # fmt: skip
    scene = mstmm.Scene(gravity=(0, -9.81, 0), body=[rod("arm"), light], hinge=hinges)
    return mstmm.compile(scene, engine="looped")


@pytest.mark.parametrize("method", IMPLICIT)
def test_the_work_of_a_drive_alone_is_of_fourth_order(method: str) -> None:
    """W = (9 cos(3 t)^2 - 9) / 2 whatever the method makes of the rest."""
    errors = []
    for step in (0.02, 0.01):
        run = carriage().simulate(1.0, method, step)
        exact = 4.5 * np.cos(3 * run.t) ** 2 - 4.5
        errors.append(np.abs(run.work - exact).max())
    assert errors[0] < 1e-6 and errors[1] < errors[0] / 12 + 1e-13


@pytest.mark.parametrize("method", FAMILY)
@pytest.mark.parametrize("law", [(), (("damping", 0.003),)])
def test_a_drive_brings_no_doubt_of_the_energy(
    method: str, law: tuple[tuple[str, float], ...]
) -> None:
    run = swing(law).simulate(3.0, method, rtol=1e-6, atol=1e-8)
    assert run.success
    assert run.certificate.energy.relative < 3e-6
    assert not any("energy" in doubt for doubt in run.certificate.objections)


def undriven_rods() -> Model:
    """The same rods with nothing driven."""
    data = swing().scene.model_dump(by_alias=True, exclude_unset=True)
    data["hinge"][0].pop("drive")
    return mstmm.compile(mstmm.Scene.from_data(data), engine="looped")


@pytest.mark.parametrize("method", FAMILY)
def test_a_motion_that_loses_energy_is_told(method: str) -> None:
    """Steps that are far too long, of a driven motion and of a free one."""
    for model, step in (swing((("damping", 0.03),)), 0.5), (undriven_rods(), 0.1):
        run = model.simulate(3.0, method, step)
        assert any("energy is not conserved" in doubt for doubt in run.certificate.objections)


@pytest.mark.parametrize("method", FAMILY)
def test_speeds_that_are_wrong_are_told(method: str) -> None:
    run = swing().simulate(3.0, method, rtol=1e-6, atol=1e-8)
    u = run.u.copy()
    u[len(u) // 2 :, 1] *= 1.3  # the light one alone, whose energy is a thousandth
    spoilt = Result(run.model, replace(run.trajectory, u=u))
    assert any("energy is not conserved" in doubt for doubt in spoilt.certificate.objections)


@pytest.mark.parametrize("method", ["genalpha", "hht", "newmark"])
def test_the_work_of_a_damper_in_fixed_steps(method: str) -> None:
    """Twenty steps a swing: the trapezoidal rule on the speeds is wrong by a hundredth."""
    law = {"stiffness": 0.09, "damping": 0.06}
    hinge = {"name": "spring", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground",
             "outboard": "mass", "initial": {"q": [1.0]}, "law": law}  # fmt: skip
    scene = mstmm.Scene(gravity=(0, 0, 0), body=[{"name": "mass", "mass": 1.0}], hinge=[hinge])
    run = mstmm.compile(scene, engine="looped").simulate(100.0, method, 1.0)
    assert run.work[-1] == pytest.approx(-run.energy_components()["springs"][0], rel=0.006)
