"""Loops that close in several ways: where a model begins, and how the other ways are had."""

from __future__ import annotations

import cmath
import itertools
import math
from typing import Any

import numpy as np
import pytest

import mstmm
from tests.reference.jets import Array
from tests.support.scenes.linkages import rod

#: Crank, coupler and rocker, and between their feet; a second dyad on the rocker, its foot, m.
CRANK, COUPLER, ROCKER, FEET = 0.3, 1.0, 0.8, 1.0
ARM, FIRST, SECOND, FAR = 1.2, 1.1, 1.3, 2.0


def corner(one: complex, other: complex, near: float, far: float, side: int) -> complex:
    """Where two rods that stand at two places meet, on one side of the line between these."""
    across = other - one
    cosine = (near**2 + abs(across) ** 2 - far**2) / (2 * near * abs(across))
    return one + near * cmath.exp(1j * (cmath.phase(across) + side * math.acos(cosine)))


def angles(crank: float, sides: tuple[int, ...]) -> dict[str, float]:
    """Angles of all pins, each against the body before it; one dyad, or two."""
    tip = CRANK * cmath.exp(1j * crank)
    knee = corner(tip, FEET, COUPLER, ROCKER, sides[0])
    coupler, rocker = cmath.phase(knee - tip), cmath.phase(knee - FEET)
    found = {"foot": crank, "knee": coupler - crank, "heel": rocker, "tip": rocker - coupler}
    if len(sides) > 1:
        end = FEET + ARM * cmath.exp(1j * rocker)
        meeting = corner(end, FAR, FIRST, SECOND, sides[1])
        first, second = cmath.phase(meeting - end), cmath.phase(meeting - FAR)
        found |= {"arm": first - rocker, "toe": second, "top": second - first}
    return found


def linkage(starts: dict[str, float], cut: str = "heel", dyads: int = 1) -> dict[str, Any]:
    """A crank whose foot is held, a dyad, and another on the rocker's long arm, so begun."""
    rocker = rod("rocker", ARM)
    rocker["ends"]["top"] = [ROCKER, 0, 0]
    bodies = [rod("crank", CRANK), rod("coupler", COUPLER), rocker]
    sides = {
        "foot": ("ground", "crank", 0.0), "knee": ("crank.tip", "coupler", 0.0),
        "heel": ("ground", "rocker", FEET), "tip": ("coupler.tip", "rocker.top", 0.0),
    }  # fmt: skip
    if dyads > 1:
        bodies += [rod("first", FIRST), rod("second", SECOND)]
        sides |= {
            "arm": ("rocker.tip", "first", 0.0), "toe": ("ground", "second", FAR),
            "top": ("first.tip", "second.tip", 0.0),
        }  # fmt: skip
    hinges = []
    for name, (inboard, outboard, x) in sides.items():
        hinge: dict[str, Any] = {
            "name": name, "type": "pin", "axis": [0, 0, 1], "inboard": inboard,
            "outboard": outboard, "hold": name == "foot",
        }  # fmt: skip
        if inboard == "ground":
            hinge["position"] = [x, 0, 0]
        if name in starts:
            hinge["initial"] = {"q": [starts[name]]}
        if name == cut:
            hinge["cut"] = True
        hinges.append(hinge)
    return {"gravity": [0, 0, 0], "body": bodies, "hinge": hinges}


def wrap_angle(angle: Array | float) -> Any:
    return (np.asarray(angle) + np.pi) % (2 * np.pi) - np.pi


def largest_angle_error(model: mstmm.Model, q: Array, wanted: dict[str, float]) -> float:
    """Largest difference of the angles of a state from those wanted, rad."""
    slots = model.coordinate_layout.hinges
    return max(abs(float(wrap_angle(q[slots[name].q] - angle))) for name, angle in wanted.items())


@pytest.mark.parametrize("crank", [-3.0, 0.4, 2.0])
@pytest.mark.parametrize("sides", list(itertools.product((1, -1), repeat=2)))
@pytest.mark.parametrize("cut", ["heel", "tip"])
def test_the_starts_of_cut_hinges_count(cut: str, sides: tuple[int, int], crank: float) -> None:
    """Whatever is cut: with a start for one hinge of each body the loops close just there."""
    wanted = angles(crank, sides)
    starts = {name: wanted[name] for name in ("foot", "knee", "heel", "arm", "toe")}
    model = mstmm.compile(mstmm.Scene(**linkage(starts, cut, 2)))
    assert largest_angle_error(model, model.initial_state()[0], wanted) < 1e-9


def test_zeros_of_hinges_that_close_loops_are_none() -> None:
    """Files written by programs state zeros that nobody asked for."""
    wanted = angles(-3.0, (1, 1))
    starts = {name: wanted[name] for name in ("foot", "knee", "heel", "arm", "toe")}
    model = mstmm.compile(mstmm.Scene(**linkage(starts | {"tip": 0.0, "top": 0.0}, dyads=2)))
    assert largest_angle_error(model, model.initial_state()[0], wanted) < 1e-9


