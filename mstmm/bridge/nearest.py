"""Nearest pose of a loop that cannot be closed, for display."""

from __future__ import annotations

import tomllib
from typing import TYPE_CHECKING

import numpy as np

from mstmm.errors import OpenLoop
from mstmm.scene import Scene
from mstmm.scene.checks.topology import build

from .compilation import compile_scene

if TYPE_CHECKING:
    from mstmm.runtime.result.result import Result

#: Tables of a scene, and keys of its hinges, that have no effect on the picture of bodies at rest.
_ACTING = ("coupling", "constraint", "event", "load", "spring", "bushing")
_MOVING = ("law", "drive", "initial", "hold", "cut", "release")


def nearest(scene: Scene, error: OpenLoop) -> Result:
    """Result with the bodies of a scene at rest in the pose of `error`, without cut hinges."""
    model = compile_scene(_opened(scene), engine="looped")
    q, _ = model.initial_state()
    q = np.array(q)
    for name, slots in {**model.layout.hinges, **model.layout.modal}.items():
        if name in error.pose:
            q[slots.q_slice] = error.pose[name]
    return model.simulate(0.0, initial=(q, np.zeros(model.nu)))


def _opened(scene: Scene) -> Scene:
    """Scene with the bodies and the hinges of its spanning tree only."""
    hinges = scene.skeleton.hinges
    cut = {hinges.name(number) for number in build(scene.skeleton).cut}
    data = {k: v for k, v in tomllib.loads(scene.to_toml()).items() if k not in _ACTING}
    data["hinge"] = [
        {key: value for key, value in hinge.items() if key not in _MOVING}
        for hinge in data.get("hinge", ())
        if hinge["name"] not in cut
    ]
    for body in (*data.get("beam", ()), *data.get("elastic", ())):
        body.pop("initial", None)
    return Scene.from_data(data)
