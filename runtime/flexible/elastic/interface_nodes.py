"""Ports of an elastic body: the nodes of an end and their coupling to its section."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mstmm.array_validation import Array, Integers
from mstmm.numerics.rotations import from_orientation
from mstmm.scene.validators.validation_messages import did_you_mean

from .finite_element_model import ElasticModel, rigid_columns

#: Distance, relative to the size of the body, below which points coincide.
TOLERANCE = 1e-8


@dataclass(frozen=True)
class Port:
    """An end of an elastic body.

    Attributes:
        nodes: numbers of its nodes.
        position: (3,) its point, m; rotation: (3, 3) its axes to body axes.
        coupling: "rigid", the nodes move as one rigid section; "mean", the section follows the
            average motion of the nodes, which stay free to deform.
        loaded: whether a load may act on it, so that it gets static shapes.
    """

    name: str
    nodes: Integers
    position: Array
    rotation: Array
    coupling: str = "rigid"
    loaded: bool = True

    @property
    def stiff(self) -> bool:
        """Whether its nodes move as one rigid section."""
        return self.coupling == "rigid" and self.loaded

    def unknowns(self, model: ElasticModel) -> Integers:
        """Indices of the unknowns of its nodes."""
        d = model.unknowns
        return np.asarray((self.nodes[:, None] * d + np.arange(d)).reshape(-1))

    def section(self, model: ElasticModel) -> Array:
        """Unknowns of its nodes in unit motions of a rigid section (nodes * unknowns, 6)."""
        return rigid_columns(model.nodes[self.nodes] - self.position, model.unknowns)

    def mean(self, model: ElasticModel) -> Array:
        """Least-squares motion of the section per unknown of its nodes (6, nodes * unknowns)."""
        return np.asarray(np.linalg.pinv(self.section(model)))


def select_port(model: ElasticModel, name: str, table: Any, loaded: bool) -> Port:
    """Port of an elastic body, from a table of `ends`.

    Raises SceneError if it selects no nodes, nodes that do not exist, or nodes that do not define
    the rotation of the section.
    """
    nodes = _selected_nodes(model, name, table)
    _check_rotation_defined(model, name, nodes)
    points = model.nodes[nodes]
    given = getattr(table, "position", None)
    position = points.mean(axis=0) if given is None else np.asarray(given, dtype=float)
    rotation = np.asarray(from_orientation(getattr(table, "orientation", None) or (0.0, 0.0, 0.0)))
    return Port(name, nodes, position, rotation, getattr(table, "coupling", "rigid"), loaded)


def _selected_nodes(model: ElasticModel, name: str, table: Any) -> Integers:
    if getattr(table, "nodes", None) is not None:
        return _nodes_by_number(model, name, table.nodes)
    if getattr(table, "set", None) is not None:
        return _nodes_of_set(model, name, table.set)
    points, tolerance = model.nodes, TOLERANCE * model.size
    if getattr(table, "plane", None) is not None:
        normal, offset = np.asarray(table.plane[:3], dtype=float), float(table.plane[3])
        length = float(np.linalg.norm(normal))
        region, distance = "plane", np.abs(points @ normal - offset) / (length or 1.0)
    elif getattr(table, "sphere", None) is not None:
        centre, radius = np.asarray(table.sphere[:3], dtype=float), float(table.sphere[3])
        region, distance = "sphere", np.linalg.norm(points - centre, axis=1) - radius
    else:
        low, high = np.asarray(table.box, dtype=float)
        outside = np.maximum(np.maximum(low - points, points - high), 0.0)
        region, distance = "box", np.linalg.norm(outside, axis=1)
    nodes = np.flatnonzero(distance <= tolerance)
    if not len(nodes):
        nearest = int(np.argmin(distance))
        low, high = points.min(axis=0), points.max(axis=0)
        raise model.error(
            f"ends.{name}: the {region} contains no node of the body, which extends from "
            f"{_format_point(low)} to {_format_point(high)} m; the nearest node "
            f"{_format_point(points[nearest])} is {distance[nearest]:.4g} m away; move or widen "
            f"the {region}"
        )
    return nodes


def _nodes_by_number(model: ElasticModel, name: str, numbers: Any) -> Integers:
    nodes = np.unique(np.asarray(numbers, dtype=np.int64))
    count = len(model.nodes)
    invalid = [int(node) for node in nodes if not 0 <= node < count]
    if invalid or not len(nodes):
        found = ", ".join(map(str, invalid[:5])) or "none"
        raise model.error(
            f"ends.{name}: nodes: expected numbers from 0 to {count - 1}, found {found}; number "
            "the nodes in the order of the file"
        )
    return nodes


def _nodes_of_set(model: ElasticModel, name: str, wanted: str) -> Integers:
    if wanted not in model.sets:
        raise model.error(
            f"ends.{name}: the mesh has no named boundary {wanted!r}"
            f"{did_you_mean(wanted, model.sets)}"
        )
    return model.sets[wanted]


def _check_rotation_defined(model: ElasticModel, name: str, nodes: Integers) -> None:
    """Raise SceneError for nodes without rotations that do not span a plane."""
    if model.unknowns == 6:
        return
    points = model.nodes[nodes]
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    if len(nodes) < 3 or spread[1] <= TOLERANCE * model.size:
        raise model.error(
            f"ends.{name}: expected three or more nodes that do not lie on one line, to define the "
            f"rotation of the section; found {len(nodes)}"
            f"{' on a line' if len(nodes) > 2 else ''}; choose a face of the body"
        )


def check_separate_nodes(model: ElasticModel, ports: list[Port]) -> None:
    """Raise SceneError for a node that belongs to two loaded ports."""
    owner: dict[int, str] = {}
    for port in ports:
        for node in port.nodes if port.loaded else ():
            if owner.setdefault(int(node), port.name) != port.name:
                raise model.error(
                    f"ends.{port.name} and ends.{owner[int(node)]} share node {int(node)}, which "
                    "cannot follow two sections; choose separate nodes, or use one end for both"
                )


def _format_point(point: Array) -> str:
    return "[" + ", ".join(f"{value:.6g}" for value in point) + "]"
