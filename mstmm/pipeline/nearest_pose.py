"""Nearest pose of a loop that cannot be closed, for display."""

from __future__ import annotations

import tomllib
from typing import TYPE_CHECKING

import numpy as np

from mstmm.errors import LoopClosureError
from mstmm.scene import Scene
from mstmm.scene.checks.topology import build_topology

from .compilation import compile_scene

if TYPE_CHECKING:
    from mstmm.runtime.result.result import Result

#: Tables of a scene, and keys of its hinges, that have no effect on the picture of bodies at rest.
_LOAD_TABLES = ("coupling", "constraint", "event", "load", "spring", "bushing")
_MOTION_KEYS = ("law", "drive", "initial", "hold", "cut", "release")


def nearest_pose_result(scene: Scene, error: LoopClosureError) -> Result:
    """Result with the bodies of a scene at rest in the pose of `error`, without cut hinges."""
    model = compile_scene(_tree_scene(scene), engine="looped")
    q, _ = model.initial_state()
    q = np.array(q)
    for name, slots in {**model.coordinate_layout.hinges, **model.coordinate_layout.modal}.items():
        if name in error.pose:
            q[slots.q_slice] = error.pose[name]
    return model.simulate(0.0, initial=(q, np.zeros(model.nu)))


def _tree_scene(scene: Scene) -> Scene:
    """Scene with the bodies and the hinges of its spanning tree only."""
    hinges = scene.skeleton.hinges
    cut_hinges = {hinges.name(number) for number in build_topology(scene.skeleton).cut_hinges}
    data = {k: v for k, v in tomllib.loads(scene.to_toml()).items() if k not in _LOAD_TABLES}
    data["hinge"] = [
        {key: value for key, value in hinge.items() if key not in _MOTION_KEYS}
        for hinge in data.get("hinge", ())
        if hinge["name"] not in cut_hinges
    ]
    for body in (*data.get("beam", ()), *data.get("elastic", ())):
        body.pop("initial", None)
    return Scene.from_data(data)
