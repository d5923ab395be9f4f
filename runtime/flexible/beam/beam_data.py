"""A beam as numbers: sections, stiffnesses, ends; from the table of a scene."""

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
    """A straight beam along x, its sections constant between `breaks`.

    `inertia` (3, pieces): mass per length, int rho y^2 dA, int rho z^2 dA; `stiffness`
    (4, pieces): EA, GI_t, EI_y, EI_z.  `rotary`: whether bending turns the sections' inertia.
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
        """True when every section is the same."""
        return len(self.breaks) == 2

    @property
    def mass(self) -> float:
        """kg."""
        return float(self.inertia[0] @ np.diff(self.breaks))

    def piece(self, x: Array) -> NDArray[np.intp]:
        """Which piece every x lies in; at a break the one behind it."""
        found = np.searchsorted(np.asarray(self.breaks), x, side="right") - 1
        return np.clip(found, 0, len(self.breaks) - 2)

    def sections(self, x: Array) -> BeamSections:
        """Section data at every x."""
        at = self.piece(x)
        m, yy, zz = self.inertia[:, at]
        ea, git, eiy, eiz = self.stiffness[:, at]
        return BeamSections(
            m, ea, git, eiy, eiz, np.array([yy + zz, zz, yy]), np.full(m.shape, self.drag)
        )


def beam_data(beam: Beam) -> BeamData:
    """The numbers of a [[beam]] table."""
    pieces = beam.sections
    inertia, stiffness = [], []
    for s in pieces:
        polar = s.polar_inertia_per_length or 0.0
        about_y, about_z = s.rotary_inertia or (polar / 2, polar / 2)
        inertia.append((s.mass_per_length or 0.0, about_z, about_y))
        bending = s.bending_stiffness or (0.0, 0.0)
        stiffness.append((s.axial_stiffness or 0.0, s.torsional_stiffness or 0.0, *bending))
    breaks = (*(float(s.from_) for s in pieces), float(beam.length))
    ends = {
        name: (_snapped(end.position[0], breaks), np.array(end.rotation, dtype=float))
        for name, end in beam.ends.items()
    }
    return BeamData(
        beam.name,
        breaks,
        np.array(inertia, dtype=float).T,
        np.array(stiffness, dtype=float).T,
        all(s.rotary_inertia is not None for s in pieces),
        float(beam.viscous_drag),
        ends,
    )


def _snapped(x: float, breaks: tuple[float, ...]) -> float:
    """The break that an end lies at but for rounding, or its own place on the beam."""
    near = min(breaks, key=lambda b: abs(b - x))
    return near if abs(near - x) <= 1e-9 * breaks[-1] else float(min(max(x, 0.0), breaks[-1]))
