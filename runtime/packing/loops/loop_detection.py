"""Detection of closed loops, and their name in messages."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mstmm.graph.closure_plan import ClosurePlan
from mstmm.scene import Scene

if TYPE_CHECKING:
    from mstmm.scene.tables.scene_tables import SceneTables

#: Largest number of hinges named in a message about a loop.
_MAX_NAMED = 8


def may_have_loops(scene: Scene) -> bool:
    """Whether a scene may have loops: hinges in excess of bodies, constraints or couplings."""
    skeleton = scene.skeleton
    excess = len(skeleton.hinge) != len(skeleton.body)
    return excess or bool(scene.constraint or scene.coupling)


def loop_label(scene: SceneTables, plan: ClosurePlan) -> str:
    """Name of the first loop: its hinges, or the constraint or coupling that closes it."""
    if not plan.cut:
        for constraint in scene.constraint[:1]:
            return f'loop of constraint "{constraint.name}"'
        return f'loop of coupling "{scene.coupling[0].name}"'
    hinges = plan.loop(plan.cut[0])
    names = " - ".join(scene.hinges.name(hinge) for hinge in hinges[:_MAX_NAMED])
    return f'loop "{names}{" ..." if len(hinges) > _MAX_NAMED else ""}"'
