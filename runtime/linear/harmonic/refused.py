"""Damping that does not go with a state, or with exact beams."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from mstmm.errors import SceneError

from .losses import Losses
from .prescribed import Ratios

if TYPE_CHECKING:
    from ..channels import Channel
    from ..equations import Equations


def given(damping: Losses | Ratios) -> bool:
    """Whether there is any."""
    return not (isinstance(damping, int | float) and damping == 0)


def refuse_in_motion(linear: Equations, structural: Losses, modal: Ratios) -> None:
    """SceneError for damping of a state that moves."""
    if linear.state.u.any() and (given(structural) or given(modal)):
        raise SceneError(
            "frequency response: structural and modal damping are those of a scene at rest, and "
            "this state moves; leave them out, or damp laws and shapes"
        )


def refuse_ratios(modal: Ratios) -> None:
    """SceneError for modal ratios beside exact beams."""
    if given(modal):
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
