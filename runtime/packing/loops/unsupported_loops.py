"""Rejection of methods that do not support closed loops."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mstmm.errors import SceneError
from mstmm.scene.checks.topology import build_topology
from mstmm.scene.tables.closures import ROLLING

from ...integrate.steppers import INDEX3_SUFFIX
from .loop_detection import loop_label

if TYPE_CHECKING:
    from ..packed_scene import PackedScene


def reject_loops(packed: PackedScene, what: str, instead: str) -> None:
    """Raise SceneError if there are closed loops: `what` does not support them; use `instead`."""
    if not packed.system.has_loops:
        return
    scene = packed.user_scene.skeleton
    plan = build_topology(scene).plan
    assert plan is not None
    raise SceneError(
        f"scene: {what} does not support closed loops, found {loop_label(scene, plan)}; {instead}"
    )


def reject_speed_constraints(packed: PackedScene, method: str) -> None:
    """Raise SceneError if there are constraints on speeds, for a method on positions."""
    scene = packed.user_scene
    names = [f'coupling "{c.name}"' for c in scene.coupling if c.speeds is not None]
    names += [f'constraint "{c.name}"' for c in scene.constraint if c.type == ROLLING]
    if names:
        raise SceneError(
            f'scene: method "{method}" needs constraints on positions, found {names[0]} on speeds; '
            f"use {method.removesuffix(INDEX3_SUFFIX)}"
        )


def reject_constraints(packed: PackedScene, what: str, instead: str) -> None:
    """Raise SceneError if there are constraints or couplings, which `what` does not support."""
    scene = packed.user_scene
    names = [f'coupling "{coupling.name}"' for coupling in scene.coupling]
    names += [f'constraint "{constraint.name}"' for constraint in scene.constraint]
    if names:
        raise SceneError(
            f"scene: {what} does not support constraints and couplings, found {names[0]}; {instead}"
        )


#: Methods without a formulation for closed loops: increments of loads, exponential integrators.
_METHODS_OF_TREES = ("dttmm", "exprb32")


def reject_loop_method(packed: PackedScene, method: str, tangent: str) -> None:
    """Raise SceneError for closed loops that the method or the tangent does not support."""
    if method in _METHODS_OF_TREES:
        reject_loops(packed, f'method "{method}"', "genalpha and rodas4p2 do")
    if tangent == "laws":
        reject_loops(packed, 'tangent = "laws"', 'use tangent = "exact"')
