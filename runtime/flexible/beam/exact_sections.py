"""Sections along an exact beam for any number of states: poses and strains."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from mstmm.array_validation import Array

from ..modal_parts import chunk_slices
from .beam_data import BeamData, BeamSections
from .segment_chain import SegmentChain
from .strain_shapes import StrainShapes

#: Numbers that the kernels of a segment keep for each state and strain coordinate.
_NUMBERS_PER_MODE = 200


@dataclass(frozen=True, eq=False)
class ExactSections:
    """Strain shapes and stations of an exact beam, for its sections in any state.

    Attributes:
        data: stiffness and mass along the beam.
        chain: its stations and ends.
    """

    data: BeamData
    chain: SegmentChain

    @property
    def length(self) -> float:
        """Length of the beam, m."""
        return self.data.length

    @property
    def shapes(self) -> StrainShapes:
        """Strain shapes."""
        return self.chain.shapes

    def sections(self, x: Array) -> BeamSections:
        """Section data at every x (m)."""
        return self.data.sections(x)

    def strains(self, eta: Array, x: Array) -> Array:
        """Strains (n, m, 6) beyond those at rest for states eta (n, modes) at sections x (m,)."""
        return np.einsum("mik,tk->tmi", self.shapes.values_at(x), eta)

    def poses(self, eta: Array, x: Array) -> tuple[Array, Array]:
        """Rotations (n, m, 3, 3) and positions (n, m, 3) of sections in the supported section."""
        chain, first = _chain_to(self.chain, x.tobytes()), len(self.chain.x)
        size = len(chain.links) * self.shapes.n * _NUMBERS_PER_MODE
        parts = [
            chain.poses(chain.segments(eta[rows])["Om"]) for rows in chunk_slices(len(eta), size)
        ]
        rotations, positions = (np.concatenate(values) for values in zip(*parts, strict=True))
        return rotations[:, first:], positions[:, first:]

    def segment_rotations(self, eta: Array) -> Array:
        """Rotation (n, segments) in rad along each segment between stations and to the ends."""
        return np.asarray(np.linalg.norm(self.chain.segments(eta)["Om"][..., 3:], axis=-1))

    def magnus_difference(self, eta: Array) -> Array:
        """Distance (n,) in m of the farthest sections with Magnus steps of order 6 and 4."""
        sixth = self.chain.poses(self.chain.segments(eta)["Om"])[1]
        fourth = self.chain.poses(_fourth_order(self.chain, eta))[1]
        return np.asarray(np.linalg.norm(sixth - fourth, axis=-1).max(axis=-1))


@lru_cache(maxsize=64)
def _chain_to(chain: SegmentChain, x: bytes) -> SegmentChain:
    """Chain with the sections x (m) as its ends, computed once for each body and x."""
    return SegmentChain(chain.shapes, chain.start, chain.x, np.frombuffer(x))


def _fourth_order(chain: SegmentChain, eta: Array) -> Array:
    """Omega (n, links, 6) by the Magnus series of fourth order: B1 + B3 / 12 + [B1, B2] / 12."""
    b = chain.rest + np.einsum("mik,nk->nmi", chain.slopes, eta)
    (v1, w1), (v2, w2) = ((b[..., k : k + 3], b[..., k + 3 : k + 6]) for k in (0, 6))
    bracket = np.concatenate([np.cross(w1, v2) + np.cross(v1, w2), np.cross(w1, w2)], axis=-1)
    return np.asarray(b[..., :6] + (b[..., 12:] + bracket) / 12)
