"""Shapes of an elastic body: static shapes of its ends and fixed-interface modes.

Component mode synthesis as named in Rui, Wang, Zhang, section 8.2 ((8.22) to (8.24)); the choice of
shapes is that of R. R. Craig, M. C. C. Bampton, AIAA J. 6 (1968) 1313-1319.  The six rigid-body
combinations go with the choice of the floating frame.

Modes with an end clamped are poor where a hinge leaves it free: a free bar of two such modes per
plane has its second frequency at twice what it is.  Where no other end carries loads, and where the
hinge leaves all motions free, the vibration shapes are those of the body as its hinge holds it, and
the static ones attachment modes with inertia relief: the deflections under unit loads on the ends,
balanced by the inertia of the rigid motions that the hinge leaves free (R. R. Craig, A. J. Kurdila,
Fundamentals of Structural Dynamics, 2nd ed., sections 17.2 and 17.3).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mstmm.array_validation import Array

from ..resolution import resolved_frequency, ritz_frequencies
from .finite_element_model import ElasticModel
from .interface_nodes import Port
from .interface_reduction import Clamped, Sections, twist_transform

FRAMES = ("tangent", "mean")

#: Free unknowns up to which eigenvalue problems are solved densely.
_DENSE = 300
#: Squared frequencies below this part of the largest are motions without strain.
_STRAINLESS = 1e-14


@dataclass(frozen=True)
class Release:
    """What a hinge leaves free at the section that it holds: twists (6, f) [displacement of its
    point; rotation], body axes, and those of them (6, g) along which something acts on it."""

    twists: Array
    loaded: Array


@dataclass(frozen=True)
class Reduction:
    """Shapes (u, n) over the body's unknowns, orthogonal and of modal mass equal to the body's.

    Attributes:
        sections: the model with sections at its ends.
        held: the port where a tangent frame sits, and which supports the body in static solutions.
        frame: "tangent" (shapes vanish at `held`) or "mean" (shapes carry no momentum).
        shapes: (u, n), m per m of modal coordinate; sections: (w, n) the same over sections.
        frequencies: (n,) rad/s, ascending, of the body with its other ends free.
        static: how many static shapes went in, fixed: how many vibration modes.
        left_out: frequencies of shapes above the highest one wanted.
    """

    sections: Sections
    held: Port
    frame: str
    shapes: Array
    frequencies: Array
    static: int
    fixed: int
    left_out: Array
    released: bool = False  #: the modes are those of the body as its hinge holds it

    def motion(self, port: Port) -> Array:
        """(6, n): displacement (m) of the port's point and rotation (rad) of its section."""
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
    """Craig-Bampton shapes of a model with ports, or those of a body that its hinge leaves free.

    Args:
        ports: every port; those that are `loaded` get six static shapes each.
        held: the loaded port by which the body is held.
        modes: number of vibration modes.
        frame: "tangent" at the held port, or "mean".
        highest: shapes above this frequency (rad/s) are left out.
        release: what the hinge leaves free at the held port; None for nothing.

    Raises SceneError for more modes than there are, a body that moves without strain, and if no
    shape is left.
    """
    sections = Sections(model, tuple(ports))
    loaded = [port for port in ports if port.loaded]
    others = [port for port in loaded if port is not held]
    free = 0 if release is None else release.twists.shape[1]
    if release is not None and (free == 6 or (free and not others)):
        found = _released_shapes(sections, held, others, release, modes)
    else:
        release, clamped = None, sections.clamped(loaded)
        parts = [clamped.constraint_shapes(port) for port in others]
        parts.append(clamped.full(fixed_interface_modes(clamped, modes)))
        found = np.hstack(parts)
    shapes = sections.expand @ found
    if not shapes.shape[1]:
        raise model.refuse(
            "modes = 0 leaves no shape, for only one end carries loads; write modes = 1 or more, "
            "or describe it as a [[body]]"
        )
    if frame == "mean":
        shapes = without_momentum(model, shapes)
    shapes, frequencies = orthogonalise(model, shapes)
    kept = frequencies <= (np.inf if highest is None else highest)
    if not kept.any():
        raise model.refuse(
            f"highest_frequency: expected at least the lowest frequency, {frequencies[0]:.6g} "
            f"rad/s, found {highest:.6g}; raise it, or describe the body as a rigid [[body]]"
        )
    return Reduction(
        sections, held, frame, shapes[:, kept], frequencies[kept], found.shape[1] - modes, modes,
        frequencies[~kept], release is not None,
    )  # fmt: skip


