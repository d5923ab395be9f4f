"""Sections along an exact beam for any number of states: poses and strains."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from mstmm.array_validation import Array
from mstmm.ir.element_spec import builtin_kernel

from ...kernels.numpy_kernels import evaluate
from ..modal_parts import chunk_slices
from .beam_data import BeamData, BeamSections
from .strain_shapes import STRAIN_ROWS, Chain, StrainShapes

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
    chain: Chain

    @property
    def length(self) -> float:
        """Length of the beam, m."""
        return self.data.length

    @property
    def pieces(self) -> tuple[float, ...]:
        """Bounds of the pieces with constant sections, m."""
        return self.data.breaks

    @property
    def shapes(self) -> StrainShapes:
        """Strain shapes."""
        return self.chain.shapes

    def sections(self, x: Array) -> BeamSections:
        """Section data at every x (m)."""
        return self.data.sections(x)

    def stiffness(self, x: Array) -> Array:
        """Stiffness (m, 6) of the strains at x; zero where the beam is rigid."""
        section, diagonal = self.data.sections(x), np.zeros((len(x), 6))
        values = {"y": section.EI_z, "z": section.EI_y, "twist": section.GI_t, "axial": section.EA}
        for direction in self.shapes.coefficients:
            diagonal[:, STRAIN_ROWS[direction][0]] = values[direction]
        return diagonal

    def strains(self, eta: Array, x: Array) -> Array:
        """Strains (n, m, 6) beyond those at rest for states eta (n, modes) at sections x (m,)."""
        return np.einsum("mik,tk->tmi", self.shapes.at(x), eta)

    def poses(self, eta: Array, x: Array) -> tuple[Array, Array]:
        """Rotations (n, m, 3, 3) and positions (n, m, 3) of sections in the supported section."""
        chain, first = self._chain_to(x.tobytes()), len(self.chain.x)
        size = len(chain.links) * self.shapes.n * _NUMBERS_PER_MODE
        parts = [_poses(chain, _segments(chain, eta[rows])["Om"])
                 for rows in chunk_slices(len(eta), size)]  # fmt: skip
        rotations, positions = (np.concatenate(values) for values in zip(*parts, strict=True))
        return rotations[:, first:], positions[:, first:]

    def segment_turns(self, eta: Array) -> Array:
        """Rotation (n, segments) in rad along each segment between stations and to the ends."""
        return np.asarray(np.linalg.norm(_segments(self.chain, eta)["Om"][..., 3:], axis=-1))

    def magnus_difference(self, eta: Array) -> Array:
        """Distance (n,) in m of the farthest sections with Magnus steps of order 6 and 4."""
        sixth = _poses(self.chain, _segments(self.chain, eta)["Om"])[1]
        fourth = _poses(self.chain, _fourth_order(self.chain, eta))[1]
        return np.asarray(np.linalg.norm(sixth - fourth, axis=-1).max(axis=-1))

    @lru_cache(maxsize=8)  # noqa: B019 (bodies are kept by their models)
    def _chain_to(self, x: bytes) -> Chain:
        return Chain(self.chain.shapes, self.chain.start, self.chain.x, np.frombuffer(x))


def _segments(chain: Chain, eta: Array) -> dict[str, Array]:
    """Outputs of the kernel `segment` (n, links, ...) at rest, for all segments of a chain."""
    n = chain.shapes.n
    inputs = {
        "b": chain.rest, "Bm": chain.slopes, "eta": eta[:, None], "etad": np.zeros(n),
    }  # fmt: skip
    return evaluate(builtin_kernel("sweep_modal", "segment"), inputs, n)


def _poses(chain: Chain, omega: Array) -> tuple[Array, Array]:
    """Rotations (n, links, 3, 3) and positions (n, links, 3) from Omega (n, links, 6)."""
    still = np.zeros_like(omega)
    inputs = {"R_end": np.eye(3), "Om": omega, "Omd": still, "Omdd": still}
    motion = evaluate(builtin_kernel("sweep_modal", "segment_motion"), inputs)
    rotations, positions = motion["R"].copy(), motion["d"].copy()
    for k, (_, before) in enumerate(chain.links):
        if before >= 0:
            positions[:, k] = positions[:, before] + np.einsum(
                "tij,tj->ti", rotations[:, before], positions[:, k]
            )
            rotations[:, k] = rotations[:, before] @ rotations[:, k]
    return rotations, positions


def _fourth_order(chain: Chain, eta: Array) -> Array:
    """Omega (n, links, 6) by the Magnus series of fourth order: B1 + B3 / 12 + [B1, B2] / 12."""
    b = chain.rest + np.einsum("mik,nk->nmi", chain.slopes, eta)
    (v1, w1), (v2, w2) = ((b[..., k : k + 3], b[..., k + 3 : k + 6]) for k in (0, 6))
    bracket = np.concatenate([np.cross(w1, v2) + np.cross(v1, w2), np.cross(w1, w2)], axis=-1)
    return np.asarray(b[..., :6] + (b[..., 12:] + bracket) / 12)
