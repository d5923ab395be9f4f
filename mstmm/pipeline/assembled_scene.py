"""Scene whose initial state is the assembled one, with closed loops."""

from __future__ import annotations

import tomllib
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import LoopClosureError, SceneError
from mstmm.scene import Scene
from mstmm.scene.checks.topology import build_topology
from mstmm.scene.tables.closures import CURVE

from .compilation import compile_scene

if TYPE_CHECKING:
    from mstmm.runtime.model.model import Model
    from mstmm.runtime.result.result import Result


#: Largest deviation of members of a chain from their common start (rad, m; rad/s, m/s).
_MAX_START_DIFFERENCE = 1e-9


def assembled_scene(model: Model) -> Scene:
    """Scene of a model with its assembled initial state in place of the given start values.

    Raises SceneError for members of a chain whose assembled start differs from that of the chain.
    """
    q, u = model.initial_state()
    data = tomllib.loads(model.scene.to_toml())
    for hinge in data.get("hinge", ()):
        slots = model.coordinate_layout.hinges[hinge["name"]]
        is_prescribed = "drive" in hinge and "free" not in np.atleast_1d(hinge["drive"]).tolist()
        if slots.nu and not is_prescribed:
            hinge["initial"] = _initial_table(q[slots.q_slice], u[slots.u_slice], "q", "u")
    for body in (*data.get("beam", ()), *data.get("elastic", ())):
        slots = model.coordinate_layout.modal[body["name"]]
        if slots.nu:
            body["initial"] = _initial_table(q[slots.q_slice], u[slots.u_slice], "eta", "etad")
    for constraint in data.get("constraint", ()):
        if constraint["type"] == CURVE:
            constraint["start"] = float(
                q[model.coordinate_layout.curve_slots(constraint["name"]).q]
            )
    _require_common_starts(model, q, u)
    return Scene.from_data(data)


def _initial_table(q: Array, u: Array, place: str, rate: str) -> dict[str, Any]:
    return {place: q.tolist(), rate: u.tolist()}


def _require_common_starts(model: Model, q: Array, u: Array) -> None:
    hinges = model.scene.hinges
    for number in range(len(hinges.tables), len(hinges)):
        hinge, slots = hinges[number], model.coordinate_layout.hinges[hinges.name(number)]
        initial = hinge.initial
        if initial is None:
            continue
        given = [*(initial.q or ()), *(initial.u or ())]
        assembled_values = [*q[slots.q_slice], *u[slots.u_slice]]
        if np.abs(np.subtract(given, assembled_values)).max(initial=0.0) > _MAX_START_DIFFERENCE:
            raise SceneError(
                f'scene: chain "{hinge.name.partition("[")[0]}": "{hinge.name}" starts at '
                f"{assembled_values[0]:.9g} once its loop is closed, but members of a chain share "
                "their start; write them as [[body]] and [[hinge]]"
            )


# --- loops that cannot be closed ------------------------------------------------------------------

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
