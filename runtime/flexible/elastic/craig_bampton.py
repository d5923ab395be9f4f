"""Shapes of an elastic body: static shapes of its ends and fixed-interface modes.

Component mode synthesis as named in Rui, Wang, Zhang, section 8.2 ((8.22) to (8.24)); the choice of
shapes is that of R. R. Craig, M. C. C. Bampton, AIAA J. 6 (1968) 1313-1319.  The six rigid-body
combinations go with the choice of the floating frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mstmm.arrays import Array

from .model import ElasticModel
from .ports import Port
from .sections import Clamped, Sections

FRAMES = ("tangent", "mean")

#: Free unknowns up to which eigenvalue problems are solved densely.
_DENSE = 300
#: Squared frequencies below this part of the largest are motions without strain.
_STRAINLESS = 1e-14


@dataclass(frozen=True)
class Reduction:
    """Shapes (u, n) over the body's unknowns, orthogonal and of modal mass equal to the body's.

    Attributes:
        sections: the model with sections at its ends.
        held: the port where a tangent frame sits, and which supports the body in static solutions.
        frame: "tangent" (shapes vanish at `held`) or "mean" (shapes carry no momentum).
        shapes: (u, n), m per m of modal coordinate; sections: (w, n) the same over sections.
        frequencies: (n,) rad/s, ascending, of the body with its other ends free.
        static: how many static shapes went in, fixed: how many fixed-interface modes.
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
) -> Reduction:
    """Craig-Bampton shapes of a model with ports.

    Args:
        ports: every port; those that are `loaded` get six static shapes each.
        held: the loaded port by which the body is held.
        modes: number of fixed-interface modes.
        frame: "tangent" at the held port, or "mean".
        highest: shapes above this frequency (rad/s) are left out.

    Raises SceneError for more modes than there are, a body that moves without strain, and if no
    shape is left.
    """
    sections = Sections(model, tuple(ports))
    loaded = [port for port in ports if port.loaded]
    clamped = sections.clamped(loaded)
    others = [port for port in loaded if port is not held]
    parts = [clamped.constraint_shapes(port) for port in others]
    parts.append(clamped.full(fixed_interface_modes(clamped, modes)))
    shapes = sections.expand @ np.hstack(parts)
    if not shapes.shape[1]:
        raise model.refuse(
            "modes = 0 leaves no shape, for only one end carries loads; write modes = 1 or more, "
            "or describe it as a [[body]]"
        )
    if frame == "mean":
        shapes = without_momentum(model, shapes)
    shapes, frequencies = orthogonalised(model, shapes)
    kept = frequencies <= (np.inf if highest is None else highest)
    if not kept.any():
        raise model.refuse(
            f"highest_frequency: expected at least the lowest frequency, {frequencies[0]:.6g} "
            f"rad/s, found {highest:.6g}; raise it, or describe the body as a rigid [[body]]"
        )
    return Reduction(
        sections, held, frame, shapes[:, kept], frequencies[kept], 6 * len(others), modes,
        frequencies[~kept],
    )  # fmt: skip


def fixed_interface_modes(clamped: Clamped, modes: int) -> Array:
    """(free, modes): the lowest modes with the sections of all loaded ports held."""
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
    squares, found = _dense(clamped, mass, modes) if dense else _sparse(clamped, mass, modes)
    usable = int(np.count_nonzero(np.isfinite(squares) & (squares > 0)))
    if usable < modes:
        raise model.refuse(
            f"modes: expected at most {usable}, as many as there are modes with mass between the "
            f"ends, found {modes}; take fewer modes"
        )
    return found


def _dense(clamped: Clamped, mass: object, modes: int) -> tuple[Array, Array]:
    from scipy import linalg

    stiffness = clamped.sections.stiffness.tocsc()[clamped.free][:, clamped.free].toarray()
    rows = clamped.rows
    basis = np.eye(len(stiffness)) if rows is None else linalg.null_space(rows.toarray())
    m, k = basis.T @ mass.toarray() @ basis, basis.T @ stiffness @ basis  # type: ignore[attr-defined]
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


def _sparse(clamped: Clamped, mass: object, modes: int) -> tuple[Array, Array]:
    from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh

    size, solve = len(clamped.free), clamped.inverse
    stiffness = clamped.sections.stiffness.tocsc()[clamped.free][:, clamped.free]

    def inverse(load: Array) -> Array:
        return solve(load.reshape(size, 1), None).reshape(size)

    operator = LinearOperator((size, size), matvec=inverse, dtype=np.float64)
    start = inverse(np.cos(np.arange(size)))  # one start for all runs, so that runs agree
    try:
        squares, found = eigsh(
            stiffness, k=modes, M=mass, sigma=0.0, OPinv=operator, v0=start, which="LM"
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


def orthogonalised(model: ElasticModel, shapes: Array) -> tuple[Array, Array]:
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
