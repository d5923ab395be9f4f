"""Ports of an elastic body: the nodes of an end, and how they follow its section."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mstmm.array_validation import Array, Integers
from mstmm.numerics.rotations import from_orientation
from mstmm.scene.validators.validation_messages import did_you_mean

from .finite_element_model import ElasticModel, rigid_columns

#: Lengths below this part of the body's are the same place.
SAME = 1e-8


@dataclass(frozen=True)
class Port:
    """An end of an elastic body.

    Attributes:
        nodes: numbers of its nodes.
        position: (3,) m, its point; rotation: (3, 3), its axes -> body axes.
        coupling: "rigid", the nodes move as one rigid section; "mean", the section moves as the
            nodes do on average and leaves them free to deform.
        loaded: a load may act on it, so that it gets static shapes; else it is only watched.
    """

    name: str
    nodes: Integers
    position: Array
    rotation: Array
    coupling: str = "rigid"
    loaded: bool = True

    @property
    def stiff(self) -> bool:
        """True if its nodes move as one rigid section."""
        return self.coupling == "rigid" and self.loaded

    def unknowns(self, model: ElasticModel) -> Integers:
        """Places of its nodes' unknowns."""
        d = model.unknowns
        return np.asarray((self.nodes[:, None] * d + np.arange(d)).reshape(-1))

    def section(self, model: ElasticModel) -> Array:
        """(nodes * unknowns, 6): the nodes' unknowns in unit motions of a rigid section."""
        return rigid_columns(model.nodes[self.nodes] - self.position, model.unknowns)

    def mean(self, model: ElasticModel) -> Array:
        """(6, nodes * unknowns): motion of the section that fits the nodes' best."""
        return np.asarray(np.linalg.pinv(self.section(model)))


def select_port(model: ElasticModel, name: str, table: Any, loaded: bool) -> Port:
    """The port that a table of `ends` selects.

    Raises SceneError if it selects no nodes, nodes that do not exist, or nodes that cannot say how
    the section turns.
    """
    nodes = _selected(model, name, table)
    _turns(model, name, nodes)
    points = model.nodes[nodes]
    given = getattr(table, "position", None)
    position = points.mean(axis=0) if given is None else np.asarray(given, dtype=float)
    rotation = np.asarray(from_orientation(getattr(table, "orientation", None) or (0.0, 0.0, 0.0)))
    return Port(name, nodes, position, rotation, getattr(table, "coupling", "rigid"), loaded)


def _selected(model: ElasticModel, name: str, table: Any) -> Integers:
    if getattr(table, "nodes", None) is not None:
        return _by_number(model, name, table.nodes)
    if getattr(table, "set", None) is not None:
        return _by_set(model, name, table.set)
    points, far = model.nodes, SAME * model.size
    if getattr(table, "plane", None) is not None:
        normal, offset = np.asarray(table.plane[:3], dtype=float), float(table.plane[3])
        length = float(np.linalg.norm(normal))
        what, distance = "plane", np.abs(points @ normal - offset) / (length or 1.0)
    elif getattr(table, "sphere", None) is not None:
        centre, radius = np.asarray(table.sphere[:3], dtype=float), float(table.sphere[3])
        what, distance = "sphere", np.linalg.norm(points - centre, axis=1) - radius
    else:
        low, high = np.asarray(table.box, dtype=float)
        outside = np.maximum(np.maximum(low - points, points - high), 0.0)
        what, distance = "box", np.linalg.norm(outside, axis=1)
    chosen = np.flatnonzero(distance <= far)
    if not len(chosen):
        nearest = int(np.argmin(distance))
        low, high = points.min(axis=0), points.max(axis=0)
        raise model.refuse(
            f"ends.{name}: the {what} holds no node of the body, which lies between {_place(low)} "
            f"and {_place(high)} m; the nearest node {_place(points[nearest])} is "
            f"{distance[nearest]:.4g} m off; move or widen the {what}"
        )
    return chosen


def _by_number(model: ElasticModel, name: str, numbers: Any) -> Integers:
    nodes = np.unique(np.asarray(numbers, dtype=np.int64))
    count = len(model.nodes)
    outside = [int(node) for node in nodes if not 0 <= node < count]
    if outside or not len(nodes):
        found = ", ".join(map(str, outside[:5])) or "none"
        raise model.refuse(
            f"ends.{name}: nodes: expected numbers from 0 to {count - 1}, found {found}; number "
            "the nodes in the order of the file"
        )
    return nodes


def _by_set(model: ElasticModel, name: str, wanted: str) -> Integers:
    if wanted not in model.sets:
        raise model.refuse(
            f"ends.{name}: there is no named boundary {wanted!r} in the mesh"
            f"{did_you_mean(wanted, model.sets)}"
        )
    return model.sets[wanted]


def _turns(model: ElasticModel, name: str, nodes: Integers) -> None:
    """Nodes without rotations must span a plane to say how a section turns."""
    if model.unknowns == 6:
        return
    points = model.nodes[nodes]
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    if len(nodes) < 3 or spread[1] <= SAME * model.size:
        raise model.refuse(
            f"ends.{name}: expected three or more nodes that do not lie on one line, so that they "
            f"say how the section turns; found {len(nodes)}"
            f"{' on a line' if len(nodes) > 2 else ''}; choose a face of the body"
        )


def check_separate_nodes(model: ElasticModel, ports: list[Port]) -> None:
    """SceneError if a node belongs to two sections that move on their own."""
    owner: dict[int, str] = {}
    for one in ports:
        for node in one.nodes if one.loaded else ():
            if owner.setdefault(int(node), one.name) != one.name:
                raise model.refuse(
                    f"ends.{one.name} and ends.{owner[int(node)]} share node {int(node)}, which "
                    "cannot follow two sections; choose separate nodes, or use one end for both"
                )


def _place(point: Array) -> str:
    return "[" + ", ".join(f"{value:.6g}" for value in point) + "]"
