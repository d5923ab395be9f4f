"""Truncation error of the shapes of an elastic body in its static deflection."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mstmm.array_validation import Array


@dataclass(frozen=True)
class Truncation:
    """Static deflection of an elastic body under unit loads, in full and by its shapes.

    The loads are, in this order: force and moment (6) about the point of each of `ports`, the loads
    rho r0_a e_b (9, b running fastest) and -rho phi_k of a unit acceleration of each shape; body
    axes, all balanced by rigid accelerations of the body.

    Attributes:
        full_response, shape_response: (6 p, m) displacement and rotation of the ports per unit
            load, of the full model and of the shapes, relative to the mean motion of the mass.
    """

    ports: tuple[str, ...]
    full_response: Array
    shape_response: Array

    def missed_share(self, loads: Array, length: float) -> Array:
        """Share (n,) of the port deflection under `loads` (n, m) that the shapes do not represent.

        A radian counts as `length` (m); 0 without deflection.
        """
        sizes = np.tile(np.repeat([1.0, length], 3), len(self.ports))
        whole, missing = (
            np.linalg.norm(loads @ (deflection * sizes[:, None]).T, axis=1)
            for deflection in (self.full_response, self.full_response - self.shape_response)
        )
        return np.divide(
            missing, whole, out=np.zeros_like(whole), where=(whole > 0) & np.isfinite(whole)
        )
