"""Strain shapes of an exact beam.

The strains of a section are xi = xi_0 + B(x) eta, rows stretch, shear y, shear z, twist rate,
curvature y, curvature z in the axes of the section; see derive/flexible/segment.py.  Each column of
B is in one row: a combination of Legendre polynomials of x over the beam's length, divided by the
stiffness relative to its harmonic mean.  The polynomials so are moments and forces, which are
continuous where the section changes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre

from mstmm.array_validation import Array

from .beam_data import BeamData
from .static_shapes import direction_stiffness

#: Direction of a beam's shapes -> row of its strain and its sign: bending along y turns sections
#: about z, bending along z about -y.
STRAIN_ROWS = {"y": (5, 1.0), "z": (4, -1.0), "twist": (3, 1.0), "axial": (0, 1.0)}


@dataclass(frozen=True)
class StrainShapes:
    """Strain shapes by direction: columns of coefficients of P_0, P_1, ... over a beam.

    A coefficient of 1 is the strain P_j(2 x / L - 1) / L times the relative flexibility, whose mean
    is 1, so that coordinates of curvature and twist are angles (rad), of stretch lengths (m).
    """

    data: BeamData
    coefficients: dict[str, Array]

    @property
    def n(self) -> int:
        """Number of strain coordinates."""
        return sum(columns.shape[1] for columns in self.coefficients.values())

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the strain coordinates: "y1", "y2", ..., "twist1"."""
        return tuple(
            f"{direction}{k + 1}"
            for direction, columns in self.coefficients.items()
            for k in range(columns.shape[1])
        )

    def values_at(self, x: Array) -> Array:
        """B (m, 6, n) at the sections x (m,)."""
        strains = np.zeros((len(x), 6, self.n))
        first = 0
        for direction, columns in self.coefficients.items():
            row, sign = STRAIN_ROWS[direction]
            values = legendre.legval(2 * x / self.data.length - 1, columns) / self.data.length
            values *= self._flexibility(direction, x)
            strains[:, row, first : first + columns.shape[1]] = sign * values.T
            first += columns.shape[1]
        return strains

    def _flexibility(self, direction: str, x: Array) -> Array:
        """Flexibility (m,) at the sections x (m,), relative to its mean over the beam."""
        pieces = 1.0 / direction_stiffness(self.data, direction)
        mean = pieces @ np.diff(self.data.breaks) / self.data.length
        return np.asarray((pieces / mean)[self.data.piece(x)])


def legendre_shapes(data: BeamData, counts: dict[str, int]) -> StrainShapes:
    """Legendre polynomials up to degree count - 1 in each direction with shapes."""
    return StrainShapes(
        data, {direction: np.eye(count) for direction, count in counts.items() if count}
    )
