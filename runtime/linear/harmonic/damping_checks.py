"""Checks for damping incompatible with an operating point or with exact beams."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from mstmm.errors import SceneError

from .hysteretic_damping import Losses
from .modal_damping import Ratios

if TYPE_CHECKING:
    from ..input_channels import Channel
    from ..linear_equations import LinearEquations


def is_requested(damping: Losses | Ratios) -> bool:
    """Whether any damping is requested."""
    return not (isinstance(damping, int | float) and damping == 0)


def check_state_at_rest(linear: LinearEquations, structural: Losses, modal: Ratios) -> None:
    """Raise SceneError for structural or modal damping about a moving state."""
    if linear.state.u.any() and (is_requested(structural) or is_requested(modal)):
        raise SceneError(
            "frequency response: structural and modal damping require a state at rest, found a "
            "moving one; leave them out, or define damping in laws and flexible bodies"
        )


def reject_modal_damping(modal: Ratios) -> None:
    """Raise SceneError for modal damping ratios together with exact beams."""
    if is_requested(modal):
        raise SceneError(
            "modal: damping ratios refer to normal modes with shape functions, which exact beams "
            "do not have; give structural, or leave exact out"
        )


def reject_drives(pushes: Sequence[Channel], changed: bool) -> None:
    """Raise SceneError for drive motions if stiffness or inertia is `changed` from M, C, K."""
    moved = next((channel.name for channel in pushes if channel.drive_factors), "")
    if changed and moved:
        raise SceneError(
            f'"{moved}": motions of drives cannot be combined with structural damping or exact '
            "beams; leave these out, or use an acceleration of the ground"
        )
