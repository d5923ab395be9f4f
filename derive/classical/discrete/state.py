"""State vectors of the discrete-time form: positions, angles, loads, modal coordinates, 1.

Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, Wiley 2019, ch. 8, (8.63) to (8.65).
In the plane z = [r; theta; m; q; eta; 1], 7 + n numbers (10 with three modes), in space z = [r;
psi; m; q; eta; 1], 13 + n.  r is the position of the section, theta the angle of the floating
frame, psi the rotation vector (inertial axes) from the frame's predicted orientation to the unknown
one, eta the modal coordinates of the body that the end belongs to (rigid: none).  m and q are the
moment and the force of the inboard on the outboard side, inertial axes.
"""

from __future__ import annotations

import sympy as sp

from ...definition.derivation import tilde
from ...definition.notation import Matrix
from ..state_vector import StateVector

BOOK = "Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, Wiley 2019, ch. 8"


class Space:
    """Plane or space: sizes, cross products and units of a state."""

    def __init__(self, planar: bool) -> None:
        self.planar = planar
        self.name = "planar" if planar else "spatial"
        self.translation_count, self.rotation_count = (2, 1) if planar else (3, 3)
        self.angle = "theta" if planar else "psi"

    @property
    def rigid_count(self) -> int:
        """Number of rigid degrees of freedom."""
        return self.translation_count + self.rotation_count

    def state(self, modes: int) -> StateVector:
        """State vector of an end of a body with this number of modes."""
        has_modes = bool(modes)
        return StateVector(
            ("r", self.angle, "m", "q", *("eta",) * has_modes),
            (
                self.translation_count,
                self.rotation_count,
                self.rotation_count,
                self.translation_count,
                *(modes,) * has_modes,
            ),
            ("m", "rad", "N*m", "N", *("m",) * has_modes, "1"),
        )

    def length(self, modes: int) -> int:
        """Number of entries of a state."""
        return 2 * self.rigid_count + modes + 1

    def moment(self, lever: sp.Basic, force: sp.Basic) -> sp.Basic:
        """lever x force, for a column `lever` and the rows `force` of a state (or a column)."""
        return rotate_plane_column(lever).T * force if self.planar else tilde(lever) * force

    def rotate(self, column: sp.Basic, angle: sp.Basic) -> sp.Basic:
        """angle x column, for the rows `angle` of a small rotation."""
        return rotate_plane_column(column) * angle if self.planar else -tilde(column) * angle

    def change_moment(self, change: sp.Basic, force: sp.Basic) -> sp.Basic:
        """change x force, for the rows `change` of a small displacement and a column `force`."""
        return -rotate_plane_column(force).T * change if self.planar else -tilde(force) * change


def rotate_plane_column(column: sp.Basic) -> Matrix:
    """Plane column rotated by +90 degrees, entry by entry."""
    return Matrix([-column[1, 0], column[0, 0]])


PLANE, SPACE = Space(True), Space(False)


def rows_of(state: StateVector, name: str) -> Matrix:
    """Rows of the unit matrix that select block `name` of a state ("1": the last number)."""
    starts = dict(zip(state.names, _block_starts(state), strict=True)) | {"1": state.length - 1}
    sizes = dict(zip(state.names, state.sizes, strict=True)) | {"1": 1}
    start = starts[name]
    return Matrix(sizes[name], state.length, lambda i, j: int(j == start + i))


def _block_starts(state: StateVector) -> list[int]:
    return [sum(state.sizes[:k]) for k in range(len(state.sizes))]


def row_block(matrix: sp.MatrixSymbol, first: int, count: int) -> Matrix:
    """`count` rows of a matrix symbol."""
    return Matrix(count, int(matrix.cols), lambda i, j: matrix[first + i, j])


def constant_rows(column: sp.Basic, state: StateVector) -> sp.MatrixExpr:
    """`column` in the last column of rows on a state."""
    return column * rows_of(state, "1")
