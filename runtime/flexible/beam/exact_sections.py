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
        parts = [_poses(chain, eta[rows]) for rows in chunk_slices(len(eta), size)]
        rotations, positions = (np.concatenate(values) for values in zip(*parts, strict=True))
        return rotations[:, first:], positions[:, first:]

    @lru_cache(maxsize=8)  # noqa: B019 (bodies are kept by their models)
    def _chain_to(self, x: bytes) -> Chain:
        return Chain(self.chain.shapes, self.chain.start, self.chain.x, np.frombuffer(x))


def _poses(chain: Chain, eta: Array) -> tuple[Array, Array]:
    """Rotations (n, links, 3, 3) and positions (n, links, 3) of all sections of a chain."""
    n = chain.shapes.n
    inputs = {
        "b": chain.rest, "Bm": chain.slopes, "eta": eta[:, None], "etad": np.zeros(n),
    }  # fmt: skip
    segment = evaluate(builtin_kernel("sweep_modal", "segment"), inputs, n)
    outputs = {name: segment[name] for name in ("Om", "Omd", "Omdd")}
    motion = evaluate(
        builtin_kernel("sweep_modal", "segment_motion"), {"R_end": np.eye(3), **outputs}
    )
    rotations, positions = motion["R"].copy(), motion["d"].copy()
    for k, (_, before) in enumerate(chain.links):
        if before >= 0:
            positions[:, k] = positions[:, before] + np.einsum(
                "tij,tj->ti", rotations[:, before], positions[:, k]
            )
            rotations[:, k] = rotations[:, before] @ rotations[:, k]
    return rotations, positions
