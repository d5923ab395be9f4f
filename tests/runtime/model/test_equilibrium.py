"""Chains of links between two supports: against the catenary of links."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq, root

import mstmm
from mstmm.errors import NumericalFailure

Array = NDArray[np.float64]

GRAVITY, LENGTH, MASS = 9.81, 0.5, 0.05


def link(name: str) -> dict[str, Any]:
    return {"name": name, "mass": MASS, "center_of_mass": [LENGTH / 2, 0, 0],
            "inertia": [0.0, MASS * LENGTH**2 / 12, MASS * LENGTH**2 / 12],
            "ends": {"t": [LENGTH, 0, 0]}}  # fmt: skip


def chain(angles: Array, closing: str = "pin", gravity: float = GRAVITY) -> dict[str, Any]:
    """Links at these angles, whose last end is held where it is."""
    count, turns = len(angles), np.diff(angles, prepend=0.0)
    end = [LENGTH * float(np.cos(angles).sum()), LENGTH * float(np.sin(angles).sum()), 0.0]
    scene: dict[str, Any] = {
        "gravity": [0, -gravity, 0],
        "body": [link(f"link{i}") for i in range(count)],
        "hinge": [
            {"name": f"pin{i}", "type": "pin", "inboard": f"link{i - 1}.t" if i else "ground",
             "outboard": f"link{i}", "initial": {"q": float(turns[i])}}
            for i in range(count)
        ],
    }  # fmt: skip
    if closing == "pin":
        scene["body"].append({"name": "anchor", "mass": 1.0, "inertia": [1, 1, 1]})
        scene["hinge"] += [
            {"name": "held", "type": "fixed", "inboard": "ground", "outboard": "anchor",
             "position": end},
            {"name": "end", "type": "pin", "inboard": f"link{count - 1}.t", "outboard": "anchor"},
        ]  # fmt: skip
    else:
        scene["constraint"] = [
            {"name": f"along{axis}", "type": "point-on-plane", "from": "ground",
             "to": f"link{count - 1}.t", "position": end, "normal": [axis == 0, axis == 1, 0]}
            for axis in range(2)
        ]  # fmt: skip
        for one in scene["constraint"]:
            one["normal"] = [float(x) for x in one["normal"]]
    return scene


def arc(count: int, span: float) -> Array:
    """Angles of links along an arc that sags, over so much of its length."""
    most = brentq(lambda a: np.cos(np.linspace(-a, a, count)).sum() - span * count, 1e-9, 3.0)
    return np.linspace(-most, most, count)


def catenary(angles: Array) -> Array:
    """Angles at rest of links that hang between the ends of those given: of each, the vertical
    load in its middle over the horizontal one."""
    weights = np.arange(len(angles)) + 0.5
    ends = np.array([np.cos(angles).sum(), np.sin(angles).sum()])

    def hanging(loads: Array) -> Array:
        return np.arctan2(weights - loads[1], np.exp(loads[0]))

    def missing(loads: Array) -> Array:
        found = hanging(loads)
        return np.array([np.cos(found).sum(), np.sin(found).sum()]) - ends

    start = [np.log(0.3 * len(angles)), 0.5 * len(angles) - 0.2 * ends[1]]
    solved = root(missing, start, tol=1e-14)
    assert np.abs(missing(solved.x)).max() < 1e-10
    return hanging(solved.x)


def angles_of(found: Array, model: mstmm.Model) -> Array:
    """Of the links in space."""
    hinges = model.coordinate_layout.hinges
    turns = [found[hinges[name].q] for name in hinges if name.startswith("pin")]
    return np.cumsum(turns)


def angle_difference(one: Array, other: Array) -> float:
    return float(np.abs(np.exp(1j * one) - np.exp(1j * other)).max())


STARTS = {
    "arc of 8": arc(8, 0.625),
    "arc of 11": arc(11, 0.6),
    "zigzag of 14": np.where(np.arange(14) % 2, 0.9, -0.9),
    "upside down, 16": -arc(16, 0.7),
    "one end higher, 20": arc(20, 0.5) + 0.6,
    "nearly taut, 20": arc(20, 0.9999),
    "deep, 30": np.where(np.arange(30) < 15, -1.5, 1.5),
}


@pytest.mark.parametrize("closing", ["pin", "planes"])
@pytest.mark.parametrize("name", STARTS)
def test_a_chain_hangs_as_a_catenary_of_links(name: str, closing: str) -> None:
    start = STARTS[name]
    model = mstmm.compile(mstmm.Scene(**chain(start, closing)), engine="looped")
    found = model.equilibrium()
    assert angle_difference(angles_of(found, model), catenary(start)) < 1e-8
    assert found.unstable_speeds == () and found.trusted
    assert max(map(abs, found.residuals.values())) < 1e-7


@pytest.mark.parametrize("count", [8, 200])
def test_a_straight_chain_is_closed_and_hangs(count: int) -> None:
    """Links in a row are bent to meet two planes, and hang from there."""
    scene = chain(np.zeros(count), "planes")
    span = 0.625 * LENGTH * count
    for one in scene["constraint"]:
        one["position"] = [span, 0.0, 0.0]
    model = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    found = model.equilibrium()
    assert angle_difference(angles_of(found, model), catenary(arc(count, 0.625))) < 1e-8


def test_a_thousand_links_hang_after_few_steps() -> None:
    """Each of them O(links)."""
    start = np.where(np.arange(1000) < 500, -0.8, 0.8)
    model = mstmm.compile(mstmm.Scene(**chain(start)), engine="looped")
    steps = list[float]()
    found = model.equilibrium(progress=lambda _, length: steps.append(length))
    assert angle_difference(angles_of(found, model), catenary(start)) < 1e-8
    assert found.unstable_speeds == () and len(steps) < 60


def test_nothing_pushes_a_chain_without_weight() -> None:
    model = mstmm.compile(mstmm.Scene(**chain(arc(9, 0.6), gravity=0.0)), engine="looped")
    with pytest.raises(NumericalFailure, match=r"undetermined along .*pin0\.angle_rate"):
        model.equilibrium()


def test_the_search_is_limited_told_of_and_broken_off() -> None:
    model = mstmm.compile(mstmm.Scene(**chain(arc(12, 0.6))), engine="looped")
    told = list[int]()
    with pytest.raises(
        NumericalFailure, match=r"not converged after 3 steps.*remaining efforts: .*max_st"
    ):
        model.equilibrium(max_steps=3, progress=lambda number, _: told.append(number))
    assert told == [0, 1, 2]

    def raise_interrupt(number: int, length: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        model.equilibrium(progress=raise_interrupt)
    with pytest.raises(mstmm.SceneError, match="max_steps = 0"):
        model.equilibrium(max_steps=0)


def test_links_on_balls_hang_and_may_spin() -> None:
    """A link that turns about its own line changes nothing; where it carries an end beside its
    line, that goes nowhere in particular, and is named."""
    start = arc(12, 0.6)
    scene = chain(start, "planes")
    for one, turn in zip(scene["hinge"], np.diff(start, prepend=0.0), strict=True):
        half = float(turn) / 2
        one |= {"type": "ball", "initial": {"q": [float(np.cos(half)), 0, 0, float(np.sin(half))]}}
    for body in scene["body"]:
        body["inertia"][0] = 1e-6
    position = scene["constraint"][0]["position"]
    scene["constraint"].append(
        {
            "name": "alongz",
            "type": "point-on-plane",
            "from": "ground",
            "to": "link11.t",
            "position": position,
            "normal": [0, 0, 1],
        }
    )
    model = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    found = model.equilibrium()
    told = {risk.name: risk for risk in found.risks}
    assert found.unstable_speeds == () and found.trusted
    assert "pin0.wx" in told["free-spin"].element
    seen = model.simulate(0.0, "dop853", initial=(found, np.zeros(model.nu)))
    ends = np.array([seen.position(f"link{i}.t")[0] for i in range(12)])
    wanted = LENGTH * np.cumsum(np.exp(1j * catenary(start)))
    assert np.abs(ends[:, 0] + 1j * ends[:, 1] - wanted).max() < 1e-7
    assert np.abs(ends[:, 2]).max() < 1e-7
    scene["body"][5]["ends"]["hook"] = [0.2, 0.1, 0.0]
    hooked = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    with pytest.raises(NumericalFailure, match="undetermined along"):
        hooked.equilibrium()


@pytest.mark.parametrize("way, held", [(-1, True), (1, False)])
def test_a_chain_folded_between_supports_in_one_place_is_stable_where_it_hangs(
    way: int, held: bool
) -> None:
    """All links are in line there, and how the supports share the weight is not determined; gravity
    tells a chain that hangs from one that stands: of many states beside, all or some are higher."""
    count = 8
    start = way * np.pi / 2 * np.where(np.arange(count) < count // 2, 1.0, -1.0)
    scene = chain(np.zeros(count), "planes")
    for one in scene["constraint"]:
        one["position"] = [0.0, 0.0, 0.0]
    model = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    found = model.equilibrium(np.diff(start, prepend=0.0))
    assert angle_difference(angles_of(found, model), start) < 1e-6
    assert (found.unstable_speeds == ()) is held
    weights, draw = count - np.arange(count) - 0.5, np.random.default_rng(1)
    higher = list[bool]()
    for _ in range(20):
        beside = model.assemble(found + draw.uniform(-0.02, 0.02, count))[0]
        rise = weights @ (np.sin(angles_of(beside, model)) - np.sin(start))
        higher.append(bool(rise > 0))
    assert all(higher) is held
