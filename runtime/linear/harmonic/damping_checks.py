"""Damping that does not go with a state, or with exact beams."""

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
    """Whether there is any."""
    return not (isinstance(damping, int | float) and damping == 0)


def refuse_in_motion(linear: LinearEquations, structural: Losses, modal: Ratios) -> None:
    """SceneError for damping of a state that moves."""
    if linear.state.u.any() and (is_requested(structural) or is_requested(modal)):
        raise SceneError(
            "frequency response: structural and modal damping are those of a scene at rest, and "
            "this state moves; leave them out, or damp laws and shapes"
        )


def refuse_ratios(modal: Ratios) -> None:
    """SceneError for modal ratios beside exact beams."""
    if is_requested(modal):
        raise SceneError(
            "modal: ratios are those of natural motions by shapes, which exact beams do not have; "
            "give structural, or leave the shapes"
        )


def refuse_drives(pushes: Sequence[Channel], changed: bool) -> None:
    """SceneError for motions of drives where stiffness or inertia is not that of the matrices."""
    moved = next((one.name for one in pushes if one.moves), "")
    if changed and moved:
        raise SceneError(
            f'"{moved}": motions of drives do not go with structural damping and exact beams; '
            "leave these out, or push by an acceleration of the ground"
        )
