"""Scenes in a plane are swept in it: as in space, but for what is across the plane."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import mstmm
from tests.reference.jets import Array
from tests.support.scenes.linkages import bricard

#: Lengths of a row of two windows that lean, and how far its bodies lie across the plane.
CRANK, COUPLER, ANGLE, APART = 0.8, 1.1, 0.6, 0.3


def windows(count: int, base: str) -> dict[str, Any]:
    """Windows of lopsided bodies in planes apart, standing on `base`, with all that acts on hinges
    and bodies."""
    rod = {"mass": 1.3, "center_of_mass": [0.4, 0.07, 0.2],
           "inertia": [0.1, 0.2, 0.25, 0.01, 0.02, 0.03],
           "ends": {"crank": [CRANK, 0, 0], "coupler": [COUPLER, 0, APART]}}  # fmt: skip
    names = [*(f"crank{k}" for k in range(count + 1)), *(f"coupler{k}" for k in range(count))]
    feet = {f"foot{k}": [COUPLER * k, 0.0, APART * k] for k in range(count + 1)}
    hinges: list[dict[str, Any]] = [
        {"name": name, "type": "pin", "outboard": f"crank{k}",
         "initial": {"q": ANGLE, "u": 0.7},
         **({"inboard": "ground", "position": foot} if base == "ground"
            else {"inboard": f"{base}.{name}"})}
        for k, (name, foot) in enumerate(feet.items())
    ]  # fmt: skip
    for k in range(count):
        hinges += [
            {"name": f"left{k}", "type": "pin", "inboard": f"crank{k}.crank",
             "outboard": f"coupler{k}", "initial": {"q": -ANGLE, "u": -0.7}},
            {"name": f"right{k}", "type": "pin", "inboard": f"coupler{k}.coupler",
             "outboard": f"crank{k + 1}.crank", "initial": {"q": ANGLE, "u": 0.7}},
        ]  # fmt: skip
    hinges[0] |= {"law": {"stiffness": 20.0, "damping": 0.4, "inertia": 0.05}}
    hinges[-1] |= {"law": {"damping": 0.3, "stiffness": 2.0}}
    bodies = [rod | {"name": name} for name in names]
    if base != "ground":
        bodies.append(rod | {"name": base, "ends": feet})
        hinges.append({"name": "below", "type": "pin", "inboard": "ground", "outboard": base,
                       "initial": {"u": 0.2}})  # fmt: skip
    return {
        "gravity": [1.0, -9.0, 2.0],
        "body": bodies,
        "hinge": hinges,
        "load": [{"on": "coupler0.coupler", "force": ["3*cos(t)", 2.0, 5.0], "moment": [1, 2, 3]}],
        "spring": [{"name": "tie", "from": "crank0.crank", "to": "coupler1.coupler",
                    "law": {"stiffness": 50.0, "damping": 1.0, "rest": 1.0}}],
    }  # fmt: skip


@pytest.mark.parametrize(("count", "base"), [(2, "ground"), (2, "plate"), (9, "ground")])
def test_accelerations_are_those_in_space(count: int, base: str) -> None:
    model = mstmm.compile(mstmm.Scene(**windows(count, base)), engine="looped")
    draw = np.random.default_rng(5)
    q, _ = model.initial_state()
    states = [(q + 0.1 * draw.standard_normal(model.nq), draw.standard_normal(model.nu))
              for _ in range(5)]  # fmt: skip
    flat = [model.accelerations(*state) for state in states]
    assert model.packed_scene.model.flat
    model.packed_scene.model.flat = model.packed_scene.ffi.NULL
    for state, found in zip(states, flat, strict=True):
        assert found == pytest.approx(model.accelerations(*state), rel=1e-11, abs=1e-11)


def rotate_scene(scene: dict[str, Any], rotation: Array) -> dict[str, Any]:
    """The scene with everything in it turned, but for what acts in inertial axes."""

    def vector(of: list[float]) -> list[float]:
        return (rotation @ of).tolist()

    body = [one | {"center_of_mass": vector(one["center_of_mass"]), "inertia": [0.1, 0.1, 0.1],
                   "ends": {name: vector(end) for name, end in one["ends"].items()}}
            for one in scene["body"]]  # fmt: skip
    hinge = [one | {"axis": vector([0, 0, 1])}
             | ({"position": vector(one["position"])} if "position" in one else {})
             for one in scene["hinge"]]  # fmt: skip
    return scene | {"gravity": vector(scene["gravity"]), "body": body, "hinge": hinge, "load": []}


@pytest.mark.parametrize("axis", [[0, 1, 0], [-1, 0, 0], [0, 0, -1], [0.3, 0.8, -0.5]])
def test_the_plane_may_lie_anywhere(axis: list[float]) -> None:
    upright, z = windows(2, "ground"), [0.0, 0.0, 1.0]
    lying = rotate_scene(upright, np.eye(3))
    rotation = Rotation.align_vectors([axis], [z])[0].as_matrix()
    models = [mstmm.compile(mstmm.Scene(**scene), engine="looped")
              for scene in (lying, rotate_scene(upright, rotation))]  # fmt: skip
    assert all(model.packed_scene.model.flat for model in models)
    found, expected = (model.accelerations(*model.initial_state()) for model in models)
    assert found == pytest.approx(expected, rel=1e-10, abs=1e-10)


def test_what_acts_in_inertial_axes_keeps_others_in_space() -> None:
    """A plane has axes of its own, in which nobody tells such a load."""
    aside = Rotation.from_euler("x", 90, degrees=True).as_matrix()
    lying = rotate_scene(windows(2, "ground"), aside)
    load = {"on": "coupler0.coupler", "force": [1.0, 2.0, 3.0]}
    for more, in_a_plane in (({}, True), ({"load": [load]}, False)):
        model = mstmm.compile(mstmm.Scene(**(lying | more)), engine="looped")
        assert bool(model.packed_scene.model.flat) == in_a_plane


def test_a_ring_in_space_is_swept_there() -> None:
    """Its axes are those of a cube."""
    model = mstmm.compile(mstmm.Scene(**bricard()), engine="looped")
    assert not model.packed_scene.model.flat
