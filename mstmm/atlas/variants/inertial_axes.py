"""Riccati sweep over a chain of pins with all vectors and matrices in inertial axes."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...arrays import Array
from ...errors import NumericalFailure
from ...runtime.kernels import prebuilt

#: Lengths of a bias motion, of S, and of e, gains and deviations.
_MOTION, _S, _VECTOR = 9, 21, 6

#: Rotation of a hinge between parallel axes, and zero shift and drift.
_ALIKE, _NONE = np.eye(3).ravel(), np.zeros(6)


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
    sweep, rigid = _Kernels("sweep", "generic1"), _Kernels("body", "rigid")
    n, none, subspace = len(rates), _NONE[:3], np.concatenate([_NONE[:3], pin])
    steps = np.diff(points, axis=0, prepend=np.zeros((1, 3)))
    motion, udot = np.zeros((n + 1, _MOTION)), np.zeros((n, 1))
    S, e, deviation = (np.zeros((n + 1, size)) for size in (_S, _VECTOR, _VECTOR))
    gains, terms, spare = np.zeros((n, _VECTOR)), np.zeros((n, 1)), np.zeros(9)
    motion[-1, 6:] = -gravity  # index -1 is the ground, inboard of the first body
    for i in range(n):
        sweep("forward", (_ALIKE, steps[i], _ALIKE, none, subspace, none, rates[i] * pin, _NONE,
                          _NONE[:1], motion[i - 1]), (spare, spare[:3], motion[i]))  # fmt: skip
        numbers = _turned(body, axes[i])
        rigid("inertia", (numbers,), (S[i],))
        rigid("bias_load", (numbers, motion[i]), (e[i],))
    for i in reversed(range(n)):
        sweep("condense", (_ALIKE, steps[i], subspace, _NONE[:1], _NONE[:2], S[i], e[i],
                           _NONE[:1]), (gains[i], terms[i], S[i - 1], e[i - 1]))  # fmt: skip
    for i in range(n):
        sweep("recover", (_ALIKE, steps[i], subspace, gains[i], terms[i], deviation[i - 1]),
              (udot[i], deviation[i]))  # fmt: skip
    return udot[:, 0]


def _turned(body: Array, axes: Array) -> Array:
    """Inertia numbers of a body (10,) in inertial axes."""
    upper, tensor = np.triu_indices(3), np.zeros((3, 3))
    tensor[upper] = body[4:]
    tensor += np.triu(tensor, 1).T
    return np.concatenate([body[:1], axes @ body[1:4], (axes @ tensor @ axes.T)[upper]])


class _Kernels:
    """Compiled kernels of an element, called with arrays."""

    def __init__(self, kind: str, name: str) -> None:
        self._ffi, _ = prebuilt.module()
        found = prebuilt.element(kind, name)
        records = (found.descriptor.kernels[i] for i in range(found.descriptor.n_kernels))
        self._calls = {prebuilt.text(self._ffi, record.name): record.call for record in records}

    def __call__(self, kernel: str, given: tuple[Array, ...], taken: tuple[Array, ...]) -> None:
        """Call a kernel.  Raises NumericalFailure if a guard is violated."""
        code = self._calls[kernel](0, self._pointers(given), self._pointers(taken))
        if code:
            raise NumericalFailure(f"{kernel} in inertial axes: guard {code}")

    def _pointers(self, arrays: tuple[Array, ...]) -> Any:
        return [self._ffi.from_buffer("double[]", np.ascontiguousarray(array)) for array in arrays]
