"""Chain of segments from the supported section of an exact beam to its stations and ends.

Strains determine the pose of the end of each segment; see derive/flexible/segment.py.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from mstmm.array_validation import Array
from mstmm.ir.element_spec import builtin_kernel

from ...kernels.numpy_kernels import evaluate
from .gauss_quadrature import gauss_rule
from .strain_shapes import StrainShapes

#: Strains of a straight beam at rest.
_STRAIGHT = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
#: Gauss points of a segment as shares of its length.
_GAUSS = 0.5 + np.sqrt(15.0) / 10.0 * np.array([-1.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class SegmentChain:
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
        """Section (m) at the end of each segment, and the previous link, -1 at the start.

        Stations come first, from the start outwards, then the ends.
        """
        links: list[tuple[float, int]] = []
        for section in sorted(self.x.tolist(), key=lambda x: abs(x - self.start)):
            links.append((section, self._previous_link(section, links)))
        ends = [(x, self._previous_link(x, links)) for x in self.ends.tolist()]
        return (*links, *ends)

    def _previous_link(self, x: float, links: list[tuple[float, int]]) -> int:
        """Last link on the way from the start to x; -1 without any."""
        offset = x - self.start
        if not offset:
            return -1
        between = (k for k, (y, _) in enumerate(links) if 0 <= (y - self.start) / offset < 1)
        return max(between, default=-1)

    @cached_property
    def rest(self) -> Array:
        """B1, B2, B3 (m, 18) of each segment at eta = 0."""
        return self._combinations(np.tile(_STRAIGHT, (3 * len(self.links), 1)))

    @cached_property
    def slopes(self) -> Array:
        """Derivatives of B1, B2, B3 (m, 18, n) by the strain coordinates."""
        return self._combinations(self.shapes.values_at(self._samples))

    @property
    def _bounds(self) -> Array:
        """Begin and end (2, m) of each segment, m."""
        ends = np.array([section for section, _ in self.links])
        begins = [self.start if previous < 0 else ends[previous] for _, previous in self.links]
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

    def segments(self, eta: Array) -> dict[str, Array]:
        """Outputs (N, m, ...) of the kernel "segment" for all segments, at rest at eta (N, n)."""
        n = self.shapes.n
        inputs = {
            "b": self.rest, "Bm": self.slopes, "eta": eta[:, None], "etad": np.zeros(n),
        }  # fmt: skip
        return evaluate(builtin_kernel("sweep_modal", "segment"), inputs, n)

    def poses(self, omega: Array) -> tuple[Array, Array]:
        """Rotations (N, m, 3, 3) and positions (N, m, 3) of the sections from Omega (N, m, 6)."""
        return self._compose(_segment_motion(omega))

    def _compose(self, motion: dict[str, Array]) -> tuple[Array, Array]:
        rotations, positions = motion["R"].copy(), motion["d"].copy()
        for k, (_, previous) in enumerate(self.links):
            if previous >= 0:
                positions[:, k] = positions[:, previous] + np.einsum(
                    "tij,tj->ti", rotations[:, previous], positions[:, k]
                )
                rotations[:, k] = rotations[:, previous] @ rotations[:, k]
        return rotations, positions

    @cached_property
    def at_rest(self) -> tuple[Array, Array, Array]:
        """Poses and first-order motion of the sections at rest.

        Rotation (m, 3, 3) and position (m, 3) in the axes of the supported section, and the twist
        per strain coordinate (m, 6, n), rows v then w in the axes of each section.
        """
        segments = self.segments(np.zeros((1, self.shapes.n)))
        motion = _segment_motion(segments["Om"])
        rotations, positions = self._compose(motion)
        twists = (motion["H6"] @ segments["Phi"])[0]
        for k, (_, previous) in enumerate(self.links):
            if previous >= 0:
                twists[k] += twist_at(motion["R"][0, k], motion["d"][0, k], twists[previous])
        return rotations[0], positions[0], twists


def twist_at(rotation: Array, position: Array, twist: Array) -> Array:
    """Twist (6, n), rows v then w, of a point fixed at a pose in the frame that has `twist`."""
    v, w = twist[:3], twist[3:]
    return np.concatenate([rotation.T @ (v + np.cross(w, position, axis=0)), rotation.T @ w])


def _segment_motion(omega: Array) -> dict[str, Array]:
    """Outputs (N, m, ...) of the kernel "segment_motion" at rest, from Omega (N, m, 6)."""
    still = np.zeros_like(omega)
    inputs = {"R_end": np.eye(3), "Om": omega, "Omd": still, "Omdd": still}
    return evaluate(builtin_kernel("sweep_modal", "segment_motion"), inputs)


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
