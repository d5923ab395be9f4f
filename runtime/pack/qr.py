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


def refuse_implicit(packed: Packed) -> None:
    """SceneError: implicit methods eliminate a tangent of their own, in which the digits that this
    sweep keeps would be lost again."""
    if packed.qr:
        raise SceneError(
            'sweep = "qr" goes with explicit methods (dop853, dopri5, rk4): the tangent of '
            'implicit ones has no such form; use one of those, or sweep = "riccati"'
        )
