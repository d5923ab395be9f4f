"""Deformation and buckling of beams in directions for which they have no shape functions.

A beam is rigid in directions without shape functions. Its section loads give the deformation that
it would have there: bending int |M| / EI dx, twist int |T| / GI_t dx, and stretch int |N| / EA dx.
These angles do not depend on the floating frame.

A beam buckles laterally where the work of the loads exceeds its strain energy. With phi the slope
of a transverse deflection, compression N does the work int N phi^2 against int EI phi'^2. With phi
the twist of the sections, moments M in the stiff plane bend the beam transversely by M phi / EI,
which is work of int M^2 phi^2 / EI against int GI_t phi'^2 (Timoshenko and Gere, Theory of Elastic
Stability, 2nd ed., sections 2.8 and 6.3). Both are the same eigenvalue problem, with phi = 0 at the
inboard section.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mstmm.array_validation import Array

from ...flexible.beam.gauss_quadrature import gauss_points
from ...flexible.beam.section_ports import BeamShapes
from ...flexible.beam.static_shapes import direction_stiffness
from ...flexible.modal_body import ModalBody
from .range_estimators import has_bending_shapes

#: Limits of negligible deformations: rad, for axial a strain.
_NEGLIGIBLE = {"y": 2e-3, "z": 2e-3, "twist": 2e-3, "axial": 1e-3}
#: Share of the slope of the shape functions below which a deformation is negligible.
_NEGLIGIBLE_SHARE = 0.05


@dataclass(frozen=True)
class UnshapedDeformation:
    """Deformation (rad, axial a strain) that loads would cause in a direction without shapes."""

    direction: str
    size: float

    @property
    def limit(self) -> float:
        """Smallest significant size."""
        return _NEGLIGIBLE[self.direction]

    @property
    def unit(self) -> str:
        """Unit of the size: 1 for a strain."""
        return "1" if self.direction == "axial" else "rad"

    def __str__(self) -> str:
        if self.direction == "axial":
            return f"stretch it by {self.size:.2g} of its length"
        verb = "twist it" if self.direction == "twist" else f"bend it along {self.direction}"
        return f"{verb} by {self.size:.2g} rad"


def unshaped_deformation(
    body: ModalBody, x: Array, weights: Array, force: Array, moment: Array, slope: float
) -> UnshapedDeformation | None:
    """Largest significant deformation, relative to its limit; None if there is none.

    `force` and `moment` (n, m, 3) in N and N*m are the section loads at the points x (m,) of a
    quadrature rule with `weights` (m), and `slope` is the largest slope of the shape functions.
    """
    deformations = (
        UnshapedDeformation(direction, float(np.max(np.abs(load) @ (weights / stiffness))))
        for direction, stiffness, load in _unshaped_loads(body, x, force, moment)
    )
    significant = [
        x for x in deformations
        if np.isfinite(x.size) and x.size > max(x.limit, _NEGLIGIBLE_SHARE * slope)
    ]  # fmt: skip
    return max(significant, key=lambda x: x.size / x.limit, default=None)


def unshaped_directions(body: ModalBody) -> list[str]:
    """Directions of known stiffness without shape functions: of y, z, twist, axial."""
    if body.shapes is None:
        return []
    shaped = {mode.direction for mode in body.shapes.modes}
    return [
        direction
        for direction in _NEGLIGIBLE
        if direction not in shaped and direction_stiffness(body.shapes.data, direction).min() > 0
    ]


def _unshaped_loads(
    body: ModalBody, x: Array, force: Array, moment: Array
) -> Iterator[tuple[str, Array, Array]]:
    """Direction, stiffness (m,) and section load (n, m) of each direction without shapes."""
    assert body.shapes is not None
    sections, length = body.shapes.sections(x), body.shapes.length
    loads = {
        "y": (sections.EI_z, moment[..., 2]),
        "z": (sections.EI_y, moment[..., 1]),
        "twist": (sections.GI_t, moment[..., 0]),
        "axial": (sections.EA * length, force[..., 0]),
    }
    for direction in unshaped_directions(body):
        yield direction, *loads[direction]


#: Quarter waves of phi on either side of the inboard section.
_QUARTER_WAVES = 6
#: Shorter parts, relative to the length of the beam, do not buckle.
_MIN_LENGTH_RATIO = 0.01


def quadrature_rule(shapes: BeamShapes, held: float) -> tuple[Array, Array]:
    """Points and weights (m) along a beam fixed at x = `held`, for its shapes and phi."""
    waves = _QUARTER_WAVES / 2 / min(map(abs, _distances_to_ends(shapes.length, held)))
    return gauss_points(
        np.union1d(shapes.pieces, [held]), lambda a, b: max(shapes.density(a, b), waves)
    )


def _distances_to_ends(length: float, held: float) -> list[float]:
    """Signed distances (m along x) from the inboard section to either end, without stubs."""
    return [reach for reach in (-held, length - held) if abs(reach) > _MIN_LENGTH_RATIO * length]


def lateral_load_ratio(
    body: ModalBody, x: Array, weights: Array, held: float, line: float, force: Array, moment: Array
) -> float | None:
    """Largest ratio of load to buckling load in directions without shape functions.

    `force` and `moment` (n, m, 3) in N and N*m are section loads in section axes at the points x
    (m,) in m of a `quadrature_rule`. The beam is fixed at x = `held` (m) only; `line` (m) is the
    length of the straight line of beams that contains it. None for a beam with all shape functions.
    """
    if body.shapes is None:
        return None
    length, has_twist = body.shapes.length, "twist1" in body.modes
    sections, length_ratio = body.shapes.sections(x), max(line / length, 1.0)
    from_held = x - held
    sides = [
        (from_held * distance > 0, abs(distance)) for distance in _distances_to_ends(length, held)
    ]

    def largest(load: Array, stiffness: Array) -> float:
        return max(
            _max_work_ratio(
                load[:, side], stiffness[side], np.abs(from_held[side]), weights[side], distance
            )
            for side, distance in sides
        )

    ratios = []
    for plane, compliant, stiff, component in (
        ("z", sections.EI_y, sections.EI_z, 2), ("y", sections.EI_z, sections.EI_y, 1),
    ):  # fmt: skip
        if np.min(compliant) <= 0 or (has_bending_shapes(body, plane) and has_twist):
            continue
        if not has_bending_shapes(body, plane):
            ratios.append(length_ratio**2 * largest(-force[..., 0], compliant))
        if np.min(sections.GI_t) > 0:
            share = np.maximum(1 - compliant / stiff, 0.0)  # 0 at equal stiffness: no buckling
            square = share * moment[..., component] ** 2 / compliant
            ratios.append(length_ratio * np.sqrt(largest(square, sections.GI_t)))
    return max(ratios, default=None)


def _max_work_ratio(
    load: Array, stiffness: Array, x: Array, weights: Array, length: float
) -> float:
    """Largest int load phi^2 / int stiffness phi'^2 over all samples of `load` (n, m).

    At least 0; phi = 0 at x = 0, and free at x = length.
    """
    wave_numbers = (np.arange(_QUARTER_WAVES) + 0.5) * np.pi / length
    phi, rate = (
        np.sin(np.outer(wave_numbers, x)),
        wave_numbers[:, None] * np.cos(np.outer(wave_numbers, x)),
    )
    rate *= np.sqrt(stiffness * weights)
    phi = np.linalg.solve(np.linalg.cholesky(rate @ rate.T), phi)
    work = np.einsum("im,nm,jm->nij", phi, load * weights, phi, optimize=True)
    if not np.isfinite(work).all():
        return 0.0
    return float(np.max(np.linalg.eigvalsh(work), initial=0.0))
