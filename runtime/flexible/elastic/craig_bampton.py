"""Shape functions of an elastic body: static shapes of its ends and vibration modes.

Component mode synthesis as named in Rui, Wang, Zhang, section 8.2 ((8.22) to (8.24)); the choice of
shapes is that of R. R. Craig, M. C. C. Bampton, AIAA J. 6 (1968) 1313-1319.  The conditions of the
floating frame remove the six rigid-body combinations.

Modes with a clamped end are poor where a hinge leaves it free: with two of them per plane, the
second frequency of a free bar is twice the exact one.  If no other end is loaded, or if the hinge
leaves all motions free, the vibration modes are therefore those of the body with its hinge.  The
static shapes are then attachment modes with inertia relief: the deflections under unit loads on the
ends, balanced by the inertia of the rigid motions that the hinge leaves free (R. R. Craig,
A. J. Kurdila, Fundamentals of Structural Dynamics, 2nd ed., sections 17.2 and 17.3).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mstmm.array_validation import Array

from ..resolution import resolved_frequency, ritz_frequencies
from .finite_element_model import ElasticModel
from .interface_nodes import Clamped, Port, Sections, twist_transform

FRAMES = ("tangent", "mean")

#: Number of unknowns up to which eigenvalue problems are solved with dense matrices.
_MAX_DENSE_UNKNOWNS = 300
#: Squared frequency, relative to the largest one, below which a motion has no strain.
_STRAINLESS = 1e-14


@dataclass(frozen=True)
class Release:
    """Free motions of a hinge at its section of the body, body axes.

    `twists` (6, f) are [displacement of its point; rotation], `loaded` (6, g) those of them along
    which a load acts.
    """

    twists: Array
    loaded: Array


@dataclass(frozen=True)
class Reduction:
    """Orthogonal shapes (u, n) of a body, with modal masses equal to the mass of the body.

    Attributes:
        sections: the model with sections at its ends.
        held_port: port of a tangent frame, which also supports the body in static solutions.
        frame: "tangent" (shapes vanish at `held_port`) or "mean" (shapes carry no momentum).
        shapes: (u, n), m per m of modal coordinate.
        frequencies: (n,) rad/s, ascending, of the body with its other ends free.
        static: number of static shapes; fixed: number of vibration modes.
        left_out: frequencies (rad/s) of shapes above the limit.
    """

    sections: Sections
    held_port: Port
    frame: str
    shapes: Array
    frequencies: Array
    static: int
    fixed: int
    left_out: Array
    released: bool = False  #: whether the modes are those of the body with its hinge

    def motion(self, port: Port) -> Array:
        """Displacement (m) and rotation (rad) of a port per mode (6, n)."""
        if port.stiff:
            unknowns = port.unknowns(self.sections.model)
            return np.asarray(np.linalg.lstsq(port.section(self.sections.model),
                                              self.shapes[unknowns], rcond=None)[0])  # fmt: skip
        mean = port.mean(self.sections.model)
        return np.asarray(mean @ self.shapes[port.unknowns(self.sections.model)])


def reduce(
    model: ElasticModel,
    ports: Sequence[Port],
    held: Port,
    modes: int,
    frame: str,
    highest: float | None = None,
    release: Release | None = None,
) -> Reduction:
    """Craig-Bampton shapes of a model, or shapes of a body whose hinge leaves motions free.

    Args:
        ports: all ports; `loaded` ones get six static shapes each.
        held: the loaded port with the inboard hinge.
        modes: number of vibration modes.
        frame: "tangent" at the held port, or "mean".
        highest: shapes above this frequency (rad/s) are left out.
        release: free motions of the hinge at the held port; None for none.

    Raises SceneError for more modes than unknowns, a body that moves without strain, and if no
    shape remains.
    """
    sections = Sections(model, tuple(ports))
    loaded = [port for port in ports if port.loaded]
    others = [port for port in loaded if port is not held]
    free_count = 0 if release is None else release.twists.shape[1]
    if release is not None and (free_count == 6 or (free_count and not others)):
        assumed = _hinged_shapes(sections, held, others, release, modes)
    else:
        release, clamped = None, sections.clamp(loaded)
        blocks = [clamped.constraint_shapes(port) for port in others]
        blocks.append(clamped.full(fixed_interface_modes(clamped, modes)))
        assumed = np.hstack(blocks)
    shapes = sections.expand @ assumed
    if not shapes.shape[1]:
        raise model.error(
            "modes = 0 leaves no shape, because only one end is loaded; give modes = 1 or more, "
            "or describe it as a [[body]]"
        )
    if frame == "mean":
        shapes = without_momentum(model, shapes)
    shapes, frequencies = orthogonalise(model, shapes)
    kept = frequencies <= (np.inf if highest is None else highest)
    if not kept.any():
        raise model.error(
            f"highest_frequency: expected at least the lowest frequency, {frequencies[0]:.6g} "
            f"rad/s, found {highest:.6g}; raise it, or describe the body as a rigid [[body]]"
        )
    return Reduction(
        sections, held, frame, shapes[:, kept], frequencies[kept], assumed.shape[1] - modes, modes,
        frequencies[~kept], release is not None,
    )  # fmt: skip


def resolution(reduction: Reduction, release: Release | None) -> float:
    """Highest frequency (rad/s) that the shapes resolve, with all ends but the held one free.

    The richer model for comparison adds the static deflections under the inertia of the shapes,
    one step of inverse iteration.
    """
    sections, held, model = reduction.sections, reduction.held_port, reduction.sections.model
    at_origin = model.rigid_displacements @ twist_transform(-held.position)
    motions = at_origin @ (np.zeros((6, 0)) if release is None else release.twists)
    shapes = reduction.shapes - at_origin @ reduction.motion(held)
    coupling = motions.T @ model.mass
    rigid_parts = np.linalg.solve(coupling @ motions, coupling @ shapes)
    loads = sections.expand.T @ (model.mass @ (shapes - motions @ rigid_parts))
    added = sections.expand @ sections.clamp([held]).statics(np.asarray(loads))

    def frequencies(columns: Array) -> Array:
        momentum = coupling @ columns
        mass = columns.T @ (model.mass @ columns)
        mass -= momentum.T @ np.linalg.solve(coupling @ motions, momentum)
        return ritz_frequencies(columns.T @ (model.stiffness @ columns), mass)

    return resolved_frequency(frequencies(shapes), frequencies(np.hstack([shapes, added])))


def _hinged_shapes(
    sections: Sections, held: Port, other_ports: Sequence[Port], release: Release, modes: int
) -> Array:
    """Attachment modes, then the lowest modes of the body with its hinge, as columns (w, n).

    The motion of the held section is subtracted.
    """
    at_origin = twist_transform(-held.position)
    motions = sections.rigid_displacements @ (at_origin @ release.twists)
    clamped = sections.clamp([held])
    rows = [sections.rows[port.name].toarray() for port in other_ports]
    rows.append(release.loaded.T @ sections.rows[held.name].toarray())
    static = clamped.statics(sections.relieve_inertia(np.vstack(rows).T, motions))
    return np.hstack([static, clamped.full(fixed_interface_modes(clamped, modes, motions))])


def fixed_interface_modes(clamped: Clamped, modes: int, motions: Array | None = None) -> Array:
    """Lowest modes (free, modes) with the sections of all loaded ports fixed.

    With rigid `motions` (w, f) that stay free, the modes are deflections relative to them.
    """
    if not modes:
        return np.zeros((len(clamped.free_indices), 0))
    model = clamped.sections.model
    if modes > clamped.count:
        raise model.error(
            f"modes: expected at most {clamped.count} fixed-interface modes, as many as there are "
            f"unknowns between the ends, found {modes}; use fewer modes or a finer mesh"
        )
    mass = clamped.sections.mass.tocsc()[clamped.free_indices][:, clamped.free_indices]
    is_dense = len(clamped.free_indices) <= _MAX_DENSE_UNKNOWNS or 2 * modes >= clamped.count
    relieved_mass = _RelievedMass(mass, *_mass_coupling(clamped, motions))
    squares, vectors = (_dense_modes if is_dense else _sparse_modes)(clamped, relieved_mass, modes)
    usable = int(np.count_nonzero(np.isfinite(squares) & (squares > 0)))
    if usable < modes:
        raise model.error(
            f"modes: expected at most {usable}, as many as there are modes with mass between the "
            f"ends, found {modes}; use fewer modes"
        )
    return vectors


@dataclass(frozen=True)
class _RelievedMass:
    """Mass (free, free) of deflections relative to free rigid motions: M - C^T J^-1 C.

    `mass` is M, `coupling` C (f, free), and `inertia` J (f, f) that of the rigid motions.
    """

    mass: Any
    coupling: Array
    inertia: Array

    def dense(self) -> Array:
        """The mass as a dense array (free, free)."""
        rigid_part = self.coupling.T @ np.linalg.solve(self.inertia, self.coupling)
        return np.asarray(self.mass.toarray() - rigid_part)

    def __matmul__(self, x: Array) -> Array:
        rigid_part = self.coupling.T @ np.linalg.solve(self.inertia, self.coupling @ x)
        return np.asarray(self.mass @ x - rigid_part)


def _mass_coupling(clamped: Clamped, motions: Array | None) -> tuple[Array, Array]:
    """Coupling (f, free) of rigid motions (w, f) with the free unknowns, and inertia (f, f)."""
    if motions is None:
        return np.zeros((0, len(clamped.free_indices))), np.zeros((0, 0))
    momentum = np.asarray((clamped.sections.mass @ motions).T)
    return momentum[:, clamped.free_indices], momentum @ motions


def _dense_modes(clamped: Clamped, mass: _RelievedMass, modes: int) -> tuple[Array, Array]:
    from scipy import linalg

    stiffness = clamped.sections.stiffness.tocsc()[clamped.free_indices][
        :, clamped.free_indices
    ].toarray()
    rows = clamped.rows
    basis = np.eye(len(stiffness)) if rows is None else linalg.null_space(rows.toarray())
    m, k = basis.T @ mass.dense() @ basis, basis.T @ stiffness @ basis
    # The mass may be singular (lumped, without rotary inertia), the stiffness is not.
    try:
        inverse, vectors = linalg.eigh((m + m.T) / 2, (k + k.T) / 2)
    except np.linalg.LinAlgError:
        raise clamped.sections.model.error(
            "stiffness: expected a body that is stiff with its ends fixed, found one that moves "
            "without strain; look for a mechanism inside it"
        ) from None
    order = np.argsort(inverse)[::-1][:modes]
    massless = inverse[order] <= 1e-15 * float(inverse.max())
    squares = np.where(massless, np.inf, 1 / np.where(massless, 1.0, inverse[order]))
    return squares, basis @ vectors[:, order]


def _sparse_modes(clamped: Clamped, mass: _RelievedMass, modes: int) -> tuple[Array, Array]:
    from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh

    size, solve = len(clamped.free_indices), clamped.inverse
    stiffness = clamped.sections.stiffness.tocsc()[clamped.free_indices][:, clamped.free_indices]

    def inverse(load: Array) -> Array:
        return solve(load.reshape(size, 1), None).reshape(size)

    operator = LinearOperator((size, size), matvec=inverse, dtype=np.float64)
    mass_operator = LinearOperator((size, size), matvec=mass.__matmul__, dtype=np.float64)
    start = inverse(np.cos(np.arange(size)))  # a fixed start vector makes runs reproducible
    try:
        squares, vectors = eigsh(
            stiffness, k=modes, M=mass_operator, sigma=0.0, OPinv=operator, v0=start, which="LM"
        )
    except ArpackError as failure:
        raise clamped.sections.model.error(
            f"modes: the {modes} lowest modes with fixed ends were not found ({failure}); use "
            "fewer modes, and look for parts without mass or far softer than the rest"
        ) from None
    order = np.argsort(squares)
    return squares[order], vectors[:, order]


def without_momentum(model: ElasticModel, shapes: Array) -> Array:
    """Shapes without momentum (mean frame): int rho phi = 0 and int rho r0 x phi = 0."""
    parts = np.linalg.solve(model.inertia, model.rigid_displacements.T @ (model.mass @ shapes))
    return np.asarray(shapes - model.rigid_displacements @ parts)


def orthogonalise(model: ElasticModel, shapes: Array) -> tuple[Array, Array]:
    """Shapes with diagonal mass and stiffness and the body's mass as modal mass; frequencies."""
    from scipy import linalg

    shapes = shapes / np.sqrt(np.sum(shapes * (model.mass @ shapes), axis=0))
    mass, stiffness = (shapes.T @ (matrix @ shapes) for matrix in (model.mass, model.stiffness))
    try:
        squares, combination = linalg.eigh((stiffness + stiffness.T) / 2, (mass + mass.T) / 2)
    except np.linalg.LinAlgError:
        raise model.error(
            "expected linearly independent shapes with mass, found dependent or massless ones; use "
            "fewer modes, or a mass matrix without zero directions"
        ) from None
    if squares[0] <= _STRAINLESS * squares[-1]:
        raise model.error(
            "stiffness: expected strain in every shape, found a motion without any: a mechanism "
            "inside the body, or pieces that are not joined"
        )
    shapes = shapes @ combination * np.sqrt(model.inertia[0, 0])
    largest = np.max(np.abs(shapes), axis=0)
    largest_index = np.argmax(np.abs(shapes) > 0.99 * largest, axis=0)
    signs = np.sign(shapes[largest_index, np.arange(shapes.shape[1])])
    return np.asarray(shapes * signs), np.sqrt(squares)
