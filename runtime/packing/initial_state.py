"""Initial state of a scene, as given by its hinges."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.ir.hinge_properties import default_coordinates
from mstmm.scene import Hinge, Scene

from .coordinate_layout import HingeSlots, Layout

if TYPE_CHECKING:
    from ..flexible.modal_body import ModalBody


def start_values(
    scene: Scene, layout: Layout, flexible: Mapping[str, ModalBody] | None = None
) -> tuple[Array, Array]:
    """Initial (q, u) of the scene; driven coordinates have the values of `initial`."""
    q, u = np.zeros(layout.nq), np.zeros(layout.nu)
    for group in layout.groups:
        for k, slots in enumerate(group.hinges):
            hinge_q, hinge_u = _hinge_values(scene.hinges[group.first + k], slots)
            if group.count == 1:
                q[slots.q_slice], u[slots.u_slice] = hinge_q, hinge_u
                continue
            for target, first, values in (
                (q, group.q_starts(), hinge_q), (u, group.u_starts(), hinge_u)
            ):  # fmt: skip
                if len(values):
                    repeats = first[k :: len(group.hinges)]
                    target[repeats[:, None] + np.arange(len(values))] = values
    for name, body in (flexible or {}).items():
        slots = layout.modal[name]
        if len(body.eta):
            q[slots.q_slice] = body.eta
        if len(body.etad):
            u[slots.u_slice] = body.etad
    return q, u


def _hinge_values(hinge: Hinge, slots: HingeSlots) -> tuple[Array, Array]:
    """Initial (q, u) of one hinge."""
    q, u = np.zeros(slots.nq), np.zeros(slots.nu)
    q[:] = default_coordinates(slots.nq, slots.quaternion)
    if hinge.initial is not None and hinge.initial.q:
        q[:] = hinge.initial.q
    if hinge.initial is not None and hinge.initial.u:
        u[:] = hinge.initial.u
    return q, u
