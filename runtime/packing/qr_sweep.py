"""The sweep as least squares as a way to the accelerations of a tree of rigid bodies."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError

from ..integrate.steppers import EXPLICIT_METHODS
from .loops.unsupported_loops import reject_loops

if TYPE_CHECKING:
    from .packed_scene import PackedScene
    from .system import BodyNumbers

#: Least eigenvalue of a mass matrix with ones on its diagonal that is not rounding.
_NEGATIVE = -1e-11

_UPPER = np.triu_indices(6)


def enable_qr_sweep(packed: PackedScene) -> None:
    """Let the packed scene use it.

    Raises SceneError for flexible bodies, whose modes it has no rows for, and for bodies with
    negative moments of inertia, which no rows have.
    """
    way_out = 'use sweep = "riccati"'
    reject_loops(packed, 'sweep = "qr"', way_out)
    if packed.flexible:
        name = next(iter(packed.flexible))
        raise SceneError(
            f'"{name}" is flexible; sweep = "qr" is for rigid bodies only; {way_out}, '
            'or flexibility = "rigid"'
        )
    for number, body in enumerate(packed.system.distinct):
        if _least(_mass_matrix(packed, body)) < _NEGATIVE:
            place = int(np.argmax(packed.system.which == number))
            name = packed.scene.bodies.name(packed.topology.at(place)[0])
            raise SceneError(
                f'body "{name}": its mass matrix is no sum of squares, as sweep = "qr" needs it (a '
                "negative moment of inertia about some axis, or a mass centre too far away for its "
                f"digits); mend the body, or {way_out}"
            )
    packed.qr, packed.model.qr = True, 1


def _mass_matrix(packed: PackedScene, body: BodyNumbers) -> Array:
    """(6, 6) of a body alone, about its input end."""
    ffi, upper = packed.ffi, np.zeros(21)
    call = ffi.cast(
        "int (*)(const double *, double *)", packed.elements[body.body].functions["inertia"]
    )
    call(list(body.body_p), ffi.from_buffer("double[]", upper))
    matrix = np.zeros((6, 6))
    matrix[_UPPER] = upper
    return np.asarray(matrix + np.triu(matrix, 1).T)


def _least(matrix: Array) -> float:
    """Least eigenvalue with rows and columns in units of their own."""
    diagonal = np.diagonal(matrix)
    if diagonal.min() < 0:
        return float(diagonal.min())
    root = np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    return float(np.linalg.eigvalsh(matrix / np.outer(root, root))[0])


def reject_qr_steps(packed: PackedScene) -> None:
    """SceneError for steps that are not made from accelerations: the tangent of an implicit method
    and the classical matrices lose the digits again that this sweep keeps."""
    if packed.qr:
        raise SceneError(
            'sweep = "qr" makes accelerations, which implicit and classical methods do not ask '
            f'for; use {EXPLICIT_METHODS}, or sweep = "riccati"'
        )
