"""Strain shapes of an exact beam, and the chain of segments along which they act.

The strains of a section are xi = xi_0 + B(x) eta, rows stretch, shear y, shear z, twist rate,
curvature y, curvature z in the axes of the section; see derive/flexible/segment.py.  Each column of
B is in one row: a combination of Legendre polynomials of x over the beam's length, divided by the
stiffness relative to its harmonic mean.  The polynomials so are moments and forces, which are
continuous where the section changes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.polynomial import legendre

from mstmm.array_validation import Array
from mstmm.ir.element_spec import builtin_kernel

from ...kernels.numpy_kernels import evaluate
from .beam_data import BeamData
from .gauss_quadrature import gauss_rule
from .static_shapes import direction_stiffness

#: Direction of a beam's shapes -> row of its strain and its sign: bending along y turns sections
#: about z, bending along z about -y.
STRAIN_ROWS = {"y": (5, 1.0), "z": (4, -1.0), "twist": (3, 1.0), "axial": (0, 1.0)}
#: Strains of a straight beam at rest.
STRAIGHT = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
#: Gauss points of a segment as shares of its length.
_GAUSS = 0.5 + np.sqrt(15.0) / 10.0 * np.array([-1.0, 0.0, 1.0])


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

    def at(self, x: Array) -> Array:
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


@dataclass(frozen=True)
class Chain:
    """Sections of a beam, reached by segments from the supported section at `start` (m).

    Stations x (m,) beyond `start` on either side follow each other outwards; each of the `ends`
    (m,) is reached from the last station before it.  Arrays are in the order of `links`.
    """

    shapes: StrainShapes
    start: float
    x: Array
    ends: Array

    @cached_property
    def links(self) -> tuple[tuple[float, int], ...]:
        """Section (m) at the end of each segment, and the link before it, -1 at the start.

        Stations come first, from the start outwards, then the ends.
        """
        links: list[tuple[float, int]] = []
        for section in sorted(self.x.tolist(), key=lambda x: abs(x - self.start)):
            links.append((section, self._last_before(section, links)))
        ends = [(x, self._last_before(x, links)) for x in self.ends.tolist()]
        return (*links, *ends)

    def _last_before(self, x: float, links: list[tuple[float, int]]) -> int:
        """Last link on the way from the start to x."""
        offset = x - self.start
        if not offset:
            return -1
        between = (k for k, (y, _) in enumerate(links) if 0 <= (y - self.start) / offset < 1)
        return max(between, default=-1)

    @cached_property
    def rest(self) -> Array:
        """B1, B2, B3 (m, 18) of each segment at eta = 0."""
        return self._combinations(np.tile(STRAIGHT, (3 * len(self.links), 1)))

    @cached_property
    def slopes(self) -> Array:
        """Derivatives of B1, B2, B3 (m, 18, n) by the strain coordinates."""
        return self._combinations(self.shapes.at(self._samples))

    @property
    def _bounds(self) -> Array:
        """Begin and end (2, m) of each segment, m."""
        ends = np.array([section for section, _ in self.links])
        begins = [self.start if before < 0 else ends[before] for _, before in self.links]
        return np.array([begins, ends])

    @property
    def _samples(self) -> Array:
        """Sections (3 m,) of the Gauss points of all segments."""
        begin, end = self._bounds
        return np.asarray((begin[:, None] + np.outer(end - begin, _GAUSS)).ravel())

    def _combinations(self, strains: Array) -> Array:
        """B1, B2, B3 (m, 18, ...) from strains (3 m, 6, ...) at the samples."""
        begin, end = self._bounds
        first, middle, last = np.moveaxis(strains.reshape(-1, 3, *strains.shape[1:]), 1, 0)
        h = (end - begin).reshape(-1, *[1] * (strains.ndim - 1))
        return np.concatenate(
            [h * middle, np.sqrt(15) / 3 * h * (last - first),
             10 / 3 * h * (last - 2 * middle + first)], axis=1,
        )  # fmt: skip

    @cached_property
    def at_rest(self) -> tuple[Array, Array, Array]:
        """Poses and first-order motion of the sections at rest.

        Rotation (m, 3, 3) and position (m, 3) in the axes of the supported section, and the twist
        per strain coordinate (m, 6, n), rows v then w in the axes of each section.
        """
        n, zeros = self.shapes.n, np.zeros(self.shapes.n)
        inputs = {"b": self.rest, "Bm": self.slopes, "eta": zeros, "etad": zeros}
        found = evaluate(builtin_kernel("sweep_modal", "segment"), inputs, n)
        motion = evaluate(
            builtin_kernel("sweep_modal", "segment_motion"),
            {"R_end": np.eye(3), **{name: found[name] for name in ("Om", "Omd", "Omdd")}},
        )
        own = motion["H6"] @ found["Phi"]
        rotations, positions, twists = [], [], []
        for k, (_, before) in enumerate(self.links):
            r, d = motion["R"][k], motion["d"][k]
            if before < 0:
                rotations.append(r)
                positions.append(d)
                twists.append(own[k])
                continue
            rotations.append(rotations[before] @ r)
            positions.append(positions[before] + rotations[before] @ d)
            v, w = twists[before][:3], twists[before][3:]
            carried = np.concatenate([r.T @ (v + np.cross(w, d, axis=0)), r.T @ w])
            twists.append(carried + own[k])
        return np.array(rotations), np.array(positions), np.array(twists)


def gauss_sections(bounds: Sequence[float], count: int) -> tuple[Array, Array]:
    """Gauss points (m) and weights (m) of about `count` sections, by piece between `bounds`."""

    def piece(begin: float, end: float) -> Iterator[Array]:
        share = (end - begin) / (bounds[-1] - bounds[0])
        points, weights = gauss_rule(max(2, int(np.ceil(count * share))))
        yield begin + (end - begin) * points
        yield (end - begin) * weights

    pieces = [tuple(piece(*pair)) for pair in pairwise(bounds)]
    points, weights = zip(*pieces, strict=True)
    return np.concatenate(points), np.concatenate(weights)
