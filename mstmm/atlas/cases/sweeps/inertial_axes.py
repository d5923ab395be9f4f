"""Riccati sweep of an oblique chain in inertial axes, for longer and longer chains."""

from __future__ import annotations

from functools import partial

import numpy as np

from ....array_validation import Array
from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import refinement_correction
from ...parameter_scale import COUNT_SCALE
from ...shared_scenes import (
    ROD_AXIAL_INERTIA,
    ROD_TRANSVERSE_INERTIA,
    compile_looped,
    random_pin_states,
)
from ...variants import inertial_axes

#: Directions of the rods at rest and of the pins.
ROD_AXIS, PIN_AXIS = (
    np.array([5.0, -4.0, 1.0]) / np.sqrt(42.0),
    np.array([1.0, 2.0, 3.0]) / np.sqrt(14.0),
)
#: Columns: along the rods, normal to them in their plane, along the pins.
PLANE = np.stack([ROD_AXIS, np.cross(PIN_AXIS, ROD_AXIS), PIN_AXIS], axis=1)
WEIGHT = -9.81 * PLANE[:, 1]

#: Moments of inertia about the mass centre; mass, first moments and moments about the pin.
MOMENTS = np.diag([ROD_AXIAL_INERTIA, ROD_TRANSVERSE_INERTIA, ROD_TRANSVERSE_INERTIA])
BODY_NUMBERS = np.array(
    [
        1.0,
        0.5,
        0.0,
        0.0,
        ROD_AXIAL_INERTIA,
        0.0,
        0.0,
        ROD_TRANSVERSE_INERTIA + 0.25,
        0.0,
        ROD_TRANSVERSE_INERTIA + 0.25,
    ]
)


def _scene(rods: int) -> dict[str, object]:
    """Scene of rods along ROD_AXIS, given in inertial axes."""
    tensor = PLANE @ MOMENTS @ PLANE.T
    body = {
        "mass": 1.0, "center_of_mass": (ROD_AXIS / 2).tolist(),
        "inertia": [*np.diag(tensor).tolist(), *tensor[np.triu_indices(3, 1)].tolist()],
        "ends": {"tip": ROD_AXIS.tolist()},
    }  # fmt: skip
    hinge = {"type": "pin", "axis": PIN_AXIS.tolist()}
    chain = {"name": "c", "count": rods, "inboard": "ground", "body": body, "hinge": hinge}
    return {"gravity": WEIGHT.tolist(), "chain": [chain]}


def _inertial_accelerations(q: Array, u: Array) -> Array:
    angle = np.cumsum(q)
    axes = np.zeros((len(q), 3, 3))
    axes[:, 0, 0] = axes[:, 1, 1] = np.cos(angle)
    axes[:, 1, 0], axes[:, 2, 2] = np.sin(angle), 1.0
    axes[:, 0, 1] = -axes[:, 1, 0]
    axes = PLANE @ axes
    points = np.cumsum(axes[:, :, 0], axis=0) - axes[:, :, 0]
    return inertial_axes.accelerations(axes, points, PIN_AXIS, BODY_NUMBERS, u, WEIGHT)


def _error(rods: float, inertial: bool) -> float:
    count = int(rods)
    accelerations = _inertial_accelerations if inertial else None
    return refinement_correction(
        compile_looped(_scene(count)), random_pin_states(count), accelerations
    )


CASE = CaseDefinition(
    name="inertial-axes",
    title="Sweep in inertial axes: length of an oblique chain",
    cause="The inertia of a planar chain against motions out of its plane grows with the cube of "
    "its length. In axes oblique to that plane every entry of the inertia mixes that large part "
    "with the small one that moves. Rounding of the large part then disturbs the small one. In "
    "axes along the hinges, which the engines choose whatever the axes of a scene, the two are "
    "separate.",
    parameter="rods on parallel pins", unit="", low=2, high=3000, scale=COUNT_SCALE,
    measured="error of the accelerations, relative", limit=1e-10,
    method=MethodDefinition("Riccati sweep, inertial axes", partial(_error, inertial=True)),
    remedy=MethodDefinition("Riccati sweep, axes of the hinges", partial(_error, inertial=False)),
    reach=100_000,
    source="Higham, Accuracy and Stability of Numerical Algorithms, 2002, ch. 3; sweep: Rui et "
    "al., Multibody System Dynamics 49, 2020",
)  # fmt: skip
