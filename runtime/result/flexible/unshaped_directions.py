"""Deformation of beams in directions for which they have no shape functions.

A beam is rigid in directions without shape functions. Its section loads give the deformation that
it would have there: bending int |M| / EI dx, twist int |T| / GI_t dx, and stretch int |N| / EA dx.
These angles do not depend on the floating frame.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mstmm.array_validation import Array

from ...flexible.beam.static_shapes import direction_stiffness
from ...flexible.modal_body import ModalBody

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
        deformation
        for deformation in deformations
        if np.isfinite(deformation.size)
        and deformation.size > deformation.limit
        and deformation.size > _NEGLIGIBLE_SHARE * slope
    ]
    return max(
        significant, key=lambda deformation: deformation.size / deformation.limit, default=None
    )


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
