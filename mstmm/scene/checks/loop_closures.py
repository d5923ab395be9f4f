"""Constraint rows of loop closures: cut hinges, constraints, couplings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from ...expression.expression import Name
from ...graph.mechanism_graph import GROUND, RowGroup
from ..validators.scalars_and_vectors import split_reference

if TYPE_CHECKING:
    from ..tables.hinge import HingeTable
    from ..tables.scene_tables import SceneTables


def row_count_if_cut(hinge: HingeTable) -> int:
    """Number of constraint rows of a hinge if it is cut.

    These are 6 less its coordinates, plus one for each coordinate that is driven or carries rotor
    inertia.  A user-defined type counts as a pin until its definition is loaded.
    """
    speeds = 1 if hinge.facts is None else len(hinge.facts.speeds)
    drive, inertia = hinge.drive or (), hinge.law.inertia
    driven_count = sum(any(drive[k : k + 1]) or any(inertia[k : k + 1]) for k in range(speeds))
    return 6 - speeds + driven_count


def closure_row_groups(scene: SceneTables) -> Iterator[RowGroup]:
    """Row groups of the constraints of a scene, then those of its couplings."""
    for constraint in scene.constraint:
        yield _row_group(scene, (constraint.from_, constraint.to), constraint.rows)
    for coupling in scene.coupling:
        coupled_hinges = (
            scene.hinges.by_name[name] for name in dict.fromkeys(n.hinge for n in coupling.names)
        )
        yield _row_group(
            scene, [end for hinge in coupled_hinges for end in (hinge.inboard, hinge.outboard)], 1
        )


def resolve_coordinate(scene: SceneTables, name: Name) -> tuple[int, str, int]:
    """Resolve a name in a coupling to (hinge number, "q" or "u", entry).

    The name is `arm.q`, `arm.q[1]`, `arm.u`, or a coordinate by its own name, `arm.angle`.  Raises
    KeyError where the scene has no such hinge, ValueError where the hinge has no such entry.
    """
    hinge = scene.hinges.find(name.hinge)
    if hinge is None:
        raise KeyError(name.hinge)
    if name.quantity in ("q", "u"):
        return hinge, name.quantity, name.index or 0
    facts = scene.hinges[hinge].facts
    coordinate_names = (
        [coordinate_info.name for coordinate_info in facts.coordinates] if facts is not None else []
    )
    return hinge, "q", coordinate_names.index(name.quantity)


def _row_group(scene: SceneTables, ends: Sequence[str], count: int) -> RowGroup:
    """Row group between ends of bodies or the ground."""
    bodies = (scene.bodies.find(split_reference(end)[0]) for end in ends)
    return RowGroup(tuple(GROUND if body is None else body for body in bodies), count)
