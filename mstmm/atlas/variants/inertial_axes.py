"""Riccati sweep over a chain of pins with all vectors and matrices in inertial axes."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...array_validation import Array
from ...errors import NumericalFailure
from ...runtime.kernels import prebuilt_kernels

#: Lengths of a bias motion, of S, and of e, gains and deviations.
_MOTION_LENGTH, _S_LENGTH, _VECTOR_LENGTH = 9, 21, 6

#: Rotation of a hinge between parallel axes, and zero shift and drift.
_IDENTITY, _ZEROS = np.eye(3).ravel(), np.zeros(6)


def accelerations(
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
