"""Closed loops linearised about moving or accelerating states.

Loops restrict all speeds to u = N(q) v with independent speeds v.  Perturbations of a state are
dq = N x with x' = G_x x + dv, and

    du = N dv + S x,    S x = (dN along N x) v,    da = N dv' + B dv + T x.

Accelerations a(q, u) that keep the loops closed are N v' + b with b quadratic in the speeds.  Hence
B, the derivative a_u N less N times its independent rows, is twice a symmetric bilinear form of two
speeds.  S is this form except for the order of its arguments: perturbations do not commute where
coordinates are not integrals of the speeds (dphi' = G dphi + du), so that

    S = (B - G N + N G_x) / 2.

No finite differences are involved.  Nonholonomic rows (rolling discs) restrict speeds that are not
rates of coordinates and lack this symmetry; see `nonholonomic`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from mstmm.array_validation import Array

from ..mck_matrices import Matrices


@dataclass(frozen=True, eq=False)
class Motion:
    """Derivatives with respect to n independent perturbations x and their speeds v.

    Attributes:
        swept: (nu, n) S, change of all speeds for a unit of each x at the same v.
        going, placed: (n, n) derivatives of the independent accelerations by v and by x.
        bent, shifted: (nu, n) B and T, dependent parts of the derivatives of all accelerations.
        turning: (n, n) G_x, 1/s; None where x are integrals of v.
    """

    swept: Array
    going: Array
    placed: Array
    bent: Array
    shifted: Array
    turning: Array | None

    @classmethod
    def of(cls, slopes: Mapping[str, Array], places: Sequence[int], ways: Array) -> Motion:
        """Build from derivatives (nu, nu) of accelerations that keep the loops closed.

        `slopes` has the names of `Derivatives`, `places` are the indices of the n independent
        speeds, `ways` is N (nu, n).
        """
        own, by_speed, turned = list(places), slopes["u"] @ ways, slopes["rate_q"] @ ways
        bent = by_speed - ways @ by_speed[own]
        swept = (bent - turned + ways @ turned[own]) / 2
        by_place = slopes["q"] @ ways + slopes["u"] @ swept
        turning = turned[own] if turned.any() else None
        shifted = by_place - ways @ by_place[own]
        return cls(swept, by_speed[own], by_place[own], bent, shifted, turning)

    def matrices(self, mass: Array) -> Matrices:
        """M, C, K of M dv' + C dv + K x = 0 from the mass matrix M (n, n) along x."""
        return Matrices(mass, -mass @ self.going, -mass @ self.placed)

    def below(self, order: int) -> Iterator[tuple[int, Array]]:
        """Lower-order terms (order, (nu, n)) of all speeds (1) or accelerations (2)."""
        if order == 1:
            yield 0, self.swept
        if order == 2:
            yield 1, self.bent
            yield 0, self.shifted
