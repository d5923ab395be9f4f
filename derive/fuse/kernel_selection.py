"""Properties of nodes, known at compile time, that decide which kernel is cheapest."""

from __future__ import annotations

from mstmm.ir.inline import Nodes

#: Axes with screw kernels; a rotation about y uses the general product.
_AXES = ("x", "", "z")


def screw_axis(rotation: Nodes, position: Nodes) -> str:
    """Axis of a screw; "" if it is none or if the plain product folds."""
    for k, axis in enumerate(_AXES):
        if not axis:
            continue
        across = [n for n in range(3) if n != k]
        cross = [rotation[3 * k + n] for n in across]
        cross += [rotation[3 * n + k] for n in across]
        offset = [position[n] for n in across]
        turns = rotation[4 * across[0]].value not in (0, 1, -1)
        if turns and all(x.value == 0 for x in (*cross, *offset)):
            return axis
    return ""


def along_a_screw(rotation: Nodes, position: Nodes, subspace: Nodes) -> bool:
    """Whether a screw about z leaves a subspace along z unchanged."""
    nu = len(subspace) // 6
    across = [subspace[row * nu + k] for row in (0, 1, 3, 4) for k in range(nu)]
    return nu > 0 and screw_axis(rotation, position) == "z" and all(x.value == 0 for x in across)


def unit_row(column: Nodes) -> int | None:
    """Row of the one in a unit vector; None if the column is no unit vector."""
    units = [row for row, entry in enumerate(column) if entry.value == 1]
    if len(units) == 1 and sum(entry.value == 0 for entry in column) == len(column) - 1:
        return units[0]
    return None
