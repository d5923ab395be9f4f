"""What cannot be asked yet of scenes whose loops are closed, one message for all of it."""

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
    """SceneError where loops are closed, which `what` cannot follow; `instead` does."""
    if not packed.system.closes:
        return
    scene = packed.described.skeleton
    plan = build_topology(scene).plan
    assert plan is not None
    raise SceneError(
        f"scene: {loop_label(scene, plan)} is closed, and {what} cannot follow that yet; {instead}"
    )


def reject_speed_constraints(packed: PackedScene, method: str) -> None:
    """SceneError for rows of speeds, which a method on positions does not meet."""
    scene = packed.described
    names = [f'coupling "{one.name}"' for one in scene.coupling if one.speeds is not None]
    names += [f'constraint "{one.name}"' for one in scene.constraint if one.type == ROLLING]
    if names:
        raise SceneError(
            f'scene: {names[0]} asks for speeds, which method "{method}" on positions does not; '
            f"take {method.removesuffix(INDEX3_SUFFIX)}"
        )


def reject_constraints(packed: PackedScene, what: str, instead: str) -> None:
    """SceneError where more than hinges closes loops, which `what` cannot follow yet; `instead`
    does."""
    scene = packed.described
    names = [f'coupling "{one.name}"' for one in scene.coupling]
    names += [f'constraint "{one.name}"' for one in scene.constraint]
    if names:
        raise SceneError(
            f"scene: {names[0]} closes a loop, and {what} cannot follow that yet; {instead}"
        )


#: Methods that take increments of loads or an exponential of the whole motion, which closed loops
#: are not brought into.
_ALIEN = ("dttmm", "exprb32")


def reject_loop_method(packed: PackedScene, method: str, tangent: str) -> None:
    """SceneError where loops are closed, for an implicit method that cannot follow them, and for
    the tangent of laws alone."""
    if method in _ALIEN:
        reject_loops(packed, f'method "{method}"', "genalpha and rodas4p2 do")
    if tangent == "laws":
        reject_loops(packed, 'tangent = "laws"', 'take tangent = "exact"')