def resolution(reduction: Reduction, release: Release | None) -> float:
    """rad/s up to which the shapes hold, with all ends but the held one free.

    Beside the shapes the richer model has their deflections under their own inertia, one step of
    inverse iteration.
    """
    sections, held, model = reduction.sections, reduction.held, reduction.sections.model
    at_origin = model.rigid @ twist_transform(-held.position)
    motions = at_origin @ (np.zeros((6, 0)) if release is None else release.twists)
    shapes = reduction.shapes - at_origin @ reduction.motion(held)
    coupling = motions.T @ model.mass
    follow = np.linalg.solve(coupling @ motions, coupling @ shapes)
    loads = sections.expand.T @ (model.mass @ (shapes - motions @ follow))
    richer = sections.expand @ sections.clamped([held]).statics(np.asarray(loads))

    def frequencies(columns: Array) -> Array:
        carried = coupling @ columns
        mass = columns.T @ (model.mass @ columns)
        mass -= carried.T @ np.linalg.solve(coupling @ motions, carried)
        return ritz_frequencies(columns.T @ (model.stiffness @ columns), mass)

    return resolved_frequency(frequencies(shapes), frequencies(np.hstack([shapes, richer])))


def _released_shapes(
    sections: Sections, held: Port, others: Sequence[Port], release: Release, modes: int
) -> Array:
    """(w, n): attachment modes, then the lowest modes of the body as its hinge holds it; less the
    motion of the held section."""
    at_origin = twist_transform(-held.position)
    motions = sections.rigid @ (at_origin @ release.twists)
    clamped = sections.clamped([held])
    rows = [sections.rows[port.name].toarray() for port in others]
    rows.append(release.loaded.T @ sections.rows[held.name].toarray())
    static = clamped.statics(sections.relieved(np.vstack(rows).T, motions))
    return np.hstack([static, clamped.full(fixed_interface_modes(clamped, modes, motions))])


def fixed_interface_modes(clamped: Clamped, modes: int, motions: Array | None = None) -> Array:
    """(free, modes): the lowest modes with the sections of all loaded ports held, but for the rigid
    `motions` (w, f) that are left free: the deflections against those."""
    if not modes:
        return np.zeros((len(clamped.free), 0))
    model = clamped.sections.model
    if modes > clamped.count:
        raise model.refuse(
            f"modes: expected at most {clamped.count} fixed-interface modes, as many as there are "
            f"unknowns between the ends, found {modes}; take fewer modes or a finer mesh"
        )
    mass = clamped.sections.mass.tocsc()[clamped.free][:, clamped.free]
    dense = len(clamped.free) <= _DENSE or 2 * modes >= clamped.count
    inertia = _FollowingMass(mass, *_carried_mass(clamped, motions))
    squares, found = (_dense if dense else _sparse)(clamped, inertia, modes)
    usable = int(np.count_nonzero(np.isfinite(squares) & (squares > 0)))
    if usable < modes:
        raise model.refuse(
            f"modes: expected at most {usable}, as many as there are modes with mass between the "
            f"ends, found {modes}; take fewer modes"
        )
    return found


@dataclass(frozen=True)
class _FollowingMass:
    """The mass (free, free) of deflections against rigid motions that follow them freely: M less
    C^T J^-1 C with C (f, free) their coupling and J (f, f) the inertia of the motions."""

    mass: Any
    coupling: Array
    inertia: Array

    def dense(self) -> Array:
        """(free, free)."""
        followed = self.coupling.T @ np.linalg.solve(self.inertia, self.coupling)
        return np.asarray(self.mass.toarray() - followed)

    def __matmul__(self, x: Array) -> Array:
        followed = self.coupling.T @ np.linalg.solve(self.inertia, self.coupling @ x)
        return np.asarray(self.mass @ x - followed)


