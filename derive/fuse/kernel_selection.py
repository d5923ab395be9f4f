"""What is known of nodes when code is made for one scene, and decides which kernel is cheapest."""

from __future__ import annotations

from mstmm.ir.inline import Nodes

#: Axes of which the sweep has screws; a turn about y is carried as any other.
_AXES = ("x", "", "z")


def screw_axis(rotation: Nodes, position: Nodes) -> str:
    """Axis of a screw, "" if it is none or if the plain product folds."""
    for k, axis in enumerate(_AXES):
        if not axis:
            continue
        others = [n for n in range(3) if n != k]
        cross = [rotation[3 * k + n] for n in others]
        cross += [rotation[3 * n + k] for n in others]
        aside = [position[n] for n in others]
        turns = rotation[4 * others[0]].value not in (0, 1, -1)
        if turns and all(x.value == 0 for x in (*cross, *aside)):
            return axis
    return ""


def along_a_screw(rotation: Nodes, position: Nodes, subspace: Nodes) -> bool:
    """Whether a screw about z leaves a subspace along z as it is."""
    nu = len(subspace) // 6
    aside = [subspace[row * nu + k] for row in (0, 1, 3, 4) for k in range(nu)]
    return nu > 0 and screw_axis(rotation, position) == "z" and all(x.value == 0 for x in aside)


def unit_row(column: Nodes) -> int | None:
    """Where a unit vector has its one; None if the column is none."""
    units = [row for row, entry in enumerate(column) if entry.value == 1]
    if len(units) == 1 and sum(entry.value == 0 for entry in column) == len(column) - 1:
        return units[0]
    return None
