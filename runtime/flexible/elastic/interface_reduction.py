"""An elastic body's unknowns with sections in place of the nodes of rigid ports, and its solutions.

The unknowns w are six per rigid port (displacement of its point, rotation of its section, body
axes), then those of every node outside; u = T w.  A port of mean coupling is a row w -> motion.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from mstmm.array_validation import Array, Integers

from .finite_element_model import ElasticModel
from .interface_nodes import Port


@dataclass(frozen=True)
class Sections:
    """A model whose rigid ports move as sections."""

    model: ElasticModel
    ports: tuple[Port, ...]

    @cached_property
    def _stiff(self) -> list[Port]:
        return [port for port in self.ports if port.stiff]

    @cached_property
    def expand(self) -> Any:
        """T: sparse (u, w)."""
        from scipy import sparse

        model, stiff = self.model, self._stiff
        taken = [port.unknowns(model) for port in stiff]
        rest = np.setdiff1d(np.arange(model.mass.shape[0]), np.concatenate([*taken, []]))
        rows, columns, values = (
            [rest],
            [6 * len(stiff) + np.arange(len(rest))],
            [np.ones(len(rest))],
        )
        for k, port in enumerate(stiff):
            section = port.section(model)
            rows.append(np.repeat(taken[k], 6))
            columns.append(np.tile(6 * k + np.arange(6), len(section)))
            values.append(section.reshape(-1))
        shape = (model.mass.shape[0], 6 * len(stiff) + len(rest))
        places = (np.concatenate(rows).astype(int), np.concatenate(columns))
        return sparse.csr_array((np.concatenate(values), places), shape=shape)

    @cached_property
    def stiffness(self) -> Any:
        """Sparse (w, w), N/m."""
        return self.expand.T @ self.model.stiffness @ self.expand

    @cached_property
    def mass(self) -> Any:
        """Sparse (w, w), kg."""
        return self.expand.T @ self.model.mass @ self.expand

    @cached_property
    def rows(self) -> dict[str, Any]:
        """Each port's motion (6, w): displacement of its point, rotation, body axes."""
        from scipy import sparse

        width, found = self.expand.shape[1], {}
        for port in self.ports:
            if port.stiff:
                places = 6 * self._stiff.index(port) + np.arange(6)
                unit = (np.ones(6), (np.arange(6), places))
                found[port.name] = sparse.csr_array(unit, shape=(6, width))
            else:
                mean = sparse.csr_array(port.mean(self.model))
                found[port.name] = mean @ self.expand[port.unknowns(self.model)]
        return found

    @cached_property
    def rigid(self) -> Array:
        """(w, 6): unit translations, then unit rotations about the origin."""
        model, found = self.model, np.zeros((self.expand.shape[1], 6))
        taken = np.concatenate([*(port.unknowns(model) for port in self._stiff), []]).astype(int)
        for k, port in enumerate(self._stiff):
            found[6 * k : 6 * k + 6] = twist_transform(port.position)
        rest = np.setdiff1d(np.arange(model.mass.shape[0]), taken)
        found[6 * len(self._stiff) :] = model.rigid[rest]
        return found

    def unknowns(self, shapes: Array) -> Array:
        """(w, k) of displacements (u, k) whose rigid ports move as sections."""
        taken = [port.unknowns(self.model) for port in self._stiff]
        rest = np.setdiff1d(np.arange(len(shapes)), np.concatenate([*taken, []]))
        moved = [
            np.linalg.lstsq(port.section(self.model), shapes[own], rcond=None)[0]
            for port, own in zip(self._stiff, taken, strict=True)
        ]
        return np.concatenate([*moved, shapes[rest]])

    def relieved(self, loads: Array, motions: Array) -> Array:
        """Loads (w, k) with the inertia of the rigid motions (w, f) that they cause, so that they
        do no work on those."""
        inertia = self.mass @ motions
        return np.asarray(loads - inertia @ np.linalg.solve(motions.T @ inertia, motions.T @ loads))

    def clamped(self, held: Sequence[Port]) -> Clamped:
        """The same body with the sections of some ports held, factorised once."""
        names = tuple(port.name for port in held)
        return self._clamped.setdefault(names, Clamped(self, tuple(held)))

    @cached_property
    def _clamped(self) -> dict[tuple[str, ...], Clamped]:
        return {}


