"""Scene whose initial state is the assembled one, with closed loops."""

from __future__ import annotations

import tomllib
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import SceneError
from mstmm.scene import Scene
from mstmm.scene.tables.closures import CURVE

if TYPE_CHECKING:
    from mstmm.runtime.model.model import Model

#: Largest deviation of members of a chain from their common start (rad, m; rad/s, m/s).
_SAME = 1e-9


def assembled(model: Model) -> Scene:
    """Scene of a model with its assembled initial state in place of the given start values.

    Raises SceneError for members of a chain whose assembled start differs from that of the chain.
    """
    q, u = model.initial_state()
    data = tomllib.loads(model.scene.to_toml())
    for hinge in data.get("hinge", ()):
        slots = model.layout.hinges[hinge["name"]]
        driven = "drive" in hinge and "free" not in np.atleast_1d(hinge["drive"]).tolist()
        if slots.nu and not driven:
            hinge["initial"] = _start(q[slots.q_slice], u[slots.u_slice], "q", "u")
    for body in (*data.get("beam", ()), *data.get("elastic", ())):
        slots = model.layout.modal[body["name"]]
        if slots.nu:
            body["initial"] = _start(q[slots.q_slice], u[slots.u_slice], "eta", "etad")
    for constraint in data.get("constraint", ()):
        if constraint["type"] == CURVE:
            constraint["start"] = float(q[model.layout.along(constraint["name"]).q])
    _refuse_chains(model, q, u)
    return Scene.from_data(data)


def _start(q: Array, u: Array, place: str, rate: str) -> dict[str, Any]:
    return {place: q.tolist(), rate: u.tolist()}


def _refuse_chains(model: Model, q: Array, u: Array) -> None:
    hinges = model.scene.hinges
    for number in range(len(hinges.tables), len(hinges)):
        hinge, slots = hinges[number], model.layout.hinges[hinges.name(number)]
        initial = hinge.initial
        if initial is None:
            continue
        wishes = [*(initial.q or ()), *(initial.u or ())]
        found = [*q[slots.q_slice], *u[slots.u_slice]]
        if np.abs(np.subtract(wishes, found)).max(initial=0.0) > _SAME:
            raise SceneError(
                f'scene: chain "{hinge.name.partition("[")[0]}": "{hinge.name}" starts at '
                f"{found[0]:.9g} once its loop is closed, but members of a chain share their "
                "start; write them as [[body]] and [[hinge]]"
            )
