"""Small scenes as data, to be changed one key at a time."""

from __future__ import annotations

import copy
from typing import Any

from mstmm.scene.checks.topology import Topology

Data = dict[str, Any]


def body(name: str = "rod1", **changes: Any) -> Data:
    return {
        "name": name,
        "mass": 1.0,
        "center_of_mass": [0.5, 0, 0],
        "inertia": [0.001, 0.084, 0.084],
        "ends": {"tip": [1, 0, 0]},
    } | changes


def hinge(name: str = "shoulder", **changes: Any) -> Data:
    return {"name": name, "type": "pin", "inboard": "ground", "outboard": "rod1"} | changes


def arm(**changes: Any) -> Data:
    """Two rods on pins, a load, an event and a spring."""
    return {
        "schema_version": 1,
        "gravity": [0, -9.81, 0],
        "body": [body(), body("rod2")],
        "hinge": [hinge(), hinge("elbow", inboard="rod1.tip", outboard="rod2")],
        "load": [{"on": "rod2.tip", "force": [0, "10*cos(t)", 0]}],
        "event": [{"when": "rod2.tip.x < 0.1", "do": "stop"}],
        "spring": [{"from": "ground", "to": "rod1.tip", "law": {"stiffness": 100.0}}],
    } | changes


def one_rod(**changes: Any) -> Data:
    """One rod on one hinge; `changes` are to the hinge."""
    return {"gravity": [0, 0, -9.81], "body": [body()], "hinge": [hinge(**changes)]}


def change_value(data: Data, *path: str | int, to: Any) -> Data:
    """A copy with one value replaced; `to=...` (Ellipsis) removes the key."""
    copied = copy.deepcopy(data)
    inside: Any = copied
    for part in path[:-1]:
        inside = inside[part]
    if to is ...:
        del inside[path[-1]]
    else:
        inside[path[-1]] = to
    return copied


def beam(name: str = "blade", **changes: Any) -> Data:
    """A beam of 10 m; `...` removes a key."""
    table = {
        "name": name,
        "length": 10.0,
        "mass_per_length": 1.2,
        "bending_stiffness": 1.4e4,
        "modes": 3,
    } | changes
    return {key: value for key, value in table.items() if value is not ...}


def blade_scene(**changes: Any) -> Data:
    """One beam on a fixed hinge; `changes` are to the beam."""
    held = {"name": "hub", "type": "fixed", "inboard": "ground", "outboard": "blade"}
    return {"gravity": [0, 0, -9.81], "beam": [beam(**changes)], "hinge": [held]}


def is_chain(tree: Topology) -> bool:
    """Whether it is one unbranched chain from the ground."""
    return all(run.parent == run.position - 1 for run in tree.runs)
