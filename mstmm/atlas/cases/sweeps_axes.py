"""Case of a sweep over a chain of pins with all vectors and matrices in inertial axes."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from ...array_validation import Array
from ...errors import NumericalFailure
from ...runtime.kernels import prebuilt_kernels
from ..case_definition import COUNT_SCALE, CaseDefinition, MethodDefinition
from ..error_measures import refinement_correction
from ..shared_scenes import (
    ROD_AXIAL_INERTIA,
    ROD_TRANSVERSE_INERTIA,
    compile_looped,
    random_pin_states,
)

# --- inertial axes --------------------------------------------------------------------------------
#
# Riccati sweep over a chain of pins with all vectors and matrices in inertial axes.

#: Lengths of a bias motion, of S, and of e, gains and deviations.
_MOTION_LENGTH, _S_LENGTH, _VECTOR_LENGTH = 9, 21, 6

#: Rotation of a hinge between parallel axes, and zero shift and drift.
_IDENTITY, _ZEROS = np.eye(3).ravel(), np.zeros(6)


def accelerations_in_inertial_axes(
    axes: Array, points: Array, pin: Array, body: Array, rates: Array, gravity: Array
) -> Array:
    """Accelerations (n,) of a chain of n bodies on parallel pins, without efforts.

    Args:
        axes: (n, 3, 3) axes of the bodies in inertial axes.
        points: (n, 3) positions of the pins, m.
        pin: (3,) axis of all pins.
        body: (10,) mass, first moments and moments of inertia about its pin of every body, in body
            axes, as inputs of the kernels of the rigid body.
        rates: (n,) speeds of the pins, rad/s.
        gravity: (3,), m/s^2.
    """
    sweep, rigid_body = _Kernels("sweep", "generic1"), _Kernels("body", "rigid")
    n, zero_vector, subspace = len(rates), _ZEROS[:3], np.concatenate([_ZEROS[:3], pin])
    steps = np.diff(points, axis=0, prepend=np.zeros((1, 3)))
    motion, udot = np.zeros((n + 1, _MOTION_LENGTH)), np.zeros((n, 1))
    S, e, deviation = (
        np.zeros((n + 1, size)) for size in (_S_LENGTH, _VECTOR_LENGTH, _VECTOR_LENGTH)
    )
    gains, terms, unused = np.zeros((n, _VECTOR_LENGTH)), np.zeros((n, 1)), np.zeros(9)
    motion[-1, 6:] = -gravity  # index -1 is the ground, inboard of the first body
    for i in range(n):
        sweep(
            "forward",
            (
                _IDENTITY,
                steps[i],
                _IDENTITY,
                zero_vector,
                subspace,
                zero_vector,
                rates[i] * pin,
                _ZEROS,
                _ZEROS[:1],
                motion[i - 1],
            ),
            (unused, unused[:3], motion[i]),
        )
        inertia_inputs = _rotated_inertia(body, axes[i])
        rigid_body("inertia", (inertia_inputs,), (S[i],))
        rigid_body("bias_load", (inertia_inputs, motion[i]), (e[i],))
    for i in reversed(range(n)):
        sweep("condense", (_IDENTITY, steps[i], subspace, _ZEROS[:1], _ZEROS[:2], S[i], e[i],
                           _ZEROS[:1]), (gains[i], terms[i], S[i - 1], e[i - 1]))  # fmt: skip
    for i in range(n):
        sweep("recover", (_IDENTITY, steps[i], subspace, gains[i], terms[i], deviation[i - 1]),
              (udot[i], deviation[i]))  # fmt: skip
    return udot[:, 0]


def _rotated_inertia(body: Array, axes: Array) -> Array:
    """Inertia numbers of a body (10,) in inertial axes."""
    upper, tensor = np.triu_indices(3), np.zeros((3, 3))
    tensor[upper] = body[4:]
    tensor += np.triu(tensor, 1).T
    return np.concatenate([body[:1], axes @ body[1:4], (axes @ tensor @ axes.T)[upper]])


class _Kernels:
    """Compiled kernels of an element, called with arrays."""

    def __init__(self, kind: str, name: str) -> None:
        self._ffi, _ = prebuilt_kernels.module()
        element = prebuilt_kernels.element(kind, name)
        records = (element.descriptor.kernels[i] for i in range(element.descriptor.n_kernels))
        self._calls = {
            prebuilt_kernels.text(self._ffi, record.name): record.call for record in records
        }

    def __call__(self, kernel: str, inputs: tuple[Array, ...], outputs: tuple[Array, ...]) -> None:
        """Call a kernel.  Raises NumericalFailure if a guard is violated."""
        code = self._calls[kernel](0, self._pointers(inputs), self._pointers(outputs))
        if code:
            raise NumericalFailure(f"kernel {kernel} in inertial axes: guard {code} violated")

    def _pointers(self, arrays: tuple[Array, ...]) -> Any:
        return [self._ffi.from_buffer("double[]", np.ascontiguousarray(array)) for array in arrays]


# --- inertial-axes --------------------------------------------------------------------------------

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
    return accelerations_in_inertial_axes(axes, points, PIN_AXIS, BODY_NUMBERS, u, WEIGHT)


def _error(rods: float, inertial: bool) -> float:
    count = int(rods)
    accelerations = _inertial_accelerations if inertial else None
    return refinement_correction(
        compile_looped(_scene(count)), random_pin_states(count), accelerations
    )


INERTIAL_AXES = CaseDefinition(
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


CASES = (INERTIAL_AXES,)
