"""Whether a scene may have closed loops, and what a message calls one."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mstmm.graph.closure_plan import ClosurePlan
from mstmm.scene import Scene

if TYPE_CHECKING:
    from mstmm.scene.tables.scene_tables import SceneTables

#: So many hinges of a loop are named.
_NAMED = 8


def may_have_loops(scene: Scene) -> bool:
    """Whether anything but a tree can be meant: more hinges than bodies, or rows between bodies."""
    skeleton = scene.skeleton
    more = len(skeleton.hinge) != len(skeleton.body)
    return more or bool(scene.constraint or scene.coupling)


def loop_label(scene: SceneTables, plan: ClosurePlan) -> str:
    """The first loop by its hinges, or by what closes one without hinges."""
    if not plan.cut:
        for constraint in scene.constraint[:1]:
            return f'loop of constraint "{constraint.name}"'
        return f'loop of coupling "{scene.coupling[0].name}"'
    around = plan.loop(plan.cut[0])
    names = " - ".join(scene.hinges.name(hinge) for hinge in around[:_NAMED])
    return f'loop "{names}{" ..." if len(around) > _NAMED else ""}"'
