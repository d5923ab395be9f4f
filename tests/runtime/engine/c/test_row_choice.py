"""Overconstrained linkages, whose rows are chosen anew along the way: exact and rounded ones."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.result.result import Result
from tests.reference.algebra import orientation
from tests.reference.jets import Array
from tests.support.scenes.linkages import OBLIQUE, PAIRS, bennett, bennett_ratio, bricard

TIMES = np.linspace(0.0, 3.0, 61)


def run(scene: dict[str, Any], until: float = 3.0, **how: Any) -> Result:
    """A tight run on the looped engine."""
    model = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    how = {"rtol": 1e-10, "atol": 1e-10} | how
    return model.simulate(until, **how)


@functools.cache
def exact(angle: float) -> Result:
    return run(bennett(angle, 6.0), output_times=TIMES)


@pytest.mark.parametrize("angle", [0.7, 2.0])
@pytest.mark.parametrize("digits", [4, 5, 6, 7, 8, 9, 10, 12])
def test_a_bennett_linkage_keeps_what_its_numbers_allow(digits: int, angle: float) -> None:
    """Whole turns from the pose that is drawn; tan(a/2) tan(b/2) stays what the lengths make of it,
    energy stays, and the motion is that of the exact linkage, all for the digits there are."""
    found, size = run(bennett(angle, 6.0, digits), output_times=TIMES), 10.0**-digits
    assert found.success and found.q[-1, 0] > 2 * np.pi
    assert np.abs(found.q[0]).max() < 1e2 * size + 1e-9
    first, second = angle + found.q[:, 0], found.q[:, 1]
    second = second + 2 * np.arctan(bennett_ratio() / np.tan(angle / 2))
    kept = np.sin(first / 2) * np.sin(second / 2)
    kept -= bennett_ratio() * np.cos(first / 2) * np.cos(second / 2)
    assert np.abs(kept).max() < 1e2 * size + 1e-8
    energy = found.energy()
    assert np.abs(energy - energy[0]).max() < 25 * (1e2 * size + 1e-9)
    assert np.abs(found.q - exact(angle).q).max() < 1e3 * size + 1e-7


@pytest.mark.parametrize("digits", [4, 5, 6])
def test_rounded_numbers_are_named_as_the_cause(digits: int) -> None:
    """The gap of the row that is left out is that of the numbers, and no tolerance closes it."""
    found = run(bennett(0.7, 6.0, digits), certify=True)
    risks = {risk.name: risk for risk in found.risks}
    gap = risks["nearly-redundant"]
    assert gap.value is not None and 0.1 < gap.value * 10.0**digits < 1e2
    assert "give the axes and lengths of the loop with more digits" in gap.remedy
    assert all("rtol" not in risk.remedy for risk in found.risks)
    assert not found.trusted


def test_exact_numbers_leave_no_gap() -> None:
    closure = run(bennett(0.7, 6.0), certify=True).certificate.loop_closure
    assert closure is not None and closure.misfit == 0.0


@pytest.mark.parametrize("digits", [None, 6])
def test_it_does_not_tell_where_a_run_began(digits: int | None) -> None:
    """The same motion from the pose drawn at its start, and from those that it comes through."""
    whole = exact(0.7)
    for k in (12, 25, 40):
        angle, speed = 0.7 + whole.q[k, 0], whole.u[k, 0]
        part = run(bennett(angle, speed, digits), 1.0, output_times=TIMES[:21])
        apart = part.q[:, 0] + whole.q[k, 0] - whole.q[k : k + 21, 0]
        assert np.abs(apart).max() < (1e-7 if digits is None else 1e-3)


def accelerations(scene: dict[str, Any], states: list[tuple[Array, Array]]) -> Array:
    model = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    return np.array([model.accelerations(q, u) for q, u in states])


def test_accelerations_stay_at_rounding_at_all_poses() -> None:
    """Those of a linkage drawn in one pose are those of the same drawn where it is now."""
    whole = exact(0.7)
    states = [(whole.q[k], whole.u[k]) for k in range(1, 61)]
    found = accelerations(bennett(0.7), states)
    for here, (q, u) in zip(found, states, strict=True):
        drawn = accelerations(bennett(0.7 + q[0]), [(np.zeros(4), u)])[0]
        assert np.abs(drawn - here).max() < 1e-10 * np.abs(here).max()


@pytest.mark.parametrize("digits", [4, 6, 8, 10])
def test_a_bricard_ring_turned_in_space_moves_as_it_stands(digits: int) -> None:
    """With its numbers rounded to so many digits, against the exact ring in line with the axes."""
    times = np.linspace(0.0, 3.0, 31)
    wanted = run(bricard(), output_times=times, rtol=1e-9)
    scene = rotate_scene(bricard(), digits)
    found = run(scene, output_times=times, rtol=1e-9)
    assert found.success
    assert np.abs(found.q - wanted.q).max() < 50 * 10.0**-digits + 1e-7
    energy = found.energy()
    assert np.abs(energy - energy[0]).max() < 50 * (10.0**-digits + 1e-7)


def rotate_scene(scene: dict[str, Any], digits: int) -> dict[str, Any]:
    """Rotate the scene in space and round the vectors that its hinges depend on."""
    turn = orientation(OBLIQUE)

    def rounded_vector(x: Any) -> list[float]:
        return [round(float(number), digits) for number in turn @ np.array(x, float)]

    scene["gravity"] = [float(x) for x in turn @ np.array(scene["gravity"], float)]
    for body in scene["body"]:
        inertia = turn @ np.diag(body["inertia"]) @ turn.T
        body["inertia"] = [float(inertia[pair]) for pair in PAIRS]
        body["center_of_mass"] = [float(x) for x in turn @ np.array(body["center_of_mass"])]
        body["ends"] = {name: rounded_vector(end) for name, end in body["ends"].items()}
    for hinge in scene["hinge"]:
        hinge["axis"] = rounded_vector(hinge["axis"])
        if "position" in hinge:
            hinge["position"] = rounded_vector(hinge["position"])
    return scene


def test_fused_code_goes_by_the_same_rows() -> None:
    scene = bennett(0.7, 6.0)
    model = mstmm.compile(mstmm.Scene(**scene), engine="fused")
    found = model.simulate(3.0, rtol=1e-10, atol=1e-10, output_times=TIMES)
    assert np.abs(found.q - exact(0.7).q).max() < 1e-8
    wanted = accelerations(scene, list(zip(found.q, found.u, strict=True)))
    there = np.array([model.accelerations(q, u) for q, u in zip(found.q, found.u, strict=True)])
    assert np.abs(there - wanted).max() < 1e-9 * np.abs(wanted).max()
