"""Accelerations of a tree of rigid bodies by the QR sweep (least squares)."""

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

#: Eigenvalue of a mass matrix with unit diagonal below which it counts as negative.
_NEGATIVE = -1e-11

_UPPER = np.triu_indices(6)


def enable_qr_sweep(packed: PackedScene) -> None:
    """Use the QR sweep.

    Raises SceneError for closed loops, flexible bodies, and mass matrices that are indefinite.
    """
    remedy = 'use sweep = "riccati"'
    reject_loops(packed, 'sweep = "qr"', remedy)
    if packed.flexible:
        name = next(iter(packed.flexible))
        raise SceneError(
            f'"{name}": sweep = "qr" needs rigid bodies, found a flexible one; {remedy}, '
            'or flexibility = "rigid"'
        )
    for number, body in enumerate(packed.system.distinct):
        if _min_eigenvalue(_mass_matrix(packed, body)) < _NEGATIVE:
            place = int(np.argmax(packed.system.distinct_indices == number))
            name = packed.scene.bodies.name(packed.topology.scene_indices(place)[0])
            raise SceneError(
                f'body "{name}": sweep = "qr" needs a positive semidefinite mass matrix, found a '
                "negative eigenvalue (a negative moment of inertia about some axis, or a mass "
                f"centre too far away for its digits); correct the body, or {remedy}"
            )
    packed.qr, packed.model.qr = True, 1


def _mass_matrix(packed: PackedScene, body: BodyNumbers) -> Array:
    """Mass matrix (6, 6) of a body about its input end."""
    ffi, upper = packed.ffi, np.zeros(21)
    call = ffi.cast(
        "int (*)(const double *, double *)", packed.elements[body.body].functions["inertia"]
    )
    call(list(body.body_p), ffi.from_buffer("double[]", upper))
    matrix = np.zeros((6, 6))
    matrix[_UPPER] = upper
    return np.asarray(matrix + np.triu(matrix, 1).T)


def _min_eigenvalue(matrix: Array) -> float:
    """Smallest eigenvalue of a matrix scaled to unit diagonal."""
    diagonal = np.diagonal(matrix)
    if diagonal.min() < 0:
        return float(diagonal.min())
    root = np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    return float(np.linalg.eigvalsh(matrix / np.outer(root, root))[0])


def reject_qr_steps(packed: PackedScene) -> None:
    """Raise SceneError for the QR sweep with steps that are not computed from accelerations.

    Tangents of implicit methods and classical matrices would lose the digits that this sweep keeps.
    """
    if packed.qr:
        raise SceneError(
            'sweep = "qr" gives accelerations only, which implicit and classical methods do not '
            f'use; use {EXPLICIT_METHODS}, or sweep = "riccati"'
        )