def _carried_mass(clamped: Clamped, motions: Array | None) -> tuple[Array, Array]:
    """Coupling (f, free) of rigid motions (w, f) with the unknowns, and their inertia (f, f)."""
    if motions is None:
        return np.zeros((0, len(clamped.free))), np.zeros((0, 0))
    moved = np.asarray((clamped.sections.mass @ motions).T)
    return moved[:, clamped.free], moved @ motions


def _dense(clamped: Clamped, mass: _FollowingMass, modes: int) -> tuple[Array, Array]:
    from scipy import linalg

    stiffness = clamped.sections.stiffness.tocsc()[clamped.free][:, clamped.free].toarray()
    rows = clamped.rows
    basis = np.eye(len(stiffness)) if rows is None else linalg.null_space(rows.toarray())
    m, k = basis.T @ mass.dense() @ basis, basis.T @ stiffness @ basis
    #  the mass may be singular (lumped, without rotary inertia), the stiffness is not
    try:
        inverse, found = linalg.eigh((m + m.T) / 2, (k + k.T) / 2)
    except np.linalg.LinAlgError:
        raise clamped.sections.model.refuse(
            "stiffness: expected a body that is stiff once its ends are held, found one that moves "
            "without strain; look for a mechanism inside it"
        ) from None
    order = np.argsort(inverse)[::-1][:modes]
    small = inverse[order] <= 1e-15 * float(inverse.max())
    squares = np.where(small, np.inf, 1 / np.where(small, 1.0, inverse[order]))
    return squares, basis @ found[:, order]


def _sparse(clamped: Clamped, mass: _FollowingMass, modes: int) -> tuple[Array, Array]:
    from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh

    size, solve = len(clamped.free), clamped.inverse
    stiffness = clamped.sections.stiffness.tocsc()[clamped.free][:, clamped.free]

    def inverse(load: Array) -> Array:
        return solve(load.reshape(size, 1), None).reshape(size)

    operator = LinearOperator((size, size), matvec=inverse, dtype=np.float64)
    weighing = LinearOperator((size, size), matvec=mass.__matmul__, dtype=np.float64)
    start = inverse(np.cos(np.arange(size)))  # one start for all runs, so that runs agree
    try:
        squares, found = eigsh(
            stiffness, k=modes, M=weighing, sigma=0.0, OPinv=operator, v0=start, which="LM"
        )
    except ArpackError as failure:
        raise clamped.sections.model.refuse(
            f"modes: the {modes} lowest modes with the ends held were not found ({failure}); take "
            "fewer modes, and look for parts without mass or far softer than the rest"
        ) from None
    order = np.argsort(squares)
    return squares[order], found[:, order]


def without_momentum(model: ElasticModel, shapes: Array) -> Array:
    """Shapes less their rigid part: int rho phi = 0 and int rho r0 x phi = 0 (mean frame)."""
    parts = np.linalg.solve(model.inertia, model.rigid.T @ (model.mass @ shapes))
    return np.asarray(shapes - model.rigid @ parts)


def orthogonalise(model: ElasticModel, shapes: Array) -> tuple[Array, Array]:
    """Shapes with diagonal mass and stiffness, modal mass that of the body, and frequencies."""
    from scipy import linalg

    shapes = shapes / np.sqrt(np.sum(shapes * (model.mass @ shapes), axis=0))
    mass, stiffness = (shapes.T @ (matrix @ shapes) for matrix in (model.mass, model.stiffness))
    try:
        squares, mix = linalg.eigh((stiffness + stiffness.T) / 2, (mass + mass.T) / 2)
    except np.linalg.LinAlgError:
        raise model.refuse(
            "expected shapes with mass that differ from each other, found some that do not; take "
            "fewer modes, or a mass matrix without zero directions"
        ) from None
    if squares[0] <= _STRAINLESS * squares[-1]:
        raise model.refuse(
            "stiffness: expected strain in every shape, found a motion without any: a mechanism "
            "inside the body, or pieces that are not joined"
        )
    shapes = shapes @ mix * np.sqrt(model.inertia[0, 0])
    largest = np.max(np.abs(shapes), axis=0)
    first = np.argmax(np.abs(shapes) > 0.99 * largest, axis=0)
    signs = np.sign(shapes[first, np.arange(shapes.shape[1])])
    return np.asarray(shapes * signs), np.sqrt(squares)
