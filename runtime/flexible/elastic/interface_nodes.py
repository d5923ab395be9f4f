"""Ports of an elastic body: the nodes of an end and their coupling to its section."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
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


# --- reduction ------------------------------------------------------------------------------------
#
# The unknowns w are six per rigid port (displacement of its point, rotation of its section, body
# axes), then those of all other nodes; u = T w.  A port of mean coupling is a row w -> motion.


@dataclass(frozen=True)
class Sections:
    """Finite-element model whose rigid ports move as sections."""

    model: ElasticModel
    ports: tuple[Port, ...]

    @cached_property
    def _stiff_ports(self) -> list[Port]:
        return [port for port in self.ports if port.stiff]

    @cached_property
    def expand(self) -> Any:
        """Sparse matrix T (u, w) from the unknowns w to all unknowns u."""
        from scipy import sparse

        model, stiff = self.model, self._stiff_ports
        port_unknowns = [port.unknowns(model) for port in stiff]
        rest = np.setdiff1d(np.arange(model.mass.shape[0]), np.concatenate([*port_unknowns, []]))
        rows, columns, values = (
            [rest],
            [6 * len(stiff) + np.arange(len(rest))],
            [np.ones(len(rest))],
        )
        for k, port in enumerate(stiff):
            section = port.section(model)
            rows.append(np.repeat(port_unknowns[k], 6))
            columns.append(np.tile(6 * k + np.arange(6), len(section)))
            values.append(section.reshape(-1))
        shape = (model.mass.shape[0], 6 * len(stiff) + len(rest))
        indices = (np.concatenate(rows).astype(int), np.concatenate(columns))
        return sparse.csr_array((np.concatenate(values), indices), shape=shape)

    @cached_property
    def stiffness(self) -> Any:
        """Sparse stiffness matrix (w, w), N/m."""
        return self.expand.T @ self.model.stiffness @ self.expand

    @cached_property
    def mass(self) -> Any:
        """Sparse mass matrix (w, w), kg."""
        return self.expand.T @ self.model.mass @ self.expand

    @cached_property
    def rows(self) -> dict[str, Any]:
        """Motion (6, w) of each port by name: displacement of its point, rotation, body axes."""
        from scipy import sparse

        width, rows = self.expand.shape[1], {}
        for port in self.ports:
            if port.stiff:
                indices = 6 * self._stiff_ports.index(port) + np.arange(6)
                unit = (np.ones(6), (np.arange(6), indices))
                rows[port.name] = sparse.csr_array(unit, shape=(6, width))
            else:
                mean = sparse.csr_array(port.mean(self.model))
                rows[port.name] = mean @ self.expand[port.unknowns(self.model)]
        return rows

    @cached_property
    def rigid_displacements(self) -> Array:
        """Unit translations, then unit rotations about the origin, as columns (w, 6)."""
        model, columns = self.model, np.zeros((self.expand.shape[1], 6))
        port_unknowns = [port.unknowns(model) for port in self._stiff_ports]
        for k, port in enumerate(self._stiff_ports):
            columns[6 * k : 6 * k + 6] = twist_transform(port.position)
        rest = np.setdiff1d(np.arange(model.mass.shape[0]), np.concatenate([*port_unknowns, []]))
        columns[6 * len(self._stiff_ports) :] = model.rigid_displacements[rest.astype(int)]
        return columns

    def unknowns(self, shapes: Array) -> Array:
        """Unknowns (w, k) of displacements (u, k) whose rigid ports move as sections."""
        port_unknowns = [port.unknowns(self.model) for port in self._stiff_ports]
        rest = np.setdiff1d(np.arange(len(shapes)), np.concatenate([*port_unknowns, []]))
        motions = [
            np.linalg.lstsq(port.section(self.model), shapes[indices], rcond=None)[0]
            for port, indices in zip(self._stiff_ports, port_unknowns, strict=True)
        ]
        return np.concatenate([*motions, shapes[rest]])

    def relieve_inertia(self, loads: Array, motions: Array) -> Array:
        """Loads (w, k) with inertia relief: balanced by the inertia of rigid motions (w, f)."""
        inertia = self.mass @ motions
        return np.asarray(loads - inertia @ np.linalg.solve(motions.T @ inertia, motions.T @ loads))

    def clamp(self, held: Sequence[Port]) -> Clamped:
        """Body with the sections of some ports fixed, factorised once per set of ports."""
        names = tuple(port.name for port in held)
        return self._clamped_cache.setdefault(names, Clamped(self, tuple(held)))

    @cached_property
    def _clamped_cache(self) -> dict[tuple[str, ...], Clamped]:
        return {}


def twist_transform(point: Array) -> Array:
    """Transform (6, 6) from translation and rotation at the origin to those at a point."""
    transform = np.eye(6)
    transform[:3, 3:] = -np.cross(np.eye(3), point)
    return transform


@dataclass(frozen=True)
class Clamped:
    """Static solutions of a body with fixed or prescribed sections."""

    sections: Sections
    held_ports: tuple[Port, ...]

    @cached_property
    def free_indices(self) -> Integers:
        """Indices of the unknowns w except sections of held rigid ports."""
        stiff = [port for port in self.sections.ports if port.stiff]
        fixed = [6 * stiff.index(port) + np.arange(6) for port in self.held_ports if port.stiff]
        return np.setdiff1d(np.arange(self.sections.expand.shape[1]), np.concatenate([*fixed, []]))

    @cached_property
    def rows(self) -> Any:
        """Constraint rows (6 m, free) of held ports of mean coupling; None without such ports."""
        from scipy import sparse

        soft = [self.sections.rows[port.name] for port in self.held_ports if not port.stiff]
        return sparse.vstack(soft).tocsc()[:, self.free_indices] if soft else None

    @property
    def count(self) -> int:
        """Number of independent free unknowns."""
        return len(self.free_indices) - (0 if self.rows is None else self.rows.shape[0])

    @cached_property
    def inverse(self) -> Callable[[Array, Array | None], Array]:
        """Solver: loads (free, k) and prescribed row values (6 m, k) to displacements (free, k)."""
        from scipy import sparse
        from scipy.sparse.linalg import splu

        free, rows = self.free_indices, self.rows
        matrix = self.sections.stiffness.tocsc()[free][:, free]
        # Scale the rows to the size of the stiffness, so that pivoting does not start with them.
        scale = float(np.max(np.abs(matrix.diagonal())))
        options: dict[str, object] = {"diag_pivot_thresh": 0.01, "options": {"SymmetricMode": True}}
        if rows is not None:  # indefinite
            matrix = sparse.block_array([[matrix, scale * rows.T], [scale * rows, None]])
            options = {}
        try:
            lu = splu(sparse.csc_array(matrix), permc_spec="MMD_AT_PLUS_A", **options)
        except RuntimeError:
            raise self.sections.model.error(
                "stiffness: expected a body that is stiff with a fixed end, found one that "
                "moves without strain; look for a mechanism inside it"
            ) from None

        def solve(loads: Array, prescribed: Array | None = None) -> Array:
            if rows is None:
                return np.asarray(lu.solve(np.ascontiguousarray(loads)))
            row_values = np.zeros((rows.shape[0], loads.shape[1]))
            if prescribed is not None:
                row_values = scale * prescribed
            return np.asarray(lu.solve(np.vstack([loads, row_values]))[: len(free)])

        return solve

    def full(self, displacements: Array) -> Array:
        """Unknowns (w, k) from free displacements (free, k), with held sections at zero."""
        unknowns = np.zeros((self.sections.expand.shape[1], displacements.shape[1]))
        unknowns[self.free_indices] = displacements
        return unknowns

    def statics(self, loads: Array) -> Array:
        """Static displacements (w, k) under loads (w, k), with held sections at zero."""
        return self.full(self.inverse(loads[self.free_indices], None))

    def constraint_shapes(self, port: Port) -> Array:
        """Static displacements (w, 6) in unit motions of one held section, the others at zero."""
        sections = self.sections
        if port.stiff:
            section_motion = sections.rows[port.name].T.toarray()
            loads = -(sections.stiffness @ section_motion)[self.free_indices]
            return section_motion + self.full(self.inverse(loads, None))
        soft = [p.name for p in self.held_ports if not p.stiff]
        unit = np.zeros((6 * len(soft), 6))
        unit[6 * soft.index(port.name) :][:6] = np.eye(6)
        return self.full(self.inverse(np.zeros((len(self.free_indices), 6)), unit))
