"""What the shapes of an elastic body miss of its deflection under its loads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mstmm.array_validation import Array


@dataclass(frozen=True)
class Truncation:
    """Deflection of an elastic body at rest under its loads, and what its shapes have of it.

    The loads are, in this order: force and moment (6) about the point of each of `ports`, the loads
    rho r0_a e_b (9, b running fastest) and -rho phi_k of a unit acceleration of each shape; body
    axes, all in balance by rigid accelerations of the body.

    Attributes:
        whole, kept: (6 p, m) displacement and rotation of the ports under a unit of each load, of
            the whole body and of its shapes; against the mean motion of the mass.
    """

    ports: tuple[str, ...]
    whole: Array
    kept: Array

    def missed(self, loads: Array, length: float) -> Array:
        """(n,) part of the deflection of the ports under loads (n, m) that the shapes miss, 0 of
        none; a radian counts as `length` (m)."""
        sizes = np.tile(np.repeat([1.0, length], 3), len(self.ports))
        whole, missing = (
            np.linalg.norm(loads @ (of * sizes[:, None]).T, axis=1)
            for of in (self.whole, self.whole - self.kept)
        )
        return np.divide(
            missing, whole, out=np.zeros_like(whole), where=(whole > 0) & np.isfinite(whole)
        )
