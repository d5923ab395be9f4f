"""Frequencies beyond those that shapes hold: limits beside the roots of bars (R. D. Blevins,
Formulas for Natural Frequency and Mode Shape, 1979, table 8-1), and what answers say of them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.result.checks.shape_range import shape_limits

WALL = {"name": "h", "type": "fixed", "inboard": "ground", "outboard": "b"}
#: beta L of clamped-free, pinned-free and free-free bars.
CF, PF, FF = (1.8751, 4.6941, 7.8548), (3.9266, 7.0686, 10.2102), (4.7300, 7.8532)


def scene(base: dict[str, Any] = WALL, beam: Any = None, **more: Any) -> mstmm.Scene:
    table = {"name": "b", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 1.0,
             "polar_inertia_per_length": 1e-6, "modes": {"y": 3}} | (beam or {})  # fmt: skip
    hinges = [WALL | base, *more.pop("hinge", [])]
    return mstmm.Scene(gravity=[0, 0, 0], beam=[table], hinge=hinges, **more)


def beam_model(*arguments: Any, **more: Any) -> mstmm.Model:
    return mstmm.compile(scene(*arguments, **more), engine="looped")


@pytest.mark.parametrize(
    ("hinge", "beam", "root"),
    [
        (WALL, {}, CF[2]),
        (WALL, {"modes": {"y": 1}}, CF[0]),
        (WALL, {"basis": "static+fixed-interface", "modes": {"y": 4}}, CF[2]),
        ({"type": "pin"}, {}, PF[2]),
        ({"type": "free"}, {"modes": {"y": 2}}, FF[1]),
    ],
)
def test_shapes_hold_up_to_the_last_motion_that_they_have(
    hinge: Any, beam: Any, root: float
) -> None:
    limit = shape_limits(beam_model(hinge, beam))["b"]
    assert limit == pytest.approx(root**2, rel=1e-3)


def test_shapes_without_a_moment_hold_little_where_the_end_takes_one() -> None:
    """Clamped-free shapes beside a rigid body that is welded to the tip: frequencies 19 % off."""
    body = {"name": "r", "mass": 1.0, "inertia": [0.1, 0.1, 0.1]}
    weld = {"name": "w", "type": "fixed", "inboard": "b.tip", "outboard": "r"}
    more = {"body": [body], "hinge": [weld]}
    poor, good = (
        shape_limits(beam_model(beam=beam, **more))["b"]
        for beam in ({"basis": "clamped-free", "modes": {"y": 4}}, {"modes": {"y": 4}})
    )
    clamped = FF  # bars clamped at both ends have the roots of free ones
    assert poor < 0.5 * clamped[0] ** 2 and good == pytest.approx(clamped[1] ** 2, rel=1e-3)


def receptance(omega: float) -> float:
    """Deflection of the tip of the cantilever under a unit force there."""
    b = np.sqrt(omega)
    sinh, cosh, sin, cos = np.sinh(b), np.cosh(b), np.sin(b), np.cos(b)
    return float((sin * cosh - cos * sinh) / (b**3 * (1 + cos * cosh)))


def test_a_response_is_doubted_where_it_errs() -> None:
    linear = beam_model().linearize(disturbances=["b.tip.force.y"])
    for omega, right in ((0.5 * CF[2] ** 2, True), (0.97 * CF[2] ** 2, True), (100.0, False)):
        answer = linear.frequency_response([1.0, omega], outputs=["b.tip.position.y"])
        error = abs(answer.response[1, 0, 0] / receptance(omega) - 1)
        assert (error < 0.05) == right
        assert answer.trusted == right
    (risk,) = (risk for risk in answer.risks if risk.name == "frequency-range")
    assert risk.element == '"b"' and risk.limit == pytest.approx(CF[2] ** 2 / (2 * np.pi), rel=1e-3)
    assert risk.value == pytest.approx(100.0 / (2 * np.pi))


def test_exact_beams_have_no_limit() -> None:
    linear = beam_model().linearize(disturbances=["b.tip.force.y"])
    answer = linear.frequency_response([100.0], outputs=["b.tip.position.y"], exact=True)
    assert answer.trusted
    assert abs(answer.response[0, 0, 0]) == pytest.approx(abs(receptance(100.0)), rel=1e-6)


def test_motions_that_shapes_have_too_high_are_doubted() -> None:
    """The fourth of four static and fixed-interface shapes is 9 % too high."""
    model = beam_model(beam={"basis": "static+fixed-interface", "modes": {"y": 4}})
    requested = model.linearize().modes(4)
    assert requested.omega[3] > 1.05 * 10.9955**2
    (risk,) = (risk for risk in requested.risks if risk.name == "frequency-range")
    assert risk.invalidates and "a mode from" in risk.description
    assert model.linearize().modes(3).trusted


def test_of_all_modes_the_highest_are_noted_and_no_objection() -> None:
    model = beam_model(beam={"basis": "static+fixed-interface", "modes": {"y": 4}})
    every = model.linearize().modes()
    assert [(risk.name, risk.invalidates) for risk in every.risks] == [("frequency-range", False)]
    assert every.trusted


def test_all_modes_are_doubted_where_the_first_is_beyond_the_shapes() -> None:
    """Half a sine wave is no shape of a cantilever."""
    model = beam_model(beam={"basis": "simply-supported", "modes": {"y": 1}})
    every = model.linearize().modes()
    assert every.omega[0] > 1.05 * CF[0] ** 2
    assert not every.trusted


def test_the_limit_of_an_elastic_body() -> None:
    side, young, density = 0.02, 2e11, 7850.0
    unit = np.sqrt(young * side**2 / 12 / density)
    body = {"name": "b", "young": young, "poisson": 0.0, "density": density, "modes": 4,
            "box": {"size": [1.0, side, side], "divisions": [10, 1, 1], "corner": [0, 0, 0]},
            "ends": {"root": {"plane": [1, 0, 0, 0]}, "tip": {"plane": [1, 0, 0, 1]}}}  # fmt: skip
    for hinge, load, root in (
        ("free", [], FF[1]), ("fixed", [], CF[1]),
        ("fixed", [{"on": "b.tip", "force": [0, 1, 0]}], CF[2]),
    ):  # fmt: skip
        hinges = [WALL | {"type": hinge, "outboard": "b.root"}]
        built = mstmm.Scene(gravity=[0, 0, 0], elastic=[body], hinge=hinges, load=load)
        limit = shape_limits(mstmm.compile(built, engine="looped"))["b"]
        assert limit == pytest.approx(root**2 * unit, rel=0.02)
