"""Number of modes of an undamped scene below a frequency.

The number of omega^2 below `square` is the number of negative eigenvalues of K - square M, which
for a tree is that of the pivots of its sweep (Sylvester; Wittrick and Williams, Q. J. Mech. Appl.
Math. 24 (1971) 263-284).

The pivots do not include the coupling by springs between bodies.  Let A be K - square M and T the
same matrix of the tree with these springs connected to the ground (`with_springs_grounded`).  Both
are symmetric if loads have a potential, and A - T has low rank.  If the columns of W span
T^-1 (A - T), then A x = T x for every x with W^T T x = 0, so that such x are not coupled with W
(Haynsworth, Linear Algebra Appl. 1 (1968) 73-81):

    negative(A) = negative(T) + negative(W^T A W) - negative(W^T T W).
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from mstmm.array_validation import Array

from .frozen_loads import with_springs_grounded
from .matrix_operators import Pencil

#: Upper bound of the rank of the stiffness of one spring between two bodies.
_SPRING_RANK = 12
#: Relative size below which a column is linearly dependent, and relative asymmetry above which a
#: matrix does not count as symmetric.
_NEW, _SYMMETRIC = 1e-12, 1e-6


class ModeCounter:
    """Counter of the modes of one scene."""

    def __init__(self, pencil: Pencil) -> None:
        self.full_pencil = self.tree = pencil
        if pencil.tangent.off_tree_count:
            apart = with_springs_grounded(pencil.tangent.engine, pencil.state)
            self.tree = Pencil(apart, pencil.state, pencil.free.tolist())

    def count_below(self, square: float) -> int | None:
        """Number of omega^2 below `square`.

        None if loads other than springs couple branches of the tree, or have no potential.
        """
        efforts = self._efforts
        self.tree.factor(-square)
        count = self.tree.tangent.count_negative()
        if count is None or not efforts.size:
            return count
        more = self._count_difference(
            square, _basis([self.tree.solve(column) for column in efforts.T])
        )
        return None if more is None else count + more

    @cached_property
    def _efforts(self) -> Array:
        """Basis (n, r) of the coupling efforts of springs between bodies.

        It is found from random displacements, as many as the rank of the coupling can be.
        """
        n = len(self.full_pencil)
        if self.tree is self.full_pencil:
            return np.zeros((n, 0))
        forces = len(self.tree.tangent.engine.packed.system.forces)
        moves = np.random.default_rng(0).standard_normal((min(n, _SPRING_RANK * forces), n))
        return _basis([self.full_pencil.stiffness(x) - self.tree.stiffness(x) for x in moves])

    def _count_difference(self, square: float, w: Array) -> int | None:
        """Number of negative eigenvalues of A less that of T; None if either is not symmetric."""
        counts = []
        for pencil in (self.full_pencil, self.tree):
            pressed = [pencil.stiffness(x) - square * pencil.mass(x) for x in w.T]
            matrix = w.T @ np.array(pressed).T
            if np.abs(matrix - matrix.T).max() > _SYMMETRIC * np.abs(matrix).max():
                return None
            counts.append(int((np.linalg.eigvalsh((matrix + matrix.T) / 2) < 0).sum()))
        return counts[0] - counts[1]


def _basis(columns: list[Array]) -> Array:
    """Orthonormal basis (n, r) of columns (n,)."""
    left, sizes, _ = np.linalg.svd(np.array(columns).T, full_matrices=False)
    return left[:, sizes > _NEW * sizes.max(initial=0)]
