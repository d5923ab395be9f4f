"""Bending by Hermite finite elements: frequencies, static stability, follower forces.

An axial force N(x) (tension positive) adds int N w'^2; turning with Omega in the plane of bending
takes Omega^2 int rho A w^2.  Nothing here knows of floating frames.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.linalg

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Matrices:
    """M, K, and the matrix of int N w'^2 for deflection and slope at every node."""

    M: Array
    K: Array
    axial: Array


def _hermite(xi: Array, h: float, d: int) -> Array:
    """d-th derivative of the four cubic shapes of an element of length h, (4, m)."""
    series = [(1, 0, -3, 2), (0, h, -2 * h, h), (0, 0, 3, -2), (0, 0, -h, h)]
    return np.array([np.polynomial.Polynomial(c).deriv(d)(xi) / h**d for c in series])


def beam(
    length: float,
    stiffness: float = 1.0,
    mass: float = 1.0,
    tension: Callable[[Array], Array] | None = None,
    elements: int = 60,
) -> Matrices:
    """A uniform beam with free ends; coordinates w_0, w'_0, w_1, w'_1, ..."""
    size, h = 2 * elements + 2, length / elements
    out = Matrices(*(np.zeros((size, size)) for _ in range(3)))
    points, weights = np.polynomial.legendre.leggauss(6)
    xi, weights = (points + 1) / 2, weights / 2 * h
    w, slope, bend = (_hermite(xi, h, d) for d in range(3))
    for e in range(elements):
        at = slice(2 * e, 2 * e + 4)
        out.M[at, at] += mass * (w * weights) @ w.T
        out.K[at, at] += stiffness * (bend * weights) @ bend.T
        if tension is not None:
            out.axial[at, at] += (slope * weights * tension((e + xi) * h)) @ slope.T
    return out


def frequencies(M: Array, K: Array, held: list[int], count: int) -> Array:
    """Lowest frequencies in rad/s; negative for a negative square."""
    keep = np.setdiff1d(np.arange(len(M)), np.array(held) % len(M))
    squares = scipy.linalg.eigh(K[np.ix_(keep, keep)], M[np.ix_(keep, keep)], eigvals_only=True)
    return np.asarray(np.sign(squares[:count]) * np.sqrt(np.abs(squares[:count])))


CLAMPED, PINNED = [0, 1], [0]


def rotating(hub: float, spin: float, lag: bool, count: int, elements: int = 60) -> Array:
    """Frequencies of a clamped unit beam (L, rho A, EI all 1) on a hub of radius `hub`, turning
    with `spin`: flap, or lag (in the plane of turning)."""

    def tension(x: Array) -> Array:
        return spin**2 * (hub * (1 - x) + (1 - x**2) / 2)

    own = beam(1.0, tension=tension, elements=elements)
    return frequencies(own.M, own.K + own.axial - lag * spin**2 * own.M, CLAMPED, count)


def hanging(stiffness: float, gravity: float, count: int, elements: int = 60) -> Array:
    """Frequencies of a pinned hanging unit beam."""
    own = beam(1.0, stiffness, tension=lambda x: gravity * (1 - x), elements=elements)
    return frequencies(own.M, own.K + own.axial, PINNED, count)


def self_weight_buckling(elements: int = 60) -> float:
    """rho A g L^3 / EI at which a clamped standing beam buckles."""
    own = beam(1.0, tension=lambda x: 1 - x, elements=elements)
    loads = scipy.linalg.eigh(own.axial[2:, 2:], own.K[2:, 2:], eigvals_only=True)
    return float(1 / loads[-1])


def follower(own: Matrices, load: float, end: int) -> Array:
    """Stiffness under `load` times the axial force, which follows the slope at node `end`.

    `own.axial` belongs to a unit load; `end` -1: pushed at the last node towards the first, 0:
    pushed at the first node towards the last.
    """
    K = own.K + load * own.axial
    at = len(K) - 2 if end else 0
    # Lateral part of the follower force on the node: -P w' at the last node, +P w' at the first.
    K[at, at + 1] += load if end else -load
    return K


def flutter(own: Matrices, held: list[int], end: int, low: float, high: float) -> float:
    """Load between low and high at which two frequencies meet and go complex, by bisection."""
    keep = np.setdiff1d(np.arange(len(own.M)), held)
    inverse = np.linalg.inv(own.M[np.ix_(keep, keep)])

    def unstable(load: float) -> bool:
        K = follower(own, load, end)[np.ix_(keep, keep)]
        squares = np.linalg.eigvals(inverse @ K)
        return bool(np.abs(squares.imag).max() > 1e-3 * max(1.0, load))

    for _ in range(40):
        middle = (low + high) / 2
        low, high = (low, middle) if unstable(middle) else (middle, high)
    return (low + high) / 2


def beck(elements: int = 16) -> float:
    """Flutter load of a clamped unit beam under a tangential force at its tip (Beck's column)."""
    own = beam(1.0, tension=lambda x: -np.ones_like(x), elements=elements)
    return flutter(own, CLAMPED, -1, 10.0, 30.0)


def thrust(elements: int = 16) -> float:
    """Flutter load of a free unit beam under a following end thrust (Beal's problem)."""
    own = beam(1.0, tension=lambda x: -(1 - x), elements=elements)
    return flutter(own, [], 0, 60.0, 130.0)


def l_frame(first: float, second: float, stiffness: float, count: int, elements: int = 40) -> Array:
    """Frequencies of two inextensible beams welded at a right angle, the first one's root pinned.

    The corner moves across the first beam and takes the second along its axis; across the second
    beam it does not move, and both have one slope there.
    """
    a, b = (beam(x, stiffness, elements=elements) for x in (first, second))
    n = len(a.M)
    M, K = scipy.linalg.block_diag(a.M, b.M), scipy.linalg.block_diag(a.K, b.K)
    M[n - 2, n - 2] += second  # unit mass per length, carried along
    tie = np.delete(np.eye(2 * n), n + 1, axis=1)
    tie[n + 1, n - 1] = 1.0
    M, K = tie.T @ M @ tie, tie.T @ K @ tie
    return frequencies(M, K, [0, n], count + 1)[1:]
