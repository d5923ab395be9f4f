"""Ball hinge with a thinner and thinner rod."""

from __future__ import annotations

from typing import Any

import numpy as np

from ....array_validation import Array
from ....errors import NumericalFailure, SceneError
from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import rounding_error
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import ROD_TRANSVERSE_INERTIA, compile_looped

#: Direction of the rod in the axes of its body, and two directions normal to it.
ROD_AXIS = np.array([1.0, 2.0, 3.0]) / np.sqrt(14.0)
FIRST_NORMAL = np.array([3.0, 0.0, -1.0]) / np.sqrt(10.0)
SECOND_NORMAL = np.cross(ROD_AXIS, FIRST_NORMAL)

#: Hinges, and a state of each.
BALL = {"type": "ball"}
UNIVERSAL = {"type": "universal", "axis": FIRST_NORMAL.tolist(), "axis2": SECOND_NORMAL.tolist()}
BALL_STATE = np.array([0.5, 0.5, 0.5, 0.5]), np.array([0.7, -0.2, 0.4])
UNIVERSAL_STATE = np.array([0.3, -0.5]), np.array([0.7, -0.2])


def _error(ratio: float, foot: dict[str, Any], state: tuple[Array, Array]) -> float:
    """Relative error of the accelerations of a rod of 1 m and 1 kg on the hinge `foot`.

    `ratio` is its moment of inertia about its axis over that across.
    """
    tensor = ROD_TRANSVERSE_INERTIA * (np.eye(3) + (ratio - 1) * np.outer(ROD_AXIS, ROD_AXIS))
    rod = {
        "name": "rod", "mass": 1.0, "center_of_mass": (ROD_AXIS / 2).tolist(),
        "inertia": [*np.diag(tensor).tolist(), *tensor[np.triu_indices(3, 1)].tolist()],
    }  # fmt: skip
    hinge = {"name": "foot", "inboard": "ground", "outboard": "rod"} | foot
    scene = {"gravity": [0, -9.81, 0], "body": [rod], "hinge": [hinge]}
    try:
        rod_model = compile_looped(scene)
    except SceneError as failure:  # the inertia is the only possible reason in this scene
        raise NumericalFailure(str(failure)) from None
    return rounding_error(rod_model, [state])


CASE = CaseDefinition(
    name="thin-rod",
    title="Riccati sweep: a hinge that rotates a body without inertia",
    cause="The sweep divides by the inertia D of the free motions of a hinge. A ball lets a rod "
    "spin about its axis, where there is hardly any inertia. In axes oblique to the rod that "
    "inertia is the difference of large entries: the spin is rounding over rounding. Below 1e-14 "
    "of the mean a pivot of D counts as zero, and the run stops and names the hinge. A motion "
    "without inertia should not be free: a universal hinge constrains the spin.",
    parameter="moment of inertia along a rod over that across", unit="",
    low=1e-18, high=0.1, scale=LOG_SCALE,
    measured="error of the accelerations, relative", limit=1e-6,
    method=MethodDefinition("ball", lambda ratio: _error(ratio, BALL, BALL_STATE)),
    remedy=MethodDefinition(
        "universal hinge, spin constrained", lambda ratio: _error(ratio, UNIVERSAL, UNIVERSAL_STATE)
    ),
    reach=1e-20,
    source="Featherstone, Rigid Body Dynamics Algorithms, 2008, ch. 7 and 10 (D, singular "
    "articulated inertia); Higham, Accuracy and Stability of Numerical Algorithms, 2002, ch. 10",
)  # fmt: skip
