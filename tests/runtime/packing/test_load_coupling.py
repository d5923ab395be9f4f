"""Which loads the elimination of a tangent sees, and which reach across the tree."""

from __future__ import annotations

from typing import Any

import pytest

import mstmm
from mstmm.runtime.packing.load_coupling import LoadDependence
from mstmm.runtime.packing.scene_packing import pack

#: A chain of three and a branch from its middle: places 0, 1, 2 and 3.
BODIES = ("base", "arm", "hand", "flag")
INBOARD = ("ground", "base.tip", "arm.tip", "arm.side")


def reach(efforts: dict[str, str] | None = None, **tables: list[dict[str, Any]]) -> LoadDependence:
    rod = {"mass": 1.0, "inertia": [0.1, 0.1, 0.1], "ends": {"tip": [1, 0, 0], "side": [0, 1, 0]}}
    hinge = [
        {"name": f"to_{name}", "type": "pin", "inboard": inboard, "outboard": name,
         "law": {"effort": (efforts or {}).get(name, 0.0)}}
        for name, inboard in zip(BODIES, INBOARD, strict=True)
    ]  # fmt: skip
    scene = mstmm.Scene(
        gravity=[0, 0, -9.81], body=[rod | {"name": name} for name in BODIES], hinge=hinge, **tables
    )
    return pack(scene).written.load_dependence


def test_no_loads() -> None:
    assert reach() == LoadDependence((), (), (), (), (), (), ())


@pytest.mark.parametrize(
    ("load", "own", "placed", "across"),
    [
        ({"on": "arm.tip", "force": [0, "sin(t)", 1.0]}, True, (0, 1), ()),
        ({"on": "hand", "moment": [0, 0, 1.0]}, True, (0, 1, 2), ()),
        ({"on": "arm", "force": [0, 0, 1.0], "axes": "body"}, False, (), ()),
        ({"on": "arm", "force": [0, 0, 1.0], "axes": "flag"}, False, (), (1,)),
        ({"on": "flag", "force": [0, "to_base.q", 0]}, False, (), (3,)),
    ],
    ids=["in space", "moment", "follower", "another's axes", "by the state"],
)
def test_loads(
    load: dict[str, Any], own: bool, placed: tuple[int, ...], across: tuple[int, ...]
) -> None:
    found = reach(load=[load])
    assert (found.loads, found.own_load_bodies, found.coupled_bodies) == ((own,), placed, across)


@pytest.mark.parametrize(
    ("spring", "own", "placed", "across"),
    [
        ({"from": "ground", "to": "hand.tip", "law": {"stiffness": 1.0}}, True, (0, 1, 2), ()),
        ({"from": "flag", "to": "ground", "law": {"effort": "q*t"}}, True, (0, 1, 3), ()),
        ({"from": "base", "to": "flag", "law": {"stiffness": 1.0}}, False, (), (0, 3)),
        ({"from": "ground", "to": "arm", "law": {"effort": "to_flag.u"}}, False, (), (1,)),
    ],
    ids=["to the ground", "from the ground, by its own length", "between bodies", "by the state"],
)
def test_springs(
    spring: dict[str, Any], own: bool, placed: tuple[int, ...], across: tuple[int, ...]
) -> None:
    found = reach(spring=[spring])
    assert (found.forces, found.own_load_bodies, found.coupled_bodies) == ((own,), placed, across)


@pytest.mark.parametrize(
    ("tables", "watched"),
    [
        ({"load": [{"on": "arm", "force": [0, 0, 1.0], "axes": "flag"}]}, [{1, 3}]),
        ({"load": [{"on": "flag", "force": [0, "to_base.q", 0]}]}, [{0, 3}]),
        (
            {"spring": [{"from": "base", "to": "flag", "law": {"stiffness": 1.0}},
                        {"from": "arm", "to": "flag", "law": {"stiffness": 1.0}}]},
            [{0, 3}, {1, 3}, {0, 1, 3}],
        ),
        (
            {"spring": [{"from": "base", "to": "flag", "law": {"stiffness": 1.0}},
                        {"from": "arm", "to": "flag", "law": {"effort": "to_hand.u"}}]},
            [{0, 3}, {1, 2, 3}, {0, 1, 2, 3}],
        ),
    ],
    ids=["another's axes", "by the state", "springs", "one by the state"],
)  # fmt: skip
def test_what_is_watched(tables: dict[str, Any], watched: list[set[int]]) -> None:
    assert list(reach(**tables).load_sources) == watched


def test_efforts_hear_what_they_read() -> None:
    """Of the values of a law those of the state count, by the bodies that they read."""
    found = reach({"flag": "sin(t)*to_base.u", "hand": "cos(t)", "arm": "u - 2*to_hand.q"})
    assert [speed for _, speed in found.efforts] == [1, 3]
    assert found.effort_sources == (frozenset({1, 2}), frozenset({0}))
