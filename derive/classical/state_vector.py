"""State vectors of the acceleration form and the transfer matrix that premises imply.

Source: Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems: Theory and Applications,
Wiley 2019, ch. 5, (5.1) to (5.7).  Spatial states are [rdd; omegadot; m; q; 1] (13 numbers),
planar ones [rdd; thetadd; m; q; 1] (7 numbers), all in inertial axes.  m and q are the moment and
the force of the inboard on the outboard side.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from ..definition.derivation import Equation, vector
from ..definition.notation import Matrix, solve_linear

BOOK = "Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, Wiley 2019, ch. 5"


@dataclass(frozen=True)
class StateVector:
    """Blocks of a state vector: names, lengths and units, without the final 1."""

    names: tuple[str, ...]
    sizes: tuple[int, ...]
    units: tuple[str, ...]

    @property
    def length(self) -> int:
        """Number of entries, including the final 1."""
        return sum(self.sizes) + 1

    @property
    def accelerations(self) -> int:
        """Number of acceleration entries; they come first, followed by as many forces."""
        return self.sizes[0] + self.sizes[1]

    def end_blocks(self, end: str) -> tuple[sp.MatrixSymbol, ...]:
        """Blocks at the end called `end`, e.g. rdd_I, omegadot_I, m_I, q_I."""
        blocks = zip(self.names, self.sizes, strict=True)
        return tuple(vector(f"{name}_{end}", size) for name, size in blocks)

    @property
    def unit(self) -> str:
        """Units of the blocks, in order."""
        return "[" + ", ".join(self.units) + "]"


SPATIAL = StateVector(
    ("rdd", "omegadot", "m", "q"), (3, 3, 3, 3), ("m/s2", "rad/s2", "N*m", "N", "1")
)
PLANAR = StateVector(
    ("rdd", "thetadd", "m", "q"), (2, 1, 1, 2), ("m/s2", "rad/s2", "N*m", "N", "1")
)


def transfer_matrix(premises: Sequence[Equation], state: StateVector) -> Matrix:
    """U with z_O = U z_I, solved from premises linear in the blocks at I and O."""
    rows = solve_linear(premises, state.end_blocks("O"), state.end_blocks("I"))
    return append_affine_row(rows)


def append_affine_row(rows: Matrix) -> Matrix:
    """Rows of a transfer matrix with the final row 0 ... 0 1."""
    return Matrix(rows.col_join(sp.Matrix([[0] * (rows.cols - 1) + [1]])))


def force_scale(transfer: Matrix, state: StateVector) -> Matrix:
    """Sum of the magnitudes of the terms of d(m, q)_O / d(accelerations)_I, entry by entry.

    What a pivot that a hinge forms from these entries is compared with: it is small against this
    scale exactly when the terms cancel.
    """
    n = state.accelerations
    block = transfer[n : 2 * n, :n]
    return Matrix(block).applyfunc(
        lambda entry: sp.Add(*(sp.Abs(term) for term in sp.Add.make_args(sp.expand(entry))))
    )
