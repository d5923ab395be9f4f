"""Loops that balls close, against Pinocchio (constrained) and MuJoCo (equalities).

MuJoCo's equalities always give way a little: 0.9999 of a row is the most that its `solimp` allows,
so that no more than 1e-3 is asked of it (3e-4 is found; of Pinocchio 3e-15).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import mstmm
from tests.reference.compare import worst
from tests.support.peers.mujoco_peer import MujocoPeer
from tests.support.peers.pinocchio_peer import PinocchioPeer
from tests.support.scenes.linkages import OBLIQUE, four_bar, legs

SCENES = {
    "spatial four-bar": four_bar(
        tilt=OBLIQUE,
        knee={"type": "universal", "axis": [0, 0, 1], "axis2": [0, 1, 0], "initial": {"q": [0, 0]}},
        tip={"type": "ball", "initial": {"q": [1, 0, 0, 0]}},
    ),
    "platform": legs(law=2e3),
}


class Mechanism:
    """A scene, its tree without the hinges that close loops, and a closed state that moves."""

    def __init__(self, scene: dict[str, Any], rng: np.random.Generator) -> None:
        self.model = model = mstmm.compile(mstmm.Scene(**scene))
        cut = model.loops.cut_hinges
        self.hinges = [hinge for hinge in scene["hinge"] if hinge["name"] not in cut]
        closing = [hinge for hinge in scene["hinge"] if hinge["name"] in cut]
        assert closing and all(hinge["type"] == "ball" for hinge in closing)
        self.ends = [(hinge["inboard"], hinge["outboard"]) for hinge in closing]
        self.tree = scene | {"hinge": self.hinges}
        start, _ = model.initial_state()
        u = np.zeros(model.nu)
        for name, slots in model.coordinate_layout.hinges.items():
            if name == "foot" or name.startswith("slide"):  # these are free
                u[slots.u] = rng.uniform(-1, 1)
        self.q, self.u = model.assemble(start + rng.uniform(-0.1, 0.1, model.nq), u, hold=[])

    def of_tree(self, values: Any, kind: str) -> Any:
        slots = [self.model.coordinate_layout.hinges[hinge["name"]] for hinge in self.hinges]
        return np.concatenate([values[getattr(one, kind)] for one in slots])


def pinocchio(one: Mechanism) -> Any:
    """Its accelerations of the tree."""
    peer = PinocchioPeer(one.tree)
    q, u = one.of_tree(one.q, "q_slice"), one.of_tree(one.u, "u_slice")
    rows = pin.StdVec_RigidConstraintModel()
    for ends in one.ends:
        places = []
        for end in ends:
            body, place, axes = peer.tree.end(end)
            joint, local = peer.carrier[body]
            places += [joint, local * pin.SE3(axes, place)]
        kinds = pin.ContactType.CONTACT_3D, pin.ReferenceFrame.LOCAL
        rows.append(pin.RigidConstraintModel(kinds[0], peer.model, *places, kinds[1]))
    data = pin.StdVec_RigidConstraintData()
    for row in rows:
        data.append(row.createData())
    pin.initConstraintDynamics(peer.model, peer.data, rows, data)
    settings = pin.ProximalSettings(1e-14, 0.0, 1)
    state = peer.coordinates(q), peer.speeds(u), peer.speeds(peer._efforts(q, u, 0.0))
    return peer.back(pin.constraintDynamics(peer.model, peer.data, *state, rows, data, settings))


@pytest.mark.parametrize("draw", range(5))
@pytest.mark.parametrize("what", SCENES)
def test_pinocchio_in_closed_states(what: str, draw: int) -> None:
    one = Mechanism(SCENES[what], np.random.default_rng(draw))
    found = one.of_tree(one.model.accelerations(one.q, one.u), "u_slice")
    assert worst(found, pinocchio(one)) < 1e-12


@pytest.mark.parametrize("draw", range(5))
@pytest.mark.parametrize("what", SCENES)
def test_mujoco_in_closed_states(what: str, draw: int) -> None:
    one = Mechanism(SCENES[what], np.random.default_rng(draw))
    peer = MujocoPeer(one.tree, one.ends)
    q, u = one.of_tree(one.q, "q_slice"), one.of_tree(one.u, "u_slice")
    found = one.of_tree(one.model.accelerations(one.q, one.u), "u_slice")
    assert worst(found, peer.accelerations(q, u)) < 1e-3
