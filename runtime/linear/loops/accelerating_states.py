"""What speeds do in closed loops beside a state that moves or does not last.

Loops let all speeds be u = N(q) v with independent v.  Beside a state increments go along as
dq = N x with x' = G_x x + dv, and

    du = N dv + S x,    S x = (dN along N x) v,    da = N dv' + B dv + T x.

Accelerations a(q, u) that keep loops closed are N v' + b with b quadratic in the speeds, so that
B, their slopes a_u N less what goes by independent ones, is twice a symmetric form of two speeds.
S is that form but for the order of the two, in which increments do not commute where coordinates
are no integrals of speeds (dphi' = G dphi + du):

    S = (B - G N + N G_x) / 2.

Nothing in this takes a difference.  Rows of speeds that are no rates of any place (discs that roll)
have no such symmetry; see `nonholonomic`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from mstmm.array_validation import Array

from ..mck_matrices import Matrices


@dataclass(frozen=True, eq=False)
class Motion:
    """Slopes along n independent motions x and their speeds v.

    Attributes:
        swept: (nu, n) S, speeds for a unit of each x at the same v.
        going, placed: (n, n) of the independent accelerations by v and by x.
        bent, shifted: (nu, n) B and T, what they leave of all accelerations.
        turning: (n, n) G_x; None where x are integrals of v.
    """

    swept: Array
    going: Array
    placed: Array
    bent: Array
    shifted: Array
    turning: Array | None

    @classmethod
    def of(cls, slopes: Mapping[str, Array], places: Sequence[int], ways: Array) -> Motion:
        """From the slopes (nu, nu) of accelerations along motions that keep loops closed, by the
        names of `Derivatives`."""
        own, by_speed, turned = list(places), slopes["u"] @ ways, slopes["rate_q"] @ ways
        bent = by_speed - ways @ by_speed[own]
        swept = (bent - turned + ways @ turned[own]) / 2
        by_place = slopes["q"] @ ways + slopes["u"] @ swept
        turning = turned[own] if turned.any() else None
        shifted = by_place - ways @ by_place[own]
        return cls(swept, by_speed[own], by_place[own], bent, shifted, turning)

    def matrices(self, mass: Array) -> Matrices:
        """M, C and K with the mass matrix M (n, n) along x: M dv' + C dv + K x = 0."""
        return Matrices(mass, -mass @ self.going, -mass @ self.placed)

    def below(self, order: int) -> Iterator[tuple[int, Array]]:
        """(order, (nu, n)): what speeds (1) and accelerations (2) have besides of lower rates."""
        if order == 1:
            yield 0, self.swept
        if order == 2:
            yield 1, self.bent
            yield 0, self.shifted