def twist_transform(point: Array) -> Array:
    """(6, 6): translation and rotation at a point from translation and rotation at the origin."""
    found = np.eye(6)
    found[:3, 3:] = -np.cross(np.eye(3), point)
    return found


@dataclass(frozen=True)
class Clamped:
    """Solutions of a body some of whose sections are held or moved as prescribed."""

    sections: Sections
    held: tuple[Port, ...]

    @cached_property
    def free(self) -> Integers:
        """Places of w that are not sections of held rigid ports."""
        stiff = [port for port in self.sections.ports if port.stiff]
        gone = [6 * stiff.index(port) + np.arange(6) for port in self.held if port.stiff]
        return np.setdiff1d(np.arange(self.sections.expand.shape[1]), np.concatenate([*gone, []]))

    @cached_property
    def rows(self) -> Any:
        """Rows (6 m, free) whose values held ports of mean coupling prescribe; None without."""
        from scipy import sparse

        soft = [self.sections.rows[port.name] for port in self.held if not port.stiff]
        return sparse.vstack(soft).tocsc()[:, self.free] if soft else None

    @property
    def count(self) -> int:
        """Unknowns that are left to move."""
        return len(self.free) - (0 if self.rows is None else self.rows.shape[0])

    @cached_property
    def inverse(self) -> Callable[[Array, Array | None], Array]:
        """(loads (free, k), prescribed rows (6 m, k)) -> displacements (free, k)."""
        from scipy import sparse
        from scipy.sparse.linalg import splu

        free, rows = self.free, self.rows
        matrix = self.sections.stiffness.tocsc()[free][:, free]
        #  rows of the size of the stiffness, or pivoting would take them first
        scale = float(np.max(np.abs(matrix.diagonal())))
        options: dict[str, object] = {"diag_pivot_thresh": 0.01, "options": {"SymmetricMode": True}}
        if rows is not None:  # indefinite
            matrix = sparse.block_array([[matrix, scale * rows.T], [scale * rows, None]])
            options = {}
        try:
            lu = splu(sparse.csc_array(matrix), permc_spec="MMD_AT_PLUS_A", **options)
        except RuntimeError:
            raise self.sections.model.refuse(
                "stiffness: expected a body that is stiff once an end is held, found one that "
                "moves without strain; look for a mechanism inside it"
            ) from None

        def solve(loads: Array, prescribed: Array | None = None) -> Array:
            if rows is None:
                return np.asarray(lu.solve(np.ascontiguousarray(loads)))
            below = np.zeros((rows.shape[0], loads.shape[1]))
            if prescribed is not None:
                below = scale * prescribed
            return np.asarray(lu.solve(np.vstack([loads, below]))[: len(free)])

        return solve

    def full(self, displacements: Array) -> Array:
        """(w, k) from (free, k), held sections at rest."""
        found = np.zeros((self.sections.expand.shape[1], displacements.shape[1]))
        found[self.free] = displacements
        return found

    def statics(self, loads: Array) -> Array:
        """(w, k) under loads (w, k), held sections at rest."""
        return self.full(self.inverse(loads[self.free], None))

    def constraint_shapes(self, port: Port) -> Array:
        """(w, 6): static displacements in unit motions of one held section, the others at rest."""
        sections = self.sections
        if port.stiff:
            whole = sections.rows[port.name].T.toarray()
            loads = -(sections.stiffness @ whole)[self.free]
            return whole + self.full(self.inverse(loads, None))
        soft = [p.name for p in self.held if not p.stiff]
        unit = np.zeros((6 * len(soft), 6))
        unit[6 * soft.index(port.name) :][:6] = np.eye(6)
        return self.full(self.inverse(np.zeros((len(self.free), 6)), unit))
