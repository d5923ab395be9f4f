"""Mass integrals of an undeformed flexible body, which determine its inertia forces."""

from __future__ import annotations

from dataclasses import dataclass

from mstmm.array_validation import Array


@dataclass(frozen=True)
class Moments:
    """Integrals of the fields 1, r0, phi, g over a density (frame axes, about F's origin).

    C[a, k] = int phi_a,k;  E[a, b, k] = int r0_a phi_b,k;  F[a, b, k, l] = int phi_a,k phi_b,l;
    G[a, k, l] = int g_a,kl;  X[a, b, k, l] = int r0_a g_b,kl.
    """

    mass: float
    first: Array  #: (3,) int r0
    second: Array  #: (3, 3) int r0 r0^T
    C: Array  #: (3, n)
    E: Array  #: (3, 3, n)
    F: Array  #: (3, 3, n, n)
    G: Array  #: (3, n, n)
    X: Array  #: (3, 3, n, n)
