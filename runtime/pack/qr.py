"""The sweep as least squares as a way to the accelerations of a tree of rigid bodies."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mstmm.errors import SceneError

if TYPE_CHECKING:
    from .packed import Packed


def attach(packed: Packed) -> None:
    """Let the packed scene use it.  SceneError for flexible bodies, whose modes it has no rows
    for."""
    if packed.flexible:
        name = next(iter(packed.flexible))
        raise SceneError(
            f'"{name}" is flexible; sweep = "qr" is for rigid bodies only; use sweep = "riccati", '
            'or flexibility = "rigid"'
        )
    packed.qr, packed.model.qr = True, 1


def refuse_steps(packed: Packed) -> None:
    """SceneError for steps that are not made from accelerations: the tangent of an implicit method
    and the classical matrices lose the digits again that this sweep keeps."""
    if packed.qr:
        raise SceneError(
            'sweep = "qr" makes accelerations, which implicit and classical methods do not ask '
            'for; use an explicit one (dop853, dopri5, rk4), or sweep = "riccati"'
        )
