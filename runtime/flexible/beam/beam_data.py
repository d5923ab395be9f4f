"""Numerical data of a beam: sections, stiffnesses and ends, from its scene table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array

if TYPE_CHECKING:
    from mstmm.scene.tables.beam import Beam


@dataclass(frozen=True)
class BeamSections:
    """Section data at points along a beam, each (m,); zero where the scene gives none."""

    mass_per_length: Array  #: kg/m
    EA: Array  #: N
    GI_t: Array  #: N m^2
    EI_y: Array  #: about y, for deflection along z, N m^2
    EI_z: Array  #: about z, for deflection along y, N m^2
    rho_I: Array  #: (3, m) polar, about y, about z; kg m
    drag: Array  #: viscous drag per length, N s/m^2


@dataclass(frozen=True)
class BeamData:
    """A straight beam along x with constant sections between `breaks` (m).

    `inertia` (3, pieces): mass per length, int rho y^2 dA, int rho z^2 dA; `stiffness`
    (6, pieces): EA, GI_t, EI_y, EI_z, k GA along y and z (0 without shear).  `rotary`: whether
    bending turns the sections' inertia.
    """

    name: str
    breaks: tuple[float, ...]
    inertia: Array
    stiffness: Array
    rotary: bool
    drag: float
    ends: Mapping[str, tuple[float, Array]]  #: x (m) and rotation, axes of the end -> beam axes

    @property
    def length(self) -> float:
        return self.breaks[-1]

    @property
    def uniform(self) -> bool:
        """Whether all sections are equal."""
        return len(self.breaks) == 2

    @property
    def has_shear(self) -> bool:
        """Whether the sections have a shear stiffness."""
        return bool(self.stiffness[4:].any())

    @property
    def mass(self) -> float:
        """Mass, kg."""
        return float(self.inertia[0] @ np.diff(self.breaks))

    def piece(self, x: Array) -> NDArray[np.intp]:
        """Index of the piece at every x (m); at a break that of the piece after it."""
        indices = np.searchsorted(np.asarray(self.breaks), x, side="right") - 1
        return np.clip(indices, 0, len(self.breaks) - 2)

    def sections(self, x: Array) -> BeamSections:
        """Section data at every x (m)."""
        pieces = self.piece(x)
        m, yy, zz = self.inertia[:, pieces]
        ea, git, eiy, eiz = self.stiffness[:4, pieces]
        return BeamSections(
            m, ea, git, eiy, eiz, np.array([yy + zz, zz, yy]), np.full(m.shape, self.drag)
        )


#: Stiffness in the two planes of a beam without.
_NO_STIFFNESS = (0.0, 0.0)


def beam_data(beam: Beam) -> BeamData:
    """Numerical data of a [[beam]] table."""
    pieces = beam.sections
    inertia, stiffness = [], []
    for section in pieces:
        polar = section.polar_inertia_per_length or 0.0
        about_y, about_z = section.rotary_inertia or (polar / 2, polar / 2)
        inertia.append((section.mass_per_length or 0.0, about_z, about_y))
        bending, shear = (
            section.bending_stiffness or _NO_STIFFNESS,
            section.shear_stiffness or _NO_STIFFNESS,
        )
        stiffness.append(
            (section.axial_stiffness or 0.0, section.torsional_stiffness or 0.0, *bending, *shear)
        )
    breaks = (*(float(section.from_) for section in pieces), float(beam.length))
    ends = {
        name: (_snap_to_break(end.position[0], breaks), np.array(end.rotation, dtype=float))
        for name, end in beam.ends.items()
    }
    return BeamData(
        beam.name,
        breaks,
        np.array(inertia, dtype=float).T,
        np.array(stiffness, dtype=float).T,
        all(section.rotary_inertia is not None for section in pieces),
        float(beam.viscous_drag),
        ends,
    )


def _snap_to_break(x: float, breaks: tuple[float, ...]) -> float:
    """Position of an end, moved to a break that differs only by rounding."""
    nearest = min(breaks, key=lambda place: abs(place - x))
    return nearest if abs(nearest - x) <= 1e-9 * breaks[-1] else float(min(max(x, 0.0), breaks[-1]))


@dataclass(frozen=True)
class Frame:
    """Location of the floating frame in one direction: "tangent" at `x` (m), "chord" or "mean"."""

    kind: str
    x: float = 0.0

    @property
    def origin(self) -> float | None:
        """Section (m) without axial displacement and twist; None for the mean frame."""
        return {"tangent": self.x, "chord": 0.0, "mean": None}[self.kind]
