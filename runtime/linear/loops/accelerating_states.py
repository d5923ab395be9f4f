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
        speed_derivatives, position_derivatives: (n, n) derivatives of the independent accelerations
            by v and by x.
        dependent_speed_part, dependent_position_part: (nu, n) B and T, dependent parts of the
            derivatives of all accelerations.
        rate_matrix: (n, n) G_x, 1/s; None where x are integrals of v.
    """

    swept: Array
    speed_derivatives: Array
    position_derivatives: Array
    dependent_speed_part: Array
    dependent_position_part: Array
    rate_matrix: Array | None

    @classmethod
    def from_derivatives(
        cls, slopes: Mapping[str, Array], speed_indices: Sequence[int], motion_basis: Array
    ) -> Motion:
        """Build from derivatives (nu, nu) of accelerations that keep the loops closed.

        `slopes` has the names of `Derivatives`, `speed_indices` are those of the n independent
        speeds, `motion_basis` is N (nu, n).
        """
        own, by_speed, turned = (
            list(speed_indices),
            slopes["u"] @ motion_basis,
            slopes["rate_q"] @ motion_basis,
        )
        bent = by_speed - motion_basis @ by_speed[own]
        swept = (bent - turned + motion_basis @ turned[own]) / 2
        by_place = slopes["q"] @ motion_basis + slopes["u"] @ swept
        turning = turned[own] if turned.any() else None
        shifted = by_place - motion_basis @ by_place[own]
        return cls(swept, by_speed[own], by_place[own], bent, shifted, turning)

    def matrices(self, mass: Array) -> Matrices:
        """M, C, K of M dv' + C dv + K x = 0 from the mass matrix M (n, n) along x."""
        return Matrices(mass, -mass @ self.speed_derivatives, -mass @ self.position_derivatives)

    def lower_order_terms(self, order: int) -> Iterator[tuple[int, Array]]:
        """Lower-order terms (order, (nu, n)) of all speeds (1) or accelerations (2)."""
        if order == 1:
            yield 0, self.swept
        if order == 2:
            yield 1, self.dependent_speed_part
            yield 0, self.dependent_position_part