@pytest.mark.parametrize("cut", ["heel", "tip"])
@pytest.mark.parametrize("side", [1, -1])
def test_a_crank_takes_the_nearest_branch_at_every_angle(side: int, cut: str) -> None:
    """Of the two ways in which a crank-rocker closes, by starts that are off by up to 0.3 rad, and
    by the rocker's alone: the coupler's is free."""
    draw = np.random.default_rng(5)
    for crank in np.linspace(-np.pi, np.pi, 13):
        both = [angles(float(crank), (s,)) for s in (1, -1)]
        wish = angles(float(crank), (side,))
        starts = {name: wish[name] + draw.uniform(-0.3, 0.3) for name in ("knee", "heel")}
        for names in (("knee", "heel"), ("heel",)):
            given = {name: starts[name] for name in names} | {"foot": float(crank)}
            far = [sum(float(wrap_angle(one[n] - given[n])) ** 2 for n in names) for one in both]
            model = mstmm.compile(mstmm.Scene(**linkage(given, cut)))
            nearest = both[int(np.argmin(far))]
            assert largest_angle_error(model, model.initial_state()[0], nearest) < 1e-9
            found = model.loops.branches[0].distance
            assert abs(found - math.sqrt(min(far))) < 1e-6


def test_all_branches_are_told() -> None:
    """Four of two dyads, where the start is closed and where it is not, the nearest first."""
    wanted = angles(0.4, (1, -1))
    for wrong in (0.0, 0.2):
        starts = {
            n: wanted[n] + wrong * (n == "knee") for n in ("foot", "knee", "heel", "arm", "toe")
        }
        model = mstmm.compile(mstmm.Scene(**linkage(starts, dyads=2)))
        branches = model.loops.branches
        assert largest_angle_error(model, branches[0].q, wanted) < 1e-9
        assert sorted(one.distance for one in branches) == [one.distance for one in branches]
        for sides in itertools.product((1, -1), repeat=2):
            other = angles(0.4, sides)
            assert sum(largest_angle_error(model, one.q, other) < 1e-9 for one in branches) == 1
        assert branches[0].pose["foot"] == (0.4,)


def test_a_state_on_another_branch() -> None:
    wanted = angles(0.4, (1,))
    model = mstmm.compile(mstmm.Scene(**linkage(wanted)))
    q = np.array(model.initial_state()[0])
    for number, side in enumerate((1, -1)):
        for crank in (0.4, 3.0, -2.5):
            q[model.coordinate_layout.hinges["foot"].q] = crank
            found, _ = model.assemble(q, hold=["foot"], branch=number)
            assert found[model.coordinate_layout.hinges["foot"].q] == crank
            assert largest_angle_error(model, found, angles(crank, (side,))) < 1e-9
    impossible: list[Any] = [2, -1, True, 1.0]
    for number in impossible:
        with pytest.raises(mstmm.SceneError, match=r"expected 0 to 1, see loops\.branches"):
            model.assemble(q, hold=["foot"], branch=number)


def test_a_path_stays_on_its_branch() -> None:
    """A whole turn of the crank, in steps that are too long for one leap."""
    model = mstmm.compile(mstmm.Scene(**linkage(angles(0.4, (1,)))))
    rows = np.tile(model.initial_state()[0], (9, 1))
    rows[:, model.coordinate_layout.hinges["foot"].q] = 0.4 + np.linspace(0, 2 * np.pi, 9)
    for number, side in enumerate((1, -1)):
        found = model.assemble_path(rows, ["foot"], number)
        for row, q in zip(rows, found, strict=True):
            assert (
                largest_angle_error(
                    model, q, angles(row[model.coordinate_layout.hinges["foot"].q], (side,))
                )
                < 1e-9
            )


def test_the_state_nearest_to_what_is_asked() -> None:
    """`assemble` takes all that it is given for wishes, those of cut hinges as well."""
    model = mstmm.compile(mstmm.Scene(**linkage(angles(0.4, (1,)))))
    for crank, side in itertools.product((0.9, 2.2, -1.5), (1, -1)):
        wanted = angles(crank, (side,))
        q = np.zeros(model.nq)
        for name, angle in wanted.items():
            q[model.coordinate_layout.hinges[name].q] = angle + 0.1 * (name == "knee")
        found, _ = model.assemble(q, hold=["foot"])
        assert largest_angle_error(model, found, wanted) < 1e-9


def test_a_closed_start_stays_as_it_is() -> None:
    wanted = angles(0.4, (-1,))
    model = mstmm.compile(mstmm.Scene(**linkage(wanted, "tip")))
    (q, _), slots = model.initial_state(), model.coordinate_layout.hinges
    for name in ("foot", "knee", "heel"):
        assert abs(q[slots[name].q] - wanted[name]) < 1e-15
