"""One beam with given motions, for the tests of what is computed from them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

import mstmm
from mstmm.runtime.flexible.flexible_bodies import modal_bodies
from mstmm.runtime.flexible.modal_body import ModalBody
from mstmm.runtime.result.flexible.motion import Motion

Array = NDArray[np.float64]

LENGTH, MASS, EI_Y, EI_Z = 2.0, 1.2, 50.0, 80.0


def beam(hinge: str = "fixed", **given: Any) -> ModalBody:
    """One beam, clamped to the ground at its root if no other hinge is asked for."""
    table = {
        "name": "blade", "length": LENGTH, "mass_per_length": MASS,
        "bending_stiffness": [EI_Y, EI_Z], "modes": 2, "basis": "static+fixed-interface",
        "frame": "tangent", **given,
    }  # fmt: skip
    root = {"name": "root", "type": hinge, "inboard": "ground", "outboard": "blade"}
    return modal_bodies(mstmm.Scene(gravity=(0, 0, 0), beam=[table], hinge=[root]))["blade"]


def moving(body: ModalBody, **given: Any) -> Motion:
    """One sample of a body at rest at the origin, but for what is given."""
    zero, modes = np.zeros((1, 3)), np.zeros((1, body.n))
    rest = Motion(
        body, np.zeros(1), modes, modes, modes, zero, np.eye(3)[None], zero, zero, zero, zero
    )
    arrays: dict[str, Any] = {k: np.asarray(v, float)[None] for k, v in given.items()}
    return replace(rest, **arrays)


def under_tip_load(body: ModalBody, force: Array) -> Motion:
    """In equilibrium with a force on the tip."""
    return moving(body, eta=np.linalg.solve(body.K, body.ports["tip"].phi.T @ force))
