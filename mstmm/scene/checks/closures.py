"""Constraint rows of loop closures: cut hinges, constraints, couplings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from ...expression.expression import Name
from ...graph.mechanism import GROUND, Rows
from ..rules.values import split

if TYPE_CHECKING:
    from ..tables.all import SceneTables
    from ..tables.hinge import HingeTable


def rows_of(hinge: HingeTable) -> int:
    """Number of constraint rows of a hinge if it is cut.

    These are 6 less its coordinates, plus one for each coordinate that is driven or carries rotor
    inertia.  A user-defined type counts as a pin until its definition is loaded.
    """
    speeds = 1 if hinge.facts is None else len(hinge.facts.speeds)
    drive, inertia = hinge.drive or (), hinge.law.inertia
    own = sum(any(drive[k : k + 1]) or any(inertia[k : k + 1]) for k in range(speeds))
    return 6 - speeds + own


def rows_of_closures(scene: SceneTables) -> Iterator[Rows]:
    """Row groups of the constraints of a scene, then those of its couplings."""
    for constraint in scene.constraint:
        yield _rows(scene, (constraint.from_, constraint.to), constraint.rows)
    for coupling in scene.coupling:
        joined = (
            scene.hinges.by_name[name] for name in dict.fromkeys(n.hinge for n in coupling.names)
        )
        yield _rows(scene, [end for hinge in joined for end in (hinge.inboard, hinge.outboard)], 1)


def coordinate(scene: SceneTables, name: Name) -> tuple[int, str, int]:
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
    own = [one.name for one in facts.coordinates] if facts is not None else []
    return hinge, "q", own.index(name.quantity)


def _rows(scene: SceneTables, ends: Sequence[str], count: int) -> Rows:
    """Row group between ends of bodies or the ground."""
    bodies = (scene.bodies.find(split(end)[0]) for end in ends)
    return Rows(tuple(GROUND if body is None else body for body in bodies), count)
