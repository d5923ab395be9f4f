"""Writes wing.npz: one wing of the boom, a tapered lattice of steel tubes with three chords.

    python examples/spray_boom/make_wing.py

Euler-Bernoulli tubes with six unknowns a node, y outward, z up, the root in the plane y = 0.  Half
of each tube's mass sits in each of its nodes, pipes and nozzles in those of the lower chords;
rotations of nodes carry no mass.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from mstmm.runtime.flexible.elastic import save_matrices

Array = NDArray[np.float64]

YOUNG, SHEAR, DENSITY = 2.1e11, 8.1e10, 7850.0  # Pa, Pa, kg/m3: steel
LENGTH, BAYS = 13.2, 11  # m
ROOT, TIP = (0.44, 0.62), (0.20, 0.24)  # m: width (fore and aft) and height of the section
CHORD, BRACE = (0.040, 0.0025), (0.025, 0.002)  # m: side and wall of the square tubes
PIPES = 2.4  # kg/m of wing: lines, nozzles and liquid


def nodes() -> Array:
    """(3 (BAYS + 1), 3) m: front and rear lower chord, upper chord, station by station."""
    found = []
    for part in np.linspace(0, 1, BAYS + 1):
        width, height = (a + (b - a) * part for a, b in zip(ROOT, TIP, strict=True))
        y = LENGTH * part
        found += [(width / 2, y, -height / 3), (-width / 2, y, -height / 3), (0, y, 2 * height / 3)]
    return np.array(found)


def tubes() -> list[tuple[int, int, tuple[float, float]]]:
    """Pairs of nodes with the tube between them."""
    found = []
    for k in range(BAYS + 1):
        a = 3 * k
        found += [(a + i, a + (i + 1) % 3, BRACE) for i in range(3)]
        if k < BAYS:
            found += [(a + i, a + i + 3, CHORD) for i in range(3)]
            # Diagonals in zigzag, so that a torque meets them alike both ways.
            ahead = [(i, (i + 1) % 3) if k % 2 else ((i + 1) % 3, i) for i in range(3)]
            found += [(a + i, a + 3 + j, BRACE) for i, j in ahead]
    return found


def stiffness(ends: Array, side: float, wall: float) -> Array:
    """(12, 12) of one square tube in the axes of the wing."""
    inner = side - 2 * wall
    area, bending = side**2 - inner**2, (side**4 - inner**4) / 12
    twist = wall * (side - wall) ** 3  # Bredt: 4 A^2 t / s
    along = ends[1] - ends[0]
    h = float(np.linalg.norm(along))
    local = np.zeros((12, 12))
    bond = np.array([[1.0, -1], [-1, 1]]) / h
    bend = np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h],
                     [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]])  # fmt: skip
    flip = np.diag([1.0, -1, 1, -1])  # the slope of w is minus the rotation about y
    for places, part in (
        ([0, 6], YOUNG * area * bond),
        ([3, 9], SHEAR * twist * bond),
        ([1, 5, 7, 11], YOUNG * bending / h**3 * bend),
        ([2, 4, 8, 10], YOUNG * bending / h**3 * flip @ bend @ flip),
    ):
        local[np.ix_(places, places)] += part
    x = along / h
    y = np.cross(np.eye(3)[int(np.argmin(np.abs(x)))], x)
    y /= np.linalg.norm(y)
    turn = np.kron(np.eye(4), np.stack([x, y, np.cross(x, y)]))
    return np.asarray(turn.T @ local @ turn)


def assembled() -> tuple[Array, Array, Array]:
    """Masses of the nodes (N,), stiffness (6 N, 6 N) and places (N, 3) of the free wing."""
    places = nodes()
    masses, k = np.zeros(len(places)), np.zeros((6 * len(places),) * 2)
    for first, last, (side, wall) in tubes():
        both = [first, last]
        h = float(np.linalg.norm(places[last] - places[first]))
        masses[both] += DENSITY * (side**2 - (side - 2 * wall) ** 2) * h / 2
        at = np.concatenate([6 * n + np.arange(6) for n in both])
        k[np.ix_(at, at)] += stiffness(places[both], side, wall)
    lower = np.arange(len(places)) % 3 < 2
    share = np.where(places[:, 1] % LENGTH == 0, 0.5, 1.0) * lower
    masses += PIPES * LENGTH * share / share.sum()
    return masses, k, places


def main() -> None:
    """Write the file and say what the wing weighs."""
    masses, k, places = assembled()
    mass = sparse.kron(sparse.diags_array(masses), np.diag([1.0, 1, 1, 0, 0, 0]))
    save_matrices(Path(__file__).with_name("wing.npz"), mass, sparse.csr_array(k), places)
    centre = masses @ places / masses.sum()
    print(f"{masses.sum():.13g} kg, centre at {centre.round(6)} m, {len(k)} unknowns")


if __name__ == "__main__":
    main()
